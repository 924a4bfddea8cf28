"""Whether a robot gets about, as losses of the layout chain: the raster that the exact check uses, kept up to date object by object.

circulation: how far the share of the standable floor that is connected to the door falls below the wanted share (R_walkable of PhyScene,
Yang et al., CVPR 2024); reach: number of seats, beds and stores that the walker cannot get to.  Cells are those of
:func:`grammar.free_space.rasterize`; each counts the solids that come nearer to its centre than the robot's radius, so moving an object
costs its own cells and one flood fill.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grammar.energies import INNER
from grammar.free_space import rasterize, standable
from grammar.layout import ACTIVE, BLOCKS, BOX, BOX_END, REACH, ZONE, Floats, Ints, Problem, State
from grammar.rules import Thresholds
from scene_description.types import Point2

ORIGIN_X, ORIGIN_Y, RESOLUTION, RADIUS, START_X, START_Y, SHARE = range(7)
"""Places in ``Floor.number``."""

_EPOCH, _FREE = range(2)
_TOUCH_M = 1e-9


class Floor(NamedTuple):
    """The raster of a room; row = y, column = x, (h, w).

    covered: solids and walls too near to each cell; reached: the epoch in which a cell was last reached; stack: (2 h w,) work space;
    tally: (2,) epoch and number of standable cells; number: (7,) the places above.
    """

    covered: NDArray[np.int32]
    reached: NDArray[np.int32]
    stack: NDArray[np.int32]
    tally: Ints
    number: Floats


def empty_floor(polygon_m: tuple[Point2, ...], start_m: tuple[float, float], limits: Thresholds) -> Floor:
    """Return the raster of an unfurnished room.

    Args:
        polygon_m: floor outline, counter-clockwise, world.
        start_m: where the robot enters.
        limits: its radius, the resolution and the share of the floor that it shall reach.
    """
    free = rasterize(polygon_m, np.zeros((0, 8)), limits.grid_resolution_m, limits.robot_height_m)
    stands = standable(free, limits.robot_radius_m)
    number = (*free.origin_m, free.resolution_m, limits.robot_radius_m, *start_m, limits.walkable_share)
    return Floor(
        covered=(~stands).astype(np.int32),
        reached=np.zeros(stands.shape, np.int32),
        stack=np.zeros(2 * stands.size, np.int32),
        tally=np.array([0, np.count_nonzero(stands)], np.int64),
        number=np.array(number),
    )


def circulation_losses(problem: Problem, state: State, floor: Floor) -> tuple[float, float]:
    """Return the losses circulation and reach of a layout; ``floor`` is an unfurnished room's and is left as it was."""
    circulation, missed = _measure_furnished(problem, state, floor)
    return circulation, float(missed)


@njit(**INNER)
def _window(box, margin, floor):  # type: ignore[no-untyped-def]
    """Return the first and last rows and columns (past the end) whose centres may lie within ``margin`` of a box's footprint."""
    number, c, s = floor.number, abs(box[6]), abs(box[7])
    reach_x, reach_y = box[4] * c + box[5] * s + margin, box[4] * s + box[5] * c + margin
    x, y, side = box[0] - number[ORIGIN_X], box[1] - number[ORIGIN_Y], number[RESOLUTION]
    row, row_end = max(int((y - reach_y) / side), 0), min(int((y + reach_y) / side) + 1, floor.covered.shape[0])
    return row, row_end, max(int((x - reach_x) / side), 0), min(int((x + reach_x) / side) + 1, floor.covered.shape[1])


@njit(**INNER)
def stamp(problem, placed, i, sign, floor):  # type: ignore[no-untyped-def]
    """Add (sign 1) or take away (-1) the solids of object ``i``, whose boxes are rows of ``placed``."""
    if problem.link[i, BLOCKS] == 0:
        return
    covered, number = floor.covered, floor.number
    side, near, freed = number[RESOLUTION], number[RADIUS] - _TOUCH_M, 0
    for k in range(problem.link[i, BOX], problem.link[i, ZONE]):
        box = placed[k]
        half_d, half_w, c, s = box[4], box[5], box[6], box[7]
        first_row, last_row, first_column, last_column = _window(box, near, floor)
        dx = number[ORIGIN_X] + (first_column + 0.5) * side - box[0]
        for row in range(first_row, last_row):
            dy = number[ORIGIN_Y] + (row + 0.5) * side - box[1]
            u, v = dx * c + dy * s, dy * c - dx * s
            for column in range(first_column, last_column):
                step = side * (column - first_column)
                away_u, away_v = max(abs(u + step * c) - half_d, 0.0), max(abs(v - step * s) - half_w, 0.0)
                if away_u * away_u + away_v * away_v < near * near:
                    before = covered[row, column]
                    covered[row, column] = before + sign
                    freed += int(before + sign == 0) - int(before == 0)
    floor.tally[_FREE] += freed


