# SPDX-License-Identifier: MIT
"""Shares of the stages of a step: the only place that reads describe()."""

import re

_STAGE = re.compile(r"\s*(.+?) (\d+) %(?:,|$)")


def shares(description):
    """{stage: share of the steps so far without the Forces, 0 to 1} from what describe() says; empty before a step."""
    for line in description.splitlines():
        head, _, rest = line.partition(":")
        if head.startswith("cost of the steps"):
            return {name: int(percent) / 100 for name, percent in _STAGE.findall(rest)}
    return {}
