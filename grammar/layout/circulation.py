"""Whether a robot gets about, as losses of the layout chain: the raster that the exact check uses, kept up to date object by object.

circulation: how far the share of the standable floor that is connected to the door falls below the wanted share (R_walkable of PhyScene,
Yang et al., CVPR 2024); reach: number of seats, beds and stores that the robot cannot get to.  Cells are those of
:func:`grammar.geometry.free_space.rasterize`; :mod:`grammar.layout.floor_raster` keeps them.
"""

import math
from typing import NamedTuple

import numpy as np

from grammar.geometry import boxes
from grammar.geometry.arrays import Boxes, Ints
from grammar.geometry.boxes import NO_BOXES
from grammar.geometry.free_space import rasterize, standable
from grammar.geometry.kernels import entry, kernel
from grammar.layout import columns as col
from grammar.layout.floor_raster import (
    DONE,
    FREE,
    REACHED_CELL,
    ROWS,
    SIDE,
    STRIDE,
    TALLIES,
    Floor,
    move_box,
    settle,
    start_over,
    update,
)
from grammar.layout.losses import loss
from grammar.layout.problem import Problem, State
from grammar.spec.rules import Thresholds
from scene_description.types import Point2

_TOUCH_M = 1e-9
_MOST_CHANGES = 256


class Traffic(NamedTuple):
    """What a problem means to a robot.

    solid: (m,) 1 for the boxes that take floor, of those that lie within each other only the outer one; witness: (n,) for each object a
    cell by which the robot last got to it, -1 without one.
    """

    solid: Ints
    witness: Ints


def traffic_of(problem: Problem, floor: Floor) -> Traffic:
    """Return the boxes of a problem that a robot of the floor's height meets, none without a floor, and no cells yet."""
    link, box = problem.link, problem.box
    if not len(floor.covered):
        return Traffic(np.zeros(len(box), np.int64), np.full(len(link), -1, np.int64))
    owner = np.repeat(np.arange(len(link)), link[:, col.BOX_END] - link[:, col.SOLIDS])
    is_solid = np.arange(len(box)) < link[owner, col.ZONES]
    underside = problem.object[owner, col.BOTTOM] + box[:, boxes.Z_LOW]
    solid = is_solid & (link[owner, col.BLOCKS] > 0) & (underside < floor.height_m)
    within = (owner[:, None] == owner) & solid[:, None] & solid
    for middle, half in ((boxes.X, boxes.HALF_DEPTH), (boxes.Y, boxes.HALF_WIDTH)):
        within &= np.abs(box[:, None, middle] - box[:, middle]) + box[:, None, half] <= box[:, half]
    twins = within & within.T  # of boxes that are alike the first one stays
    inner = (within & ~twins).any(1) | np.tril(twins, -1).any(1)
    return Traffic((solid & ~inner).astype(np.int64), np.full(len(link), -1, np.int64))


def empty_floor(polygon_m: tuple[Point2, ...], start_m: tuple[float, float], limits: Thresholds, low: Boxes = NO_BOXES) -> Floor:
    """Return the raster of an unfurnished room, counter-clockwise outline, that the robot enters at ``start_m``.

    ``low``: (k, 8) boxes over the floor where the ceiling is lower than the robot.
    """
    free = rasterize(polygon_m, low, limits.grid_resolution_m, limits.robot_height_m)
    covered = np.pad(~standable(free, limits.robot_radius_m), 1, constant_values=True).astype(np.int16)
    rows, stride = covered.shape
    x = free.origin_m[0] + (np.arange(stride) - 0.5) * free.resolution_m - start_m[0]
    y = free.origin_m[1] + (np.arange(rows) - 0.5) * free.resolution_m - start_m[1]
    squared = ((y * y)[:, None] + x * x).ravel()
    within = limits.robot_radius_m + math.sqrt(2.0) * free.resolution_m
    nearest = np.argsort(squared, kind="stable")
    tally = np.zeros(TALLIES, np.int64)
    tally[STRIDE], tally[ROWS], tally[FREE] = stride, rows - 2, np.count_nonzero(covered == 0)
    return Floor(
        covered=covered.ravel(),
        mark=np.zeros((2, covered.size), np.uint8),
        stack=np.zeros(2 * covered.size, np.int32),
        entry=nearest[squared[nearest] < within * within].astype(np.int32),
        change=np.zeros(_MOST_CHANGES, np.int32),
        log=np.zeros((2 * _MOST_CHANGES, 2), np.int32),
        tally=tally,
        origin_x_m=free.origin_m[0],
        origin_y_m=free.origin_m[1],
        resolution_m=free.resolution_m,
        radius_m=limits.robot_radius_m - _TOUCH_M,
        height_m=limits.robot_height_m,
        share=limits.walkable_share,
    )


def circulation_losses(problem: Problem, state: State, floor: Floor) -> tuple[float, float]:
    """Return the losses circulation and reach of a layout; ``floor`` is an unfurnished room's and is left as it was."""
    circulation, missed = _measure_rasterized(problem, state, floor, traffic_of(problem, floor))
    return circulation, float(missed)


