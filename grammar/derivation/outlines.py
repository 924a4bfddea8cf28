"""Floor outlines: rectangles, L-, T- and U-shapes drawn by the grammar's probabilities, and outlines that a user gives.

A shape is a rectangle that lost one corner (L), both corners of one side (T) or the middle of one side (U).  A chimney breast is a small
U, whose size is drawn in metres; an alcove is the middle arm of a T with such a size.  A bay is an alcove for windows; in a canted one
the walls beside the front one stand at 45 degrees.  Notches are drawn within what leaves the arms of the floor wide enough.
"""

import math
from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from shapely import LineString, Point

from grammar.derivation.densities import draw_index, draw_truncated_normal, truncated_normal_log_density
from grammar.derivation.parse_tree import Attribute
from grammar.geometry.walls import wall_lengths
from grammar.spec.request import RequestError
from grammar.spec.room_rules import ARMED, SHAPES, RoomShapes
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

_LEAST_WALL_M = 0.1
_LEAST_STEP_M = 0.15
_LEAST_AREA_M2 = 1.0
_LARGEST_SIDE_M = 60.0
_TOUCH_M = 1e-6


_JUTS = ("chimney_breast", "alcove", "bay")
_JUT_WALLS = (3, 4, 5)
"""Walls of a bay or a chimney breast in the outline of a room that has one: side, front, side."""
_LEAST_BETWEEN_M = 1.2
"""Least distance of the arms of a U, between which there is something else."""
_LEAST_BAY_FRONT_M = 0.6


class Outline(NamedTuple):
    """A drawn outline: vertices counter-clockwise, how it was drawn, the walls of its bay, and those of a chimney breast.

    The walls of a bay are its windows', the front one in the middle; ``closed`` ones have no openings.
    """

    points_m: tuple[Point2, ...]
    attribute: Attribute
    bay: tuple[int, ...] = ()
    closed: tuple[int, ...] = ()


def draw_outline(rng: np.random.Generator, shapes: RoomShapes, width_m: float, depth_m: float) -> Outline | None:
    """Return a counter-clockwise outline that fills a rectangle about the origin; None: its arms would be too narrow.

    A grammar that knows rectangles only takes nothing from ``rng``.
    """
    probabilities = [getattr(shapes, name) for name in SHAPES]
    chosen = 0 if probabilities[0] == 1.0 else draw_index(rng, probabilities)
    log, name = math.log(probabilities[chosen]), SHAPES[chosen]
    if name == "rectangle":
        x, y = 0.5 * width_m, 0.5 * depth_m
        return Outline(((-x, -y), (x, -y), (x, y), (-x, y)), Attribute("shape", name, log))
    # draw which side is notched, and the size of the notch
    turns = int(rng.integers(4))
    along, across = (width_m, depth_m) if turns % 2 == 0 else (depth_m, width_m)
    if name in _JUTS:
        return _with_jut(rng, shapes, name, turns, along, across, log)
    least = {"t_shape": 2.0 * _LEAST_STEP_M, "u_shape": _LEAST_BETWEEN_M}.get(name, _LEAST_STEP_M)
    low, span = _notch_range(shapes, along, 2.0 if name == "u_shape" else 1.0, least)
    low_deep, span_deep = _notch_range(shapes, across, 1.0, _LEAST_STEP_M)
    if min(span, span_deep) <= 0.0:
        return None
    if name == "l_shape" and shapes.notches:
        first, deep, log_notch = _seen_notch(rng, shapes, along >= across, (low, low + span), (low_deep, low_deep + span_deep))
        second, log = first, log + log_notch - math.log(4.0)
    else:
        first, second, deep = low + span * rng.random(), low + span * rng.random(), low_deep + span_deep * rng.random()
        log -= math.log(4.0) + (2 if name == "t_shape" else 1) * math.log(span) + math.log(span_deep)
    points = _turned(_notched(name, along, across, first, second, deep), turns)
    text = f"{name}, notch {first:.3f}, depth {deep:.3f}, {turns} quarter turns"
    return Outline(tuple(points), Attribute("shape", text, log))


def _seen_notch(
    rng: np.random.Generator, shapes: RoomShapes, long: bool, along: tuple[float, float], across: tuple[float, float]
) -> tuple[float, float, float]:
    """Return the shares of the sides along and across a notch that it takes, and the log-density of both.

    Args:
        rng: source of randomness.
        shapes: with notches.
        long: whether the side along the notch is the long one.
        along: bounds of its share.
        across: bounds of the other one.
    """
    seen = shapes.notches[int(rng.integers(len(shapes.notches)))]
    shares, log = [], -math.log(len(shapes.notches))
    for mean, (low, high) in zip(seen if long else seen[::-1], (along, across), strict=True):
        shares.append(draw_truncated_normal(rng, mean, shapes.notch_sd, low, high))
        log += truncated_normal_log_density(shares[-1], mean, shapes.notch_sd, low, high)
    return shares[0], shares[1], log


