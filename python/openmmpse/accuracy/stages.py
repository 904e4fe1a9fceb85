# SPDX-License-Identifier: MIT
"""Shares of the stages of a step, as the platforms name them, and of the parts of the method they belong to."""

import re

#: part -> which stages of any platform belong to it; the first that fits
PARTS = {
    "positions": r"sorting|positions|neighbour",
    "pairs": r"velocities|real space",
    "pair noise": r"Lanczos",
    "grid": r"spreading|gathering|Fourier",
    "waves": r"waves|wave space",
    "moving box": r"moving box",
    "free draining": r"free draining",
}


def shares(times):
    """{stage: share of the steps so far, 0 to 1} from what getStageTimes() returns; empty before a step."""
    total = sum(times.values())
    return {stage: seconds / total for stage, seconds in times.items()} if total > 0 else {}


def partOf(stage):
    """The part of the method that a stage belongs to. Raises ValueError, naming it, for an unknown stage."""
    for part, pattern in PARTS.items():
        if re.search(pattern, stage):
            return part
    raise ValueError(f"the stage '{stage}' belongs to no part of the method; add it to {__name__}.PARTS")


def partsOf(times):
    """{part: share of the steps so far, 0 to 1} of all parts, 0 where nothing is done; empty before a step."""
    known = shares(times)
    parts = dict.fromkeys(PARTS if known else (), 0.0)
    for stage, share in known.items():
        parts[partOf(stage)] += share
    return parts