@kernel
def rasterize_objects(problem, state, floor, traffic, present):  # type: ignore[no-untyped-def]
    """Put all active objects on the raster of an unfurnished room (``present`` 1), or take them off it again (0)."""
    for i in range(len(problem.link)):
        if state.hold[i, col.ACTIVE]:
            for k in range(problem.link[i, col.SOLIDS], problem.link[i, col.ZONES]):
                if traffic.solid[k]:
                    move_box(state.placed, state.placed, k, 1 - present, present, floor)
    start_over(floor)


@kernel
def _exchange(problem, old, new, i, floor, traffic):  # type: ignore[no-untyped-def]
    """Move object ``i`` on the raster; its boxes are rows of ``old`` and ``new``."""
    for k in range(problem.link[i, col.SOLIDS], problem.link[i, col.ZONES]):
        if traffic.solid[k]:
            move_box(old, new, k, np.int64(1), np.int64(1), floor)


@kernel
def _within(box, x, y):  # type: ignore[no-untyped-def]
    dx, dy, c, s = x - box[boxes.X], y - box[boxes.Y], box[boxes.COS_YAW], box[boxes.SIN_YAW]
    return abs(dx * c + dy * s) <= box[boxes.HALF_DEPTH] and abs(dy * c - dx * s) <= box[boxes.HALF_WIDTH]


@kernel
def _still_reached(placed, first, last, cell, floor, mark):  # type: ignore[no-untyped-def]
    """Return whether a cell is reached and its centre lies in one of the strips."""
    if cell < 0 or mark[cell] != REACHED_CELL:
        return False
    side, row = floor.resolution_m, cell // floor.tally[STRIDE]
    x = floor.origin_x_m + (cell - row * floor.tally[STRIDE] - 0.5) * side
    y = floor.origin_y_m + (row - 0.5) * side
    for k in range(first, last):
        if _within(placed[k], x, y):
            return True
    return False


@kernel
def _reached_cell(box, floor, mark):  # type: ignore[no-untyped-def]
    """Return a reached cell whose centre lies in a strip, or -1."""
    side, stride = floor.resolution_m, floor.tally[STRIDE]
    c, s, half_d, half_w = abs(box[boxes.COS_YAW]), abs(box[boxes.SIN_YAW]), box[boxes.HALF_DEPTH], box[boxes.HALF_WIDTH]
    # Bound the rows and columns that the strip covers.
    reach_x, reach_y = half_d * c + half_w * s, half_d * s + half_w * c
    x, y = box[boxes.X] - floor.origin_x_m, box[boxes.Y] - floor.origin_y_m
    first_row, last_row = max(int((y - reach_y) / side), 0), min(int((y + reach_y) / side) + 1, floor.tally[ROWS])
    first_column, last_column = max(int((x - reach_x) / side), 0), min(int((x + reach_x) / side) + 1, stride - 2)
    for row in range(first_row, last_row):
        base = (row + 1) * stride + 1
        for column in range(first_column, last_column):
            if mark[base + column] == REACHED_CELL:
                if _within(box, floor.origin_x_m + (column + 0.5) * side, floor.origin_y_m + (row + 0.5) * side):
                    return base + column
    return -1


@loss("room", "circulation", "reach")
@kernel
def measure(problem, state, floor, mark, traffic):  # type: ignore[no-untyped-def]
    """Return the losses circulation and reach of what stands on the raster, whose marks are up to date."""
    tally, witness, missed = floor.tally, traffic.witness, 0
    share = tally[DONE] / tally[FREE] if tally[FREE] > 0 else 0.0
    for i in range(len(problem.link)):
        first, last = problem.link[i, col.STRIPS], problem.link[i, col.BOX_END]
        if last > first and state.hold[i, col.ACTIVE]:
            if not _still_reached(state.placed, first, last, witness[i], floor, mark):
                witness[i] = -1
                for k in range(first, last):
                    if witness[i] < 0:
                        witness[i] = _reached_cell(state.placed[k], floor, mark)
                missed += int(witness[i] < 0)
    return max(floor.share - share, 0.0), missed


@kernel
def changes_floor(problem, members, count):  # type: ignore[no-untyped-def]
    """Return whether one of the objects takes floor or must be reached."""
    for m in range(count):
        i = members[m]
        if problem.link[i, col.BLOCKS] or problem.link[i, col.BOX_END] > problem.link[i, col.STRIPS]:
            return True
    return False


@kernel
def try_move(problem, state, old, members, count, floor, traffic):  # type: ignore[no-untyped-def]
    """Return circulation and reach once the members, whose boxes were ``old``, have moved; :func:`commit_or_revert` has to follow."""
    for m in range(count):
        _exchange(problem, old, state.placed, members[m], floor, traffic)
    return measure(problem, state, floor, floor.mark[update(floor)], traffic)


@kernel
def commit_or_revert(problem, state, old, members, count, floor, traffic, committed):  # type: ignore[no-untyped-def]
    """Leave the raster as the members' move made it, or take it back to what it was before :func:`try_move`."""
    if not committed:
        for m in range(count):
            _exchange(problem, state.placed, old, members[m], floor, traffic)
    settle(floor, committed)


@entry
def _measure_rasterized(problem, state, floor, traffic):  # type: ignore[no-untyped-def]
    rasterize_objects(problem, state, floor, traffic, np.int64(1))
    losses = measure(problem, state, floor, floor.mark[floor.tally[SIDE]], traffic)
    rasterize_objects(problem, state, floor, traffic, np.int64(0))
    return losses
