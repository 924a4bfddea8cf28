"""The walls of a room as arrays, and how far things stick out through them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from scene_description.types import Point2

Floats = NDArray[np.float64]


def wall_lengths(polygon_m: Sequence[Point2]) -> list[float]:
    """Return the length in metres of every wall, wall i from vertex i to i + 1."""
    return [math.dist(point, polygon_m[(i + 1) % len(polygon_m)]) for i, point in enumerate(polygon_m)]


def wall_rows(polygon_m: ArrayLike) -> tuple[Floats, Floats]:
    """Return the walls of a counter-clockwise floor outline.

    Returns:
        wall: (w, 7) start x, y, unit direction x, y, length, unit normal into the room x, y; world, metres.
        yaw: (w,) yaw of the normals, radians.
    """
    start = np.array(polygon_m, np.float64)
    step = np.roll(start, -1, 0) - start
    length = np.hypot(step[:, 0], step[:, 1])
    tangent = step / length[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    return np.column_stack([start, tangent, length, normal]), np.arctan2(normal[:, 1], normal[:, 0])


def reflex_vertices(polygon: Floats) -> Floats:
    """Return the (r, 2) vertices of a counter-clockwise outline that stick into the room."""
    before, after = polygon - np.roll(polygon, 1, 0), np.roll(polygon, -1, 0) - polygon
    return polygon[before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < -1e-12]


@njit(cache=True)
def outside_distance(wall: Floats, x: float, y: float) -> float:
    """Return how far a point lies outside the room whose walls are the rows of ``wall`` (see Problem), 0 inside."""
    outside = False
    for w in range(len(wall)):
        outside |= (x - wall[w, 0]) * wall[w, 5] + (y - wall[w, 1]) * wall[w, 6] < 0.0
    if not outside:
        return 0.0
    inside, nearest = False, np.inf
    for w in range(len(wall)):
        ax, ay, tx, ty, length = wall[w, 0], wall[w, 1], wall[w, 2], wall[w, 3], wall[w, 4]
        if (ay > y) != (ay + ty * length > y) and x < ax + (y - ay) * tx / ty:
            inside = not inside
        along = min(max((x - ax) * tx + (y - ay) * ty, 0.0), length)
        nearest = min(nearest, math.hypot(x - ax - tx * along, y - ay - ty * along))
    return 0.0 if inside else nearest


@njit(cache=True)
def rectangle_outside(wall: Floats, reflex: Floats, x: float, y: float, c: float, s: float, half_d: float, half_w: float) -> float:
    """Return how far a rectangle sticks out of the room: its corners outside, or the room's inward vertices inside it."""
    worst = 0.0
    for k in range(4):
        u = half_d if k < 2 else -half_d
        v = half_w if k % 2 == 0 else -half_w
        worst = max(worst, outside_distance(wall, x + u * c - v * s, y + u * s + v * c))
    for k in range(len(reflex)):
        dx, dy = reflex[k, 0] - x, reflex[k, 1] - y
        worst = max(worst, min(half_d - abs(dx * c + dy * s), half_w - abs(dy * c - dx * s)))
    return worst