@njit(**INNER)
def furnish(problem, state, floor, sign):  # type: ignore[no-untyped-def]
    """Add (sign 1) or take away (-1) all active objects."""
    for i in range(len(problem.link)):
        if state.hold[i, ACTIVE]:
            stamp(problem, state.placed, i, sign, floor)


@njit(**INNER)
def _enter_cell(floor):  # type: ignore[no-untyped-def]
    """Return row and column of the standable cell that the walk begins at, row -1 without one."""
    number, covered = floor.number, floor.covered
    side = number[RESOLUTION]
    within = number[RADIUS] + math.sqrt(2.0) * side
    span = int(within / side) + 2
    middle_row = int((number[START_Y] - number[ORIGIN_Y]) / side)
    middle_column = int((number[START_X] - number[ORIGIN_X]) / side)
    best, best_row, best_column = within * within, -1, -1
    for row in range(max(middle_row - span, 0), min(middle_row + span + 1, covered.shape[0])):
        dy = number[ORIGIN_Y] + (row + 0.5) * side - number[START_Y]
        for column in range(max(middle_column - span, 0), min(middle_column + span + 1, covered.shape[1])):
            dx = number[ORIGIN_X] + (column + 0.5) * side - number[START_X]
            squared = dx * dx + dy * dy
            if covered[row, column] == 0 and squared < best:
                best, best_row, best_column = squared, row, column
    return best_row, best_column


@njit(**INNER)
def _flood(floor, row, column):  # type: ignore[no-untyped-def]
    """Mark the cells connected to one with the epoch, run by run along the rows; return how many."""
    covered, reached, stack = floor.covered, floor.reached, floor.stack
    height, width = covered.shape
    epoch, top, done = floor.tally[_EPOCH], 1, 0
    stack[0] = row * width + column
    while top > 0:
        top -= 1
        row, left = stack[top] // width, stack[top] % width
        if reached[row, left] == epoch:
            continue
        right = left
        while left > 0 and covered[row, left - 1] == 0:
            left -= 1
        while right < width and covered[row, right] == 0:
            right += 1
        for column in range(left, right):
            reached[row, column] = epoch
        done += right - left
        for beside in (row - 1, row + 1):
            if 0 <= beside < height:
                inside = False
                for column in range(left, right):
                    is_open = covered[beside, column] == 0
                    if is_open and not inside and reached[beside, column] != epoch:
                        stack[top] = beside * width + column
                        top += 1
                    inside = is_open
    return done


@njit(**INNER)
def _touches(box, floor):  # type: ignore[no-untyped-def]
    """Return whether the centre of a reached cell lies in a strip."""
    number, reached, epoch = floor.number, floor.reached, floor.tally[_EPOCH]
    side = number[RESOLUTION]
    first_row, last_row, first_column, last_column = _window(box, 0.0, floor)
    for row in range(first_row, last_row):
        dy = number[ORIGIN_Y] + (row + 0.5) * side - box[1]
        for column in range(first_column, last_column):
            if reached[row, column] == epoch:
                dx = number[ORIGIN_X] + (column + 0.5) * side - box[0]
                if abs(dx * box[6] + dy * box[7]) <= box[4] and abs(dy * box[6] - dx * box[7]) <= box[5]:
                    return True
    return False


@njit(**INNER)
def measure(problem, state, floor):  # type: ignore[no-untyped-def]
    """Return the losses circulation and reach of what stands on the raster."""
    floor.tally[_EPOCH] += 1
    row, column = _enter_cell(floor)
    done = _flood(floor, row, column) if row >= 0 else 0
    share = done / floor.tally[_FREE] if floor.tally[_FREE] > 0 else 0.0
    missed = 0
    for i in range(len(problem.link)):
        first, last = problem.link[i, REACH], problem.link[i, BOX_END]
        if last > first and state.hold[i, ACTIVE]:
            met = False
            for k in range(first, last):
                met = met or _touches(state.placed[k], floor)
            missed += 0 if met else 1
    return max(floor.number[SHARE] - share, 0.0), missed


@njit(cache=True, error_model="numpy")
def _measure_furnished(problem, state, floor):  # type: ignore[no-untyped-def]
    furnish(problem, state, floor, np.int64(1))
    losses = measure(problem, state, floor)
    furnish(problem, state, floor, np.int64(-1))
    return losses
