# SPDX-License-Identifier: MIT
"""Measured tables in the documentation: each stands between two markers and is written there by the program that measures."""


def fill(path, name, lines):
    """Put lines between the markers of that name in a text."""
    text = path.read_text(encoding="utf-8")
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise ValueError(f"{path} must contain the lines {begin.strip()} and {end} once each")
    head, rest = text.split(begin)
    _, tail = rest.split(end)
    path.write_text(head + begin + "\n".join(lines) + "\n" + end + tail, encoding="utf-8")
