"""Where small things can lie: support surfaces and rests of furniture, as rectangles in the frame of their owner."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Boxes
from grammar.geometry.solids import rest_top, surface_top
from grammar.spec.categories import Category
from scene_description import SceneObject

_READ_M = 0.05
"""Surface that stays free at each side of a screen or keyboard, in front of it."""

_FLAT_M, _FREE_HEIGHT_M = 0.03, 0.6
"""What is lower than the first may lie there still: papers, a remote control."""


class Top(NamedTuple):
    """A rectangle that carries things, in its owner's frame, metres: height, middle, half depth, half width."""

    z: float
    x: float
    y: float
    half_depth: float
    half_width: float

    @property
    def area_m2(self) -> float:
        """Area of the rectangle."""
        return 4.0 * self.half_depth * self.half_width


def tops_of(category: Category, item: SceneObject, *, seat: bool) -> list[Top]:
    """Return the support surfaces of an object, of a seat its rests."""
    if seat:
        return [Top(*rest_top(rest, item.size_m)) for rest in category.rests]
    found = []
    for surface in category.surfaces:
        z, half_depth, half_width = surface_top(surface, item.size_m)
        found.append(Top(z, 0.0, 0.0, half_depth, half_width))
    return found


def whole_box(item: SceneObject) -> Boxes:
    """Return an object's own box, (8,), whatever its solids are."""
    return world_box(item, 0.0, 0.0, 0.0, item.size_m, 0.0)


def world_box(owner: SceneObject, x: float, y: float, z: float, size_m: tuple[float, float, float], turn: float) -> Boxes:
    """Return the (8,) box of a thing whose middle is at (x, y) in the owner's frame, and whose underside is z above the owner's."""
    c, s = math.cos(owner.yaw_rad), math.sin(owner.yaw_rad)
    yaw = owner.yaw_rad + turn
    bottom = owner.position_m[2] + z
    return np.array(
        [
            owner.position_m[0] + x * c - y * s,
            owner.position_m[1] + x * s + y * c,
            bottom,
            bottom + size_m[2],
            0.5 * size_m[0],
            0.5 * size_m[1],
            math.cos(yaw),
            math.sin(yaw),
        ]
    )


def kept_free(owner: SceneObject, top: Top, item: SceneObject) -> Boxes:
    """Return the (8,) box of what stays free of things before an object that people look at or type on, up to the surface's front edge."""
    dx, dy = item.position_m[0] - owner.position_m[0], item.position_m[1] - owner.position_m[1]
    c, s = math.cos(owner.yaw_rad), math.sin(owner.yaw_rad)
    x, y = dx * c + dy * s, dy * c - dx * s
    depth = max(top.x + top.half_depth - x, 0.01)
    return world_box(owner, x + 0.5 * depth, y, top.z + _FLAT_M, (depth, item.size_m[1] + 2.0 * _READ_M, _FREE_HEIGHT_M), 0.0)
