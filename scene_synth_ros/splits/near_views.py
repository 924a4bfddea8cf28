"""Views of a room that are nearly equal to one before: near poses, and pictures that agree.

Positions are kept in a grid of cells as wide as the greatest distance, so a view is compared with those of 27 cells only, and the time
grows with the number of views, not with its square, as long as views that look different do not crowd at one place.
"""

import math
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from scene_description.products import norm
from scene_synth_ros.splits.assignment import SplitError
from scene_synth_ros.splits.frame_facts import FrameFacts

_NEIGHBOURS = tuple(product((-1, 0, 1), repeat=3))
_Cell = tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearness:
    """When two views of a room are nearly equal: all of it must hold.

    Attributes:
        distance_m: between the cameras, at most.
        angle_rad: that one camera is turned from the other, at most.
        ids_equal: share of the points of the small id images that must be equal, at least.
        luma_difference: mean difference of the small pictures' luma, 0 to 1, at most.
    """

    distance_m: float
    angle_rad: float
    ids_equal: float = 0.9
    luma_difference: float = 0.05


@dataclass(slots=True)
class KeptViews:
    """The views of one room by one camera that stayed so far."""

    near: Nearness
    _cells: dict[_Cell, list[FrameFacts]] = field(default_factory=dict)

    def equal_to(self, facts: FrameFacts) -> int | None:
        """Return the number of a view that this one nearly equals, the first that stayed; keep it and return None if there is none."""
        cell = self._cell(facts)
        found = [
            kept.number
            for offset in _NEIGHBOURS
            for kept in self._cells.get((cell[0] + offset[0], cell[1] + offset[1], cell[2] + offset[2]), ())
            if nearly_equal(facts, kept, self.near)
        ]
        if found:
            return min(found)
        self._cells.setdefault(cell, []).append(facts)
        return None

    def _cell(self, facts: FrameFacts) -> _Cell:
        x, y, z = (math.floor(value / self.near.distance_m) for value in facts.position_m)
        return x, y, z


def nearly_equal(one: FrameFacts, other: FrameFacts, near: Nearness) -> bool:
    """Return whether two views are nearly equal; of pictures that are not recorded nothing is asked."""
    if float(norm(one.position_m - other.position_m)) > near.distance_m or turn_rad(one, other) > near.angle_rad:
        return False
    if one.ids is not None and other.ids is not None:
        if one.ids.shape != other.ids.shape or float(np.mean(one.ids == other.ids)) < near.ids_equal:
            return False
    if one.thumbnail is not None and other.thumbnail is not None:
        if one.thumbnail.shape != other.thumbnail.shape:
            return False
        difference = np.abs(one.thumbnail.astype(np.int16) - other.thumbnail)
        return float(np.mean(difference)) <= 255.0 * near.luma_difference
    return True


def turn_rad(one: FrameFacts, other: FrameFacts) -> float:
    """Return the angle of the rotation that takes one camera's axes to the other's, from the trace of their product."""
    cosine = (float(np.sum(one.axes * other.axes)) - 1.0) / 2.0
    return math.acos(min(1.0, max(-1.0, cosine)))


def read_nearness(words: str) -> Nearness:
    """Read ``DISTANCE:ANGLE``, metres and degrees, with ``:IDS:LUMA`` after it where the pictures' agreement is to be another.

    Raises:
        SplitError: it is none.
    """
    try:
        values = [float(word) for word in words.split(":")]
    except ValueError:
        values = []
    most = (math.inf, 180.0, 1.0, 1.0)
    if not 2 <= len(values) <= 4 or not all(0.0 <= value <= top for value, top in zip(values, most, strict=False)) or not values[0] > 0.0:
        raise SplitError(f"--near {words}: expected METRES:DEGREES[:IDS[:LUMA]], as 0.05:5 or 0.05:5:0.9:0.05, with METRES above 0")
    names = dict(zip(("ids_equal", "luma_difference"), values[2:], strict=False))
    return Nearness(distance_m=values[0], angle_rad=math.radians(values[1]), **names)