def draw_arms(rng: np.random.Generator, shapes: RoomShapes, width_m: float, depth_m: float, arm_m: float) -> Outline | None:
    """Return an L-, T- or U-shaped outline within a rectangle about the origin, all arms equally wide; None: none of them fits."""
    turns = int(rng.integers(4))
    along, across = (width_m, depth_m) if turns % 2 == 0 else (depth_m, width_m)
    # what the notches take of the side that they are in, and the least that they must
    taken = {"l_shape": along - arm_m, "t_shape": along - arm_m, "u_shape": along - 2.0 * arm_m}
    least = {"l_shape": _LEAST_STEP_M, "t_shape": 2.0 * _LEAST_STEP_M, "u_shape": _LEAST_BETWEEN_M}
    odds = [getattr(shapes, name) if taken[name] >= least[name] else 0.0 for name in ARMED]
    if sum(odds) <= 0.0 or across - arm_m < _LEAST_STEP_M:
        return None
    chosen = draw_index(rng, [share / sum(odds) for share in odds])
    name, log = ARMED[chosen], math.log(odds[chosen] / sum(odds)) - math.log(4.0)
    first = second = taken[name] / along
    if name == "t_shape":
        span = taken[name] - 2.0 * _LEAST_STEP_M
        left = _LEAST_STEP_M + span * rng.random()
        first, second = 2.0 * left / along, 2.0 * (taken[name] - left) / along
        log -= math.log(max(span, _TOUCH_M))
    points = _turned(_notched(name, along, across, first, second, 1.0 - arm_m / across), turns)
    return Outline(tuple(points), Attribute("shape", f"{name}, arms {arm_m:.3f} m, {turns} quarter turns", log))


def _notch_range(shapes: RoomShapes, side_m: float, arms: float, least_m: float) -> tuple[float, float]:
    """Return the least share that a notch takes of a side and the width of the range, which is not positive if none is possible.

    ``arms`` stay as wide as they must beside each other; the notch takes ``least_m`` at least.
    """
    low = max(shapes.notch_low, least_m / side_m)
    return low, min(shapes.notch_high, 1.0 - arms * shapes.narrowest_m / side_m) - low


def _turned(points: list[Point2], turns: int) -> list[Point2]:
    """Return an outline after so many quarter turns."""
    for _ in range(turns):
        points = [(-y, x) for x, y in points]
    return points


def _with_jut(
    rng: np.random.Generator, shapes: RoomShapes, name: str, turns: int, along: float, across: float, log: float
) -> Outline | None:
    """Return an outline with a chimney breast, an alcove or a bay at the side y > 0, turned; None: the rest is too narrow."""
    kind = name.removeprefix("chimney_")
    (low, high), (low_deep, high_deep) = getattr(shapes, f"{kind}_width_m"), getattr(shapes, f"{kind}_depth_m")
    width = low + (high - low) * rng.random()
    canted = name == "bay" and bool(rng.random() < shapes.bay_canted)
    if canted:
        high_deep = min(high_deep, 0.5 * (width - _LEAST_BAY_FRONT_M))
    deep = low_deep + (high_deep - low_deep) * rng.random()
    beside, rest = 0.5 * (along - width), across - deep
    if rest < shapes.narrowest_m or beside <= _LEAST_WALL_M or high_deep <= low_deep:
        return None
    log -= math.log(4.0) + math.log(high - low) + math.log(high_deep - low_deep)
    text = f"{name}, {width:.3f} x {deep:.3f} m, {turns} quarter turns"
    if name == "chimney_breast":
        points = _notched("u_shape", along, across, width / along, 0.0, deep / across)
    else:
        share = 2.0 * beside / along
        points = _notched("t_shape", along, across, share, share, deep / across)
    if name != "bay":
        closed = _JUT_WALLS if name == "chimney_breast" else ()
        return Outline(tuple(_turned(points, turns)), Attribute("shape", text, log), closed=closed)
    log += math.log(shapes.bay_canted if canted else 1.0 - shapes.bay_canted)
    if canted:
        (right, y), (left, _) = points[4:6]
        points[4:6] = (right - deep, y), (left + deep, y)
    return Outline(tuple(_turned(points, turns)), Attribute("shape", f"{text}{', canted' if canted else ''}", log), bay=_JUT_WALLS)


def _notched(name: str, along: float, across: float, first: float, second: float, deep: float) -> list[Point2]:
    """Return an outline with its notch at the side y > 0."""
    x, y = 0.5 * along, 0.5 * across
    low = y - deep * across
    if name == "l_shape":
        cut = x - first * along
        return [(-x, -y), (x, -y), (x, low), (cut, low), (cut, y), (-x, y)]
    if name == "t_shape":
        # the two cuts share what the one cut of the other shapes takes, so that the arm between them stays as wide
        left, right = -x + 0.5 * first * along, x - 0.5 * second * along
        return [(-x, -y), (x, -y), (x, low), (right, low), (right, y), (left, y), (left, low), (-x, low)]
    half = 0.5 * first * along
    return [(-x, -y), (x, -y), (x, y), (half, y), (half, low), (-half, low), (-half, y), (-x, y)]


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
    shortest = min(wall_lengths(points))
    if shortest < _LEAST_WALL_M:
        raise RequestError(f"{name}: expected walls of at least {_LEAST_WALL_M:g} m, got one of {shortest:g} m; leave out a vertex")
    crossing = _crossing(points)
    if crossing is not None:
        raise RequestError(f"{name}: expected an outline that does not meet itself, got walls {crossing[0]} and {crossing[1]} that do")
    area = signed_area_m2(points)
    if abs(area) < _LEAST_AREA_M2:
        raise RequestError(f"{name}: expected a floor of at least {_LEAST_AREA_M2:g} m2, got {abs(area):.3g} m2; ask for a larger one")
    return tuple(points if area > 0.0 else points[::-1])


def _crossing(points: Sequence[Point2]) -> tuple[int, int] | None:
    """Return two walls that meet elsewhere than where one ends and the other begins, or None; less than a micrometre apart they meet."""
    walls = [LineString(ends) for ends in pairwise((*points, points[0]))]
    for (i, first), (j, second) in combinations(enumerate(walls), 2):
        if j == i + 1:
            gap = min(second.distance(Point(points[i])), first.distance(Point(second.coords[1])))
        elif i == 0 and j == len(walls) - 1:
            gap = min(second.distance(Point(points[1])), first.distance(Point(points[j])))
        else:
            gap = first.distance(second)
        if gap < _TOUCH_M:
            return i, j
    return None
