"""Clear floor: rectangles on the floor that no wall and nothing that stands there reaches into."""

from __future__ import annotations

from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import footprint_penetration
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, START_X, START_Y

_TOUCH_M = 1e-4


def is_clear(wall: Floats, obstacles: Boxes, box: Boxes) -> bool:
    """Return whether a rectangle lies on the floor of the room and nothing stands there; what touches it is no obstacle.

    Args:
        wall: (w, 9) rows of :func:`grammar.geometry.walls.wall_rows`.
        obstacles: (n, 8) world boxes, whatever their heights.
        box: one (8,) world box.
    """
    if any(footprint_penetration(box, other) > _TOUCH_M for other in obstacles):
        return False
    return _on_floor(wall, float(box[0]), float(box[1])) and not any(_crosses(row, box) for row in wall)


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
    c, s = box[6], box[7]
    dx, dy = row[START_X] - box[0], row[START_Y] - box[1]
    start = dx * c + dy * s, dy * c - dx * s
    step = row[ALONG_X] * c + row[ALONG_Y] * s, row[ALONG_Y] * c - row[ALONG_X] * s
    first, last = 0.0, float(row[LENGTH])
    for at, rate, half in zip(start, step, (box[4] - _TOUCH_M, box[5] - _TOUCH_M), strict=True):
        if abs(rate) < 1e-12:
            if abs(at) >= half:
                return False
            continue
        ends = sorted(((-half - at) / rate, (half - at) / rate))
        first, last = max(first, ends[0]), min(last, ends[1])
    return first < last
