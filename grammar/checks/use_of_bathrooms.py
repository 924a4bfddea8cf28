"""Faults of use in bathrooms: paper that is out of reach."""

from __future__ import annotations

import math

from grammar.checks.furnished import Furnished

REACH_M = 0.9


def paper_out_of_reach(found: Furnished) -> list[int]:
    """Return paper holders with a toilet in the room, but none within ``REACH_M``, middle to middle."""
    toilets = found.having("toilet")
    return [
        item.id
        for item in found.having("paper")
        if toilets and min(math.dist(item.position_m[:2], toilet.position_m[:2]) for toilet in toilets) > REACH_M
    ]
