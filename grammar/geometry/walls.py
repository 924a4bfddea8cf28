"""The walls of a room as arrays, and how far things stick out through them."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

import kernel_cache.elementary as el
from grammar.geometry.arrays import Floats
from grammar.geometry.kernels import entry, making_arrays
from scene_description.types import Point2

START_X, START_Y, ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, WALL_YAW, REFLEX = range(9)
"""Columns of :func:`wall_rows`."""

_STRAIGHT = 1e-9
_GRAZE_M = 1e-4


def wall_lengths(polygon_m: Sequence[Point2]) -> list[float]:
    """Return the length in metres of every wall, wall i from vertex i to i + 1."""
    return [math.dist(point, polygon_m[(i + 1) % len(polygon_m)]) for i, point in enumerate(polygon_m)]


def wall_rows(polygon_m: ArrayLike) -> Floats:
    """Return the walls of a counter-clockwise floor outline.

    Returns:
        wall: (w, 9) start x, y, unit direction x, y, length, unit normal into the room x, y, yaw of that normal, 1 where the start is a
        vertex that sticks into the room; world, metres, radians.
    """
    return _rows_of(polygon_m).copy() if isinstance(polygon_m, tuple) else _rows(polygon_m)


def _rows(polygon_m: ArrayLike) -> Floats:
    start = np.array(polygon_m, np.float64)
    step = np.roll(start, -1, 0) - start
    length = np.hypot(step[:, 0], step[:, 1])
    tangent = step / length[:, None]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    before = np.roll(tangent, 1, 0)
    reflex = before[:, 0] * tangent[:, 1] - before[:, 1] * tangent[:, 0] < -_STRAIGHT
    return np.column_stack([start, tangent, length, normal, el.arctan2(normal[:, 1], normal[:, 0]), reflex])


@lru_cache(maxsize=64)
def _rows_of(polygon_m: tuple[Point2, ...]) -> Floats:
    """Return the rows of an outline that is asked for again and again while a room is tried."""
    return _rows(polygon_m)


@entry
def outside_distance(wall: Floats, x: float, y: float) -> float:
    """Return how far a point lies outside the room whose walls are rows of :func:`wall_rows`, in metres; 0 inside."""
    outside = False
    for w in range(len(wall)):
        outside |= (x - wall[w, START_X]) * wall[w, NORMAL_X] + (y - wall[w, START_Y]) * wall[w, NORMAL_Y] < 0.0
    if not outside:
        return 0.0
    inside, nearest = False, np.inf
    for w in range(len(wall)):
        ax, ay, tx, ty, length = wall[w, START_X], wall[w, START_Y], wall[w, ALONG_X], wall[w, ALONG_Y], wall[w, LENGTH]
        if (ay > y) != (ay + ty * length > y) and x < ax + (y - ay) * tx / ty:
            inside = not inside
        along = min(max((x - ax) * tx + (y - ay) * ty, 0.0), length)
        nearest = min(nearest, math.hypot(x - ax - tx * along, y - ay - ty * along))
    return 0.0 if inside else nearest


@making_arrays
def outside_distances(wall, points):  # type: ignore[no-untyped-def]
    """Return (n,) :func:`outside_distance` of points (n, 2)."""
    distance = np.empty(len(points))
    for k in range(len(points)):
        distance[k] = outside_distance(wall, points[k, 0], points[k, 1])
    return distance


@entry
def _crossing_length(frame, half, start, end):  # type: ignore[no-untyped-def]
    """Return the length within a rectangle of a segment that ends outside of it at both ends, else 0.

    ``frame``: x, y of the rectangle's middle, cosine and sine of its yaw; ``half``: half depth and width.
    """
    (x, y, c, s), (half_d, half_w), (ax, ay), (bx, by) = frame, half, start, end
    au, av = (ax - x) * c + (ay - y) * s, (ay - y) * c - (ax - x) * s
    bu, bv = (bx - x) * c + (by - y) * s, (by - y) * c - (bx - x) * s
    if (abs(au) < half_d and abs(av) < half_w) or (abs(bu) < half_d and abs(bv) < half_w):
        return 0.0
    low, high = 0.0, 1.0
    for axis in range(2):
        begin, finish, reach = (au, bu, half_d) if axis == 0 else (av, bv, half_w)
        step = finish - begin
        if abs(step) < 1e-12:
            if abs(begin) >= reach:
                return 0.0
        else:
            first, second = (-reach - begin) / step, (reach - begin) / step
            low, high = max(low, min(first, second)), min(high, max(first, second))
    return max(high - low, 0.0) * math.sqrt((bu - au) ** 2 + (bv - av) ** 2)


@entry
def rectangle_outside(wall: Floats, x: float, y: float, c: float, s: float, half_d: float, half_w: float) -> float:
    """Return how far a rectangle sticks out of the room: its corners outside, inward vertices inside it, walls that run through it."""
    worst, bent = 0.0, False
    for k in range(4):
        u = half_d if k < 2 else -half_d
        v = half_w if k % 2 == 0 else -half_w
        worst = max(worst, outside_distance(wall, x + u * c - v * s, y + u * s + v * c))
    for w in range(len(wall)):
        if wall[w, REFLEX] > 0.0:
            bent = True
            dx, dy = wall[w, START_X] - x, wall[w, START_Y] - y
            worst = max(worst, min(half_d - abs(dx * c + dy * s), half_w - abs(dy * c - dx * s)))
    if bent:
        inner_d, inner_w = half_d - _GRAZE_M, half_w - _GRAZE_M
        for w in range(len(wall)):
            ax, ay, length = wall[w, START_X], wall[w, START_Y], wall[w, LENGTH]
            bx, by = ax + wall[w, ALONG_X] * length, ay + wall[w, ALONG_Y] * length
            worst = max(worst, _crossing_length((x, y, c, s), (inner_d, inner_w), (ax, ay), (bx, by)))
    return worst
