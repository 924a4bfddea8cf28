"""Fields of layout files: numbers within bounds and outlines; what does not fit raises with its reason."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

_ROOM_HIGH_M = 100.0


class UnfitError(Exception):
    """A line, an object or an opening that cannot be used; the text is the reason."""


def quoted(name: str) -> str:
    """Return the beginning of a name as messages and the comments of files may show it: characters of one line, which every file holds."""
    return "'" + "".join(letter if letter.isprintable() else "?" for letter in name[:60]) + "'"


def read_number(value: Any, reason: str, low: float, high: float) -> float:
    """Return a finite number within bounds.

    Raises:
        UnfitError: with ``reason``.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise UnfitError(reason)
    return float(value)


def read_numbers(value: Any, reason: str, low: float, high: float) -> tuple[float, float, float]:
    """Return a list of three numbers within bounds.

    Raises:
        UnfitError: with ``reason``.
    """
    if not isinstance(value, list) or len(value) != 3:
        raise UnfitError(reason)
    return read_number(value[0], reason, low, high), read_number(value[1], reason, low, high), read_number(value[2], reason, low, high)


def read_polygon(value: Any) -> tuple[Point2, ...]:
    """Return an outline counter-clockwise, without vertices that repeat or lie on a straight wall.

    Raises:
        UnfitError: it is no outline of a room.
    """
    reason = "room: no usable polygon"
    if not isinstance(value, list) or not 3 <= len(value) <= 1000:
        raise UnfitError(reason)
    points: list[Point2] = []
    for pair in value:
        if not isinstance(pair, list) or len(pair) != 2:
            raise UnfitError(reason)
        points.append((read_number(pair[0], reason, -1e5, 1e5), read_number(pair[1], reason, -1e5, 1e5)))
    corners = _turning_points(points)
    area = signed_area_m2(corners) if len(corners) >= 3 else 0.0
    if abs(area) < 0.5 or max(abs(p[0] - corners[0][0]) + abs(p[1] - corners[0][1]) for p in corners) > _ROOM_HIGH_M:
        raise UnfitError(reason)
    return tuple(corners if area > 0.0 else reversed(corners))


def _turning_points(points: Sequence[Point2]) -> list[Point2]:
    """Return the vertices where an outline turns; without one of the others its neighbours may be needless too."""
    corners, index, steady = list(points), 0, 0
    while len(corners) > 2 and steady < len(corners):
        index %= len(corners)
        before, here, after = corners[index - 1], corners[index], corners[(index + 1) % len(corners)]
        if math.dist(before, here) > 1e-6 and abs(_cross(before, here, after)) > 1e-9:
            index, steady = index + 1, steady + 1
        else:
            del corners[index]
            index, steady = max(index - 1, 0), 0
    return corners


def _cross(a: Point2, b: Point2, c: Point2) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
