"""Faults of use in bathrooms: mats that lie beneath furniture, paper that is out of reach."""

from __future__ import annotations

import math

import numpy as np

from grammar.checks.furnished import Furnished, in_boxes, world_points
from grammar.geometry.boxes import Z_LOW

COVERED_SHARE, REACH_M = 0.2, 0.9
_GRID, _ON_FLOOR_M = 9, 0.05


def mat_covered(found: Furnished) -> list[int]:
    """Return mats of which more than ``COVERED_SHARE`` lies beneath what stands on the floor."""
    low = found.boxes[found.boxes[:, Z_LOW] < _ON_FLOOR_M]
    steps = (np.arange(_GRID) + 0.5) / _GRID - 0.5
    bad = []
    for item in found.having("mat"):
        forward, left = np.meshgrid(steps * item.size_m[0], steps * item.size_m[1])
        if len(low) and in_boxes(world_points(item, forward, left), low).mean() > COVERED_SHARE:
            bad.append(item.id)
    return bad


def paper_out_of_reach(found: Furnished) -> list[int]:
    """Return paper holders with a toilet in the room, but none within ``REACH_M``, middle to middle."""
    toilets = found.having("toilet")
    return [
        item.id
        for item in found.having("paper")
        if toilets and min(math.dist(item.position_m[:2], toilet.position_m[:2]) for toilet in toilets) > REACH_M
    ]
