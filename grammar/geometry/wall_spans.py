"""Free floor: stretches of walls along which a row of furniture of some depth can stand, and clear rectangles of the floor."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from numpy.typing import ArrayLike

from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, X, Y, footprint_corners, footprint_penetration
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, REFLEX, START_X, START_Y, wall_rows

_TOUCH_M = 1e-6

Point = tuple[float, float]


class Span(NamedTuple):
    """A stretch of a wall from ``low`` to ``high`` metres after the wall's start; ``closed``: whether another wall ends it there."""

    low: float
    high: float
    closed_low: bool
    closed_high: bool


def free_spans(polygon_m: ArrayLike, obstacles: Boxes, depth_m: float) -> list[list[Span]]:
    """Return for each wall of an outline (w, 2) the stretches along which no obstacle (n, 8) comes nearer than ``depth_m`` to it."""
    rows = wall_rows(polygon_m)
    corners = outlines(obstacles)
    return [spans_of(rows, w, corners, depth_m) for w in range(len(rows))]


def outlines(boxes: Boxes) -> list[list[Point]]:
    """Return the corners of the footprints of (n, 8) world boxes."""
    return [[(x, y) for x, y in corners] for corners in footprint_corners(boxes).tolist()]


def spans_of(rows: Floats, w: int, obstacles: Sequence[Sequence[Point]], depth_m: float) -> list[Span]:
    """Return the free stretches of wall ``w``; arguments as for :func:`free_spans`, obstacles by their :func:`outlines`."""
    row, length = rows[w].tolist(), float(rows[w, LENGTH])
    blocked: list[tuple[float, float, bool]] = []
    for v in range(len(rows)):
        if v != w:
            end = rows[(v + 1) % len(rows)]
            ends = (float(rows[v, START_X]), float(rows[v, START_Y])), (float(end[START_X]), float(end[START_Y]))
            blocked.extend((*found, True) for found in _in_strip(_at_wall(row, ends), depth_m))
    for corners in obstacles:
        blocked.extend((*found, False) for found in _in_strip(_at_wall(row, corners), depth_m))
    # walk along the wall from one blocked stretch to the next
    spans, at, closed = [], 0.0, not rows[w, REFLEX]
    for low, high, by_wall in sorted(blocked):
        if min(low, length) > at + _TOUCH_M:
            spans.append(Span(at, min(low, length), closed, by_wall))
        if high > at + _TOUCH_M:
            at, closed = high, by_wall
    if at < length - _TOUCH_M:
        spans.append(Span(at, length, closed, not rows[(w + 1) % len(rows), REFLEX]))
    return spans


def _at_wall(row: Sequence[float], points: Iterable[Point]) -> list[Point]:
    """Return points as metres along a wall and into the room."""
    offsets = [(x - row[START_X], y - row[START_Y]) for x, y in points]
    return [(dx * row[ALONG_X] + dy * row[ALONG_Y], dx * row[NORMAL_X] + dy * row[NORMAL_Y]) for dx, dy in offsets]


def _in_strip(points: Sequence[Point], depth_m: float) -> list[tuple[float, float]]:
    """Return the stretch that a convex outline, or a segment, takes of the open strip before a wall; nothing if it lies outside."""
    low, high, along = _TOUCH_M, depth_m - _TOUCH_M, []
    for (s, t), (u, v) in zip(points, [*points[1:], points[0]], strict=True):
        if low < t < high:
            along.append(s)
        along.extend(s + (u - s) * (edge - t) / (v - t) for edge in (low, high) if min(t, v) < edge < max(t, v))
    return [(min(along), max(along))] if along else []


_COVERED_M = 1e-4


def is_clear(wall: Floats, obstacles: Boxes, box: Boxes) -> bool:
    """Return whether the rectangle of a box (8,) lies on the floor within walls (w, 9), clear of obstacles (n, 8); touches do not count."""
    if any(footprint_penetration(box, other) > _COVERED_M for other in obstacles):
        return False
    return _on_floor(wall, float(box[X]), float(box[Y])) and not any(_crosses(row, box) for row in wall)


def _on_floor(wall: Floats, x: float, y: float) -> bool:
    """Return whether a point lies inside the outline: a ray towards +x crosses an odd number of walls."""
    inside = False
    for row in wall:
        low, rise = float(row[START_Y]), float(row[ALONG_Y] * row[LENGTH])
        if (low > y) != (low + rise > y):
            inside ^= row[START_X] + row[ALONG_X] * row[LENGTH] * (y - low) / rise > x
    return bool(inside)


def _crosses(row: Floats, box: Boxes) -> bool:
    """Return whether a wall comes into a rectangle by more than a touch; the wall is clipped by the rectangle's sides one by one."""
    c, s = box[COS_YAW], box[SIN_YAW]
    dx, dy = row[START_X] - box[X], row[START_Y] - box[Y]
    start = dx * c + dy * s, dy * c - dx * s
    step = row[ALONG_X] * c + row[ALONG_Y] * s, row[ALONG_Y] * c - row[ALONG_X] * s
    first, last = 0.0, float(row[LENGTH])
    for at, rate, half in zip(start, step, (box[HALF_DEPTH] - _COVERED_M, box[HALF_WIDTH] - _COVERED_M), strict=True):
        if abs(rate) < 1e-12:
            if abs(at) >= half:
                return False
            continue
        ends = sorted(((-half - at) / rate, (half - at) / rate))
        first, last = max(first, ends[0]), min(last, ends[1])
    return first < last
