"""Floor outlines: rectangles, L-, T- and U-shapes drawn by the grammar's odds, and outlines that a user gives.

A shape is a rectangle that lost one corner (L), both corners of one side (T) or the middle of one side (U).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grammar.derivation.densities import draw_index
from grammar.derivation.openings import Attribute
from grammar.spec.request import RequestError
from grammar.spec.rules import RoomShapes
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

_LEAST_WALL_M = 0.1
_LEAST_AREA_M2 = 2.0
_LARGEST_SIDE_M = 60.0
_SHAPES = ("rectangle", "l_shape", "t_shape", "u_shape")


def draw_outline(
    rng: np.random.Generator, shapes: RoomShapes, width_m: float, depth_m: float
) -> tuple[tuple[Point2, ...], Attribute] | None:
    """Return a counter-clockwise outline that fills a rectangle about the origin, and how it was drawn; None: it came out too narrow.

    Args:
        rng: source of randomness; a grammar that knows rectangles only takes nothing from it.
        shapes: odds and proportions.
        width_m: size along x.
        depth_m: size along y.
    """
    odds = [getattr(shapes, name) for name in _SHAPES]
    chosen = 0 if odds[0] == 1.0 else draw_index(rng, odds)
    log, name = math.log(odds[chosen]), _SHAPES[chosen]
    if name == "rectangle":
        x, y = 0.5 * width_m, 0.5 * depth_m
        return ((-x, -y), (x, -y), (x, y), (-x, y)), Attribute("shape", name, log)
    turns = int(rng.integers(4))
    along, across = (width_m, depth_m) if turns % 2 == 0 else (depth_m, width_m)
    span = shapes.notch_high - shapes.notch_low
    first, second, deep = (shapes.notch_low + span * rng.random() for _ in range(3))
    points, narrowest = _notched(name, along, across, first, second, deep)
    if narrowest < shapes.narrowest_m:
        return None
    for _ in range(turns):
        points = [(-y, x) for x, y in points]
    log -= math.log(4.0) + (3 if name == "t_shape" else 2) * math.log(span)
    text = f"{name}, notch {first:.3f}, depth {deep:.3f}, {turns} quarter turns"
    return tuple(points), Attribute("shape", text, log)


def _notched(name: str, along: float, across: float, first: float, second: float, deep: float) -> tuple[list[Point2], float]:
    """Return an outline with its notch at the side y > 0, and the width of its narrowest arm."""
    x, y = 0.5 * along, 0.5 * across
    low = y - deep * across
    if name == "l_shape":
        cut = x - first * along
        return [(-x, -y), (x, -y), (x, low), (cut, low), (cut, y), (-x, y)], min(cut + x, low + y)
    if name == "t_shape":
        # the two cuts share what the one cut of the other shapes takes, so that the arm between them stays as wide
        left, right = -x + 0.5 * first * along, x - 0.5 * second * along
        outline = [(-x, -y), (x, -y), (x, low), (right, low), (right, y), (left, y), (left, low), (-x, low)]
        return outline, min(right - left, low + y)
    half = 0.5 * first * along
    outline = [(-x, -y), (x, -y), (x, y), (half, y), (half, low), (-half, low), (-half, y), (-x, y)]
    return outline, min(x - half, low + y)


def check_outline(numbers: Sequence[float]) -> tuple[Point2, ...]:
    """Return a user's outline ``x0, y0, x1, y1, ...`` counter-clockwise.

    Raises:
        RequestError: it is no simple polygon of a size that a room can have.
    """
    name = "room_polygon_m"
    if len(numbers) % 2 or len(numbers) < 6:
        raise RequestError(f"{name}: expected x and y of at least 3 vertices, got {len(numbers)} numbers")
    points = [(float(x), float(y)) for x, y in zip(numbers[::2], numbers[1::2], strict=True)]
    if not all(math.isfinite(value) for value in numbers):
        raise RequestError(f"{name}: expected finite numbers, got {next(value for value in numbers if not math.isfinite(value))}")
    sides = [max(point[axis] for point in points) - min(point[axis] for point in points) for axis in (0, 1)]
    if max(sides) > _LARGEST_SIDE_M:
        raise RequestError(f"{name}: expected sides of at most {_LARGEST_SIDE_M:g} m, got {max(sides):g} m; are the numbers metres?")
    shortest = min(math.dist(a, b) for a, b in _walls(points))
    if shortest < _LEAST_WALL_M:
        raise RequestError(f"{name}: expected walls of at least {_LEAST_WALL_M:g} m, got one of {shortest:g} m; leave out a vertex")
    crossing = _crossing(points)
    if crossing is not None:
        raise RequestError(f"{name}: expected an outline that does not meet itself, got walls {crossing[0]} and {crossing[1]} that do")
    area = signed_area_m2(points)
    if abs(area) < _LEAST_AREA_M2:
        raise RequestError(f"{name}: expected a floor of at least {_LEAST_AREA_M2:g} m2, got {abs(area):.3g} m2; ask for a larger one")
    return tuple(points if area > 0.0 else points[::-1])


def _walls(points: Sequence[Point2]) -> list[tuple[Point2, Point2]]:
    return [(point, points[(i + 1) % len(points)]) for i, point in enumerate(points)]


def _crossing(points: Sequence[Point2]) -> tuple[int, int] | None:
    """Return two walls that meet elsewhere than where one ends and the other begins, or None."""
    walls = _walls(points)
    for i, (a, b) in enumerate(walls):
        for j in range(i + 1, len(walls)):
            c, d = walls[j]
            if j == i + 1 or (i == 0 and j == len(walls) - 1):
                shared, before, after = (b, a, d) if j == i + 1 else (a, b, c)
                u, v = (before[0] - shared[0], before[1] - shared[1]), (after[0] - shared[0], after[1] - shared[1])
                folds = abs(u[0] * v[1] - u[1] * v[0]) < 1e-9 and u[0] * v[0] + u[1] * v[1] > 0.0
                if folds:
                    return i, j
            elif _meet(a, b, c, d):
                return i, j
    return None


def _side(a: Point2, b: Point2, point: Point2) -> float:
    return (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])


def _meet(a: Point2, b: Point2, c: Point2, d: Point2) -> bool:
    """Return whether two segments share a point."""
    sides = _side(a, b, c), _side(a, b, d), _side(c, d, a), _side(c, d, b)
    if sides[0] * sides[1] < 0.0 and sides[2] * sides[3] < 0.0:
        return True
    ends = ((a, b, c, sides[0]), (a, b, d, sides[1]), (c, d, a, sides[2]), (c, d, b, sides[3]))
    return any(side == 0.0 and all(min(p[k], q[k]) <= r[k] <= max(p[k], q[k]) for k in (0, 1)) for p, q, r, side in ends)
