"""Unit rows that stand away from walls: where an island fits before another row, and whether a peninsula leaves its aisles free.

What stays free follows the kitchen planning guidelines of the National Kitchen and Bath Association: an aisle between units, and a walkway
behind what stands in the room and at its ends.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.run_slots import Line, Slot, slot_at
from grammar.geometry.wall_spans import is_clear
from grammar.geometry.walls import NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW

_STEP_M = 0.05
_AISLES_M = (0.0, 0.15, 0.3)
_CORNER_REST_M = 0.15
"""How far beyond the unit that turns the aisle before a peninsula begins: what stands beside that unit may be a little deeper than it."""


class Standing(NamedTuple):
    """A unit that stands at a wall: the wall's number, metres from its start, and how far it reaches into the room."""

    wall: int
    low_m: float
    high_m: float
    reach_m: float


def rectangle(line: Line, along: tuple[float, float], across: tuple[float, float]) -> Boxes:
    """Return the (8,) box over the floor between two distances along a line and two before it."""
    x, y = line.point(0.5 * sum(along), 0.5 * sum(across))
    half = 0.5 * abs(across[1] - across[0]), 0.5 * abs(along[1] - along[0])
    return np.array([x, y, 0.0, 1.0, *half, math.cos(line.yaw_rad), math.sin(line.yaw_rad)])


def juts_clear(wall: Floats, obstacles: Boxes, slot: Slot, leg: int, size: tuple[float, float], aisle_m: float, around_m: float) -> bool:
    """Return whether a leg that juts out leaves an aisle before it, and a walkway behind it and beyond its end.

    Args:
        wall: rows of the room's walls.
        obstacles: (n, 8) world boxes of what keeps its floor, among it the unit row's units at walls.
        slot: of the row.
        leg: number of the leg.
        size: its depth, with the gap between it and its line, and its length.
        aisle_m: before it.
        around_m: behind it and beyond its end.
    """
    line, depth, end = slot.line(leg), size[0], slot.direction * size[1]
    stands = rectangle(line, (slot.direction * 0.01, end + slot.direction * around_m), (-around_m, depth))
    before = rectangle(line, (slot.direction * _CORNER_REST_M, end), (depth, depth + aisle_m))
    return is_clear(wall, obstacles, stands) and is_clear(wall, obstacles, before)


def free_slots(
    wall: Floats, obstacles: Boxes, standing: Sequence[Standing], size: tuple[float, float], aisle_m: float, around_m: float
) -> list[Slot]:
    """Return the places of a unit row that faces the units at a wall.

    Args:
        wall: rows of the room's walls.
        obstacles: (n, 8) world boxes of what keeps its floor.
        standing: the units at walls.
        size: depth, with the gap between the units and their line, and length of the row.
        aisle_m: to the fronts of the units that it faces, or up to 0.3 m more.
        around_m: kept free behind it and at its ends; its middle is before the units that it faces.
    """
    found: list[Slot] = []
    for w in dict.fromkeys(unit.wall for unit in standing):
        units = [unit for unit in standing if unit.wall == w]
        low, high, reach = min(u.low_m for u in units), max(u.high_m for u in units), max(u.reach_m for u in units)
        for more in _AISLES_M:
            line = _facing(wall[w], reach + aisle_m + more + size[0])
            for first, last in _stretches(wall, obstacles, line, (low, high), size, around_m):
                # the line runs against the wall, so metres along the wall count down
                found.append(slot_at(1.0, [Line(*line.point(-last - size[1], 0.0), line.yaw_rad)], last - first))
                found.append(slot_at(-1.0, [Line(*line.point(-first, 0.0), line.yaw_rad)], last - first))
    return found


def _facing(row: Floats, off_m: float) -> Line:
    """Return the line that looks at a wall's start from so far off."""
    x, y = row[START_X] + row[NORMAL_X] * off_m, row[START_Y] + row[NORMAL_Y] * off_m
    return Line(float(x), float(y), math.remainder(float(row[WALL_YAW]) + math.pi, 2.0 * math.pi))


def _stretches(
    wall: Floats, obstacles: Boxes, line: Line, before: tuple[float, float], size: tuple[float, float], around_m: float
) -> Iterator[tuple[float, float]]:
    """Yield the stretches in which the unit row's lower end may lie, in metres along the wall that it faces."""
    first: float | None = None
    last = 0.0
    starts = np.arange(before[0] - 0.5 * size[1], before[1] - 0.5 * size[1] + _STEP_M, _STEP_M)
    for at in (float(start) for start in starts):
        box = rectangle(line, (-at - size[1] - around_m, -at + around_m), (-around_m, size[0]))
        if is_clear(wall, obstacles, box):
            first, last = at if first is None else first, at
        elif first is not None:
            yield first, last
            first = None
    if first is not None:
        yield first, last
