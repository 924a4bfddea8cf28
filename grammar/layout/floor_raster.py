"""The floor as a raster of cells that change one by one: where a robot can stand, and which of these cells it reaches.

Each cell counts the solids that come nearer to its centre than the robot's radius.  A solid's cells in a row follow each other, because a
rectangle widened by a disc is convex, so a move costs the cells in which the old and the new run of each row differ.

What the robot reaches is kept by local changes where these are sure not to part or join anything: a cell that opens next to reached
cells only is reached; a reached cell may close when its reached neighbours stay connected around it (a simple point, Rosenfeld,
"Connectivity in digital pictures", J. ACM 1970).  All else is flooded anew from the door.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grammar.geometry import boxes
from grammar.geometry.arrays import Ints
from grammar.geometry.kernels import kernel

STRIDE, ROWS, FREE, DONE, SIDE, CHANGES, LOGGED, FLOODED, DONE_BEFORE, TALLIES = range(10)
"""Places in ``Floor.tally``, and how many there are."""

CLOSED, OPEN, REACHED_CELL = range(3)
"""Values of ``Floor.mark``."""

_MOST_PASSES = 6


class Floor(NamedTuple):
    """The raster of a room, (h, w) cells with a border of closed ones, row after row; row = y, column = x.

    covered: (c,) solids and walls too near to each cell; mark: (2, c) what the robot can do in each cell, in the layout at hand (row
    ``SIDE`` of ``tally``) and as work space; stack: (2 c,) work space; entry: (k,) cells in which the flood may begin, nearest to the door
    first; change: (m,) cells that opened or closed since the last :func:`update`; log: (m, 2) cells that it marked, and as what they were
    marked before; tally: (TALLIES,) cells in a row of the raster with its border, rows without it, number of standable and of reached
    cells, and the state of the update. origin_x_m, origin_y_m: outer corner of the first cell within the border; resolution_m: side of a
    cell; radius_m, height_m: of the robot; share: of the standable floor that it shall reach.
    """

    covered: NDArray[np.int16]
    mark: NDArray[np.uint8]
    stack: NDArray[np.int32]
    entry: NDArray[np.int32]
    change: NDArray[np.int32]
    log: NDArray[np.int32]
    tally: Ints
    origin_x_m: float
    origin_y_m: float
    resolution_m: float
    radius_m: float
    height_m: float
    share: float


NO_FLOOR = Floor(
    covered=np.zeros(0, np.int16),
    mark=np.zeros((2, 0), np.uint8),
    stack=np.zeros(0, np.int32),
    entry=np.zeros(0, np.int32),
    change=np.zeros(0, np.int32),
    log=np.zeros((0, 2), np.int32),
    tally=np.zeros(TALLIES, np.int64),
    origin_x_m=0.0,
    origin_y_m=0.0,
    resolution_m=0.0,
    radius_m=0.0,
    height_m=0.0,
    share=0.0,
)
"""The floor of a chain that leaves circulation and reach out of its energy."""


def _is_simple(ring: int) -> bool:
    """Return whether cells around a middle, bits 0 to 7 all the way round beginning beside it, stay 4-connected without the middle."""
    beside = sum(ring >> k & 1 for k in (0, 2, 4, 6))
    joined = sum(ring >> k & 1 and ring >> (k + 1) & 1 and ring >> (k + 2) % 8 & 1 for k in (0, 2, 4, 6))
    return beside <= 1 or beside - joined <= 1


_SIMPLE = np.array([_is_simple(ring) for ring in range(256)])


@kernel
def _reach_right(y, c, s, p, q, r):  # type: ignore[no-untyped-def]
    """Return the greatest x at height ``y`` of a rectangle about the origin widened by ``r``, whose yaw (cosine, sine) is below pi / 2."""
    top, right = p * s + q * c, p * s - q * c
    if y > right + r * s:
        if y <= top + r * s:
            return (p + r - y * s) / c
        return p * c - q * s + math.sqrt(max(r * r - (y - top) ** 2, 0.0))
    if y >= right - r * c:
        return p * c + q * s + math.sqrt(max(r * r - (y - right) ** 2, 0.0))
    if y >= -top - r * c:
        return (q + r + y * c) / s
    return q * s - p * c + math.sqrt(max(r * r - (y + top) ** 2, 0.0))


@kernel
def _shape(placed, k):  # type: ignore[no-untyped-def]
    """Return cosine, sine and half extents of a box's footprint as a rectangle whose yaw is below pi / 2."""
    c, s, half_d, half_w = placed[k, boxes.COS_YAW], placed[k, boxes.SIN_YAW], placed[k, boxes.HALF_DEPTH], placed[k, boxes.HALF_WIDTH]
    if c * s < 0.0:
        return abs(s), abs(c), half_w, half_d
    return abs(c), abs(s), half_d, half_w


@kernel
def _rows(placed, k, shape, floor):  # type: ignore[no-untyped-def]
    """Return the first row, and the one past the last, whose centres the widened box may cover."""
    c, s, p, q = shape
    side, extent = floor.resolution_m, p * s + q * c + floor.radius_m
    middle = (placed[k, boxes.Y] - floor.origin_y_m) / side - 0.5
    return max(math.floor(middle - extent / side) + 1, 0), min(math.ceil(middle + extent / side), floor.tally[ROWS])


@kernel
def _run_of(placed, k, shape, row, floor):  # type: ignore[no-untyped-def]
    """Return the first column, and the one past the last, whose centres in a row the widened box covers."""
    c, s, p, q = shape
    side, r = floor.resolution_m, floor.radius_m
    y = floor.origin_y_m + (row + 0.5) * side - placed[k, boxes.Y]
    middle, columns = (placed[k, boxes.X] - floor.origin_x_m) / side - 0.5, floor.tally[STRIDE] - 2
    first = middle - _reach_right(-y, c, s, p, q, r) / side
    last = middle + _reach_right(y, c, s, p, q, r) / side
    begin = math.floor(min(max(first, -1.0), columns)) + 1
    return begin, max(math.ceil(min(max(last, 0.0), columns)), begin)


@kernel
def _add(floor, base, first, last, sign):  # type: ignore[no-untyped-def]
    """Add ``sign`` to the cells ``base + first`` to ``base + last - 1``, and note those that open or close."""
    covered, change, tally = floor.covered, floor.change, floor.tally
    for cell in range(base + first, base + last):
        before = covered[cell]
        covered[cell] = before + sign
        if before == 0 or before + sign == 0:
            tally[FREE] += int(before + sign == 0) - int(before == 0)
            if tally[CHANGES] < len(change):
                change[tally[CHANGES]] = cell
            tally[CHANGES] += 1


@kernel
def move_box(old, new, k, had, has, floor):  # type: ignore[no-untyped-def]
    """Take box ``k`` off the raster as it is in ``old``, if it was there, and put it on as it is in ``new``, if it comes there.

    ``had``, ``has``: int64, 1 or 0; literals would make numba compile a kernel for each of them.
    """
    old_shape, new_shape = _shape(old, k), _shape(new, k)
    old_rows, new_rows = _rows(old, k, old_shape, floor), _rows(new, k, new_shape, floor)
    if not had:
        old_rows = new_rows
    if not has:
        new_rows = old_rows
    columns = floor.tally[STRIDE] - 2
    # Change the cells by which the old and the new run of each row differ, on either side.
    for row in range(min(old_rows[0], new_rows[0]), max(old_rows[1], new_rows[1])):
        a, b, u, v = columns, columns, columns, columns
        if had and old_rows[0] <= row < old_rows[1]:
            a, b = _run_of(old, k, old_shape, row, floor)
        if has and new_rows[0] <= row < new_rows[1]:
            u, v = _run_of(new, k, new_shape, row, floor)
        if a == u and b == v:
            continue
        base = (row + 1) * floor.tally[STRIDE] + 1
        _add(floor, base, a, min(b, u), np.int64(-1))
        _add(floor, base, max(a, v), b, np.int64(-1))
        _add(floor, base, u, min(v, a), np.int64(1))
        _add(floor, base, max(u, b), v, np.int64(1))


@kernel
def _mark(floor, mark, cell, value):  # type: ignore[no-untyped-def]
    """Mark a cell and log what it was marked before."""
    tally = floor.tally
    floor.log[tally[LOGGED], 0], floor.log[tally[LOGGED], 1] = cell, mark[cell]
    tally[LOGGED] += 1
    mark[cell] = value


@kernel
def _open_cells(floor, mark, count):  # type: ignore[no-untyped-def]
    """Mark the changed cells that opened; return whether that joined nothing to what is reached."""
    covered, change, tally, stride = floor.covered, floor.change, floor.tally, floor.tally[STRIDE]
    # Mark what opened beside reached cells, again as long as that makes more cells neighbours of reached ones.
    for _ in range(_MOST_PASSES):
        met = 0
        for n in range(count):
            cell = change[n]
            if covered[cell] > 0 or mark[cell] != CLOSED:
                continue
            beside = (mark[cell - 1], mark[cell + 1], mark[cell - stride], mark[cell + stride])
            if max(beside) == REACHED_CELL:
                if OPEN in beside:
                    return False
                _mark(floor, mark, cell, REACHED_CELL)
                tally[DONE] += 1
                met += 1
        if met == 0:
            break
    # What is left opened away from all that is reached.
    for n in range(count):
        cell = change[n]
        if covered[cell] == 0 and mark[cell] == CLOSED:
            if max(mark[cell - 1], mark[cell + 1], mark[cell - stride], mark[cell + stride]) == REACHED_CELL:
                return False
            _mark(floor, mark, cell, OPEN)
    return True


@kernel
def _close_cells(floor, mark, count):  # type: ignore[no-untyped-def]
    """Mark the changed cells that closed; return whether that parted nothing."""
    covered, change, tally, stride = floor.covered, floor.change, floor.tally, floor.tally[STRIDE]
    for _ in range(_MOST_PASSES):
        left, met = 0, 0
        for n in range(count):
            cell = change[n]
            if covered[cell] == 0 or mark[cell] == CLOSED:
                continue
            if mark[cell] == REACHED_CELL:
                # Gather the reached neighbours all the way round; without this cell they must stay connected.
                ring, bit = 0, 1
                for at in (cell + 1, cell + 1 + stride, cell + stride, cell - 1 + stride,
                           cell - 1, cell - 1 - stride, cell - stride, cell + 1 - stride):  # fmt: skip
                    ring += bit * int(mark[at] == REACHED_CELL)
                    bit *= 2
                if not _SIMPLE[ring]:
                    left += 1
                    continue
                tally[DONE] -= 1
            _mark(floor, mark, cell, CLOSED)
            met += 1
        if left == 0:
            return True
        if met == 0:
            return False
    return False


@kernel
def _undo(floor, mark):  # type: ignore[no-untyped-def]
    """Mark all logged cells as before."""
    tally = floor.tally
    while tally[LOGGED] > 0:
        tally[LOGGED] -= 1
        mark[floor.log[tally[LOGGED], 0]] = floor.log[tally[LOGGED], 1]


@kernel
def _entry_cell(floor):  # type: ignore[no-untyped-def]
    """Return the standable cell in which the flood begins, -1 without one."""
    for k in range(len(floor.entry)):
        if floor.covered[floor.entry[k]] == 0:
            return floor.entry[k]
    return -1


@kernel
def _flood(floor, mark):  # type: ignore[no-untyped-def]
    """Mark all cells anew, run by run along the rows; return how many are reached."""
    covered, stack, stride = floor.covered, floor.stack, floor.tally[STRIDE]
    for cell in range(len(covered)):
        mark[cell] = OPEN if covered[cell] == 0 else CLOSED
    start, top, done = _entry_cell(floor), 0, 0
    if start >= 0:
        stack[0], top = start, 1
    while top > 0:
        top -= 1
        left = stack[top]
        if mark[left] != OPEN:
            continue
        # Mark the whole run of open cells around this one.
        right = left
        while mark[left - 1] == OPEN:
            left -= 1
        while mark[right] == OPEN:
            right += 1
        for cell in range(left, right):
            mark[cell] = REACHED_CELL
        done += right - left
        # Put one open cell of each run in the rows above and below on the stack.
        for beside in (-stride, stride):
            inside = False
            for cell in range(left + beside, right + beside):
                is_open = mark[cell] == OPEN
                if is_open and not inside:
                    stack[top] = cell
                    top += 1
                inside = is_open
    return done


@kernel
def start_over(floor):  # type: ignore[no-untyped-def]
    """Flood the raster and forget all changes."""
    tally = floor.tally
    tally[DONE] = _flood(floor, floor.mark[tally[SIDE]])
    tally[CHANGES] = tally[LOGGED] = tally[FLOODED] = 0


@kernel
def update(floor):  # type: ignore[no-untyped-def]
    """Bring marks and tallies up to the changes; :func:`settle` has to follow.  Return the row of ``mark`` that now holds."""
    tally, side = floor.tally, floor.tally[SIDE]
    changes, tally[CHANGES], tally[DONE_BEFORE] = tally[CHANGES], 0, tally[DONE]
    if changes == 0:
        return side
    mark = floor.mark[side]
    if changes <= len(floor.change) and _open_cells(floor, mark, changes) and _close_cells(floor, mark, changes):
        start = _entry_cell(floor)
        if start >= 0 and mark[start] == REACHED_CELL:
            return side
    _undo(floor, mark)
    tally[FLOODED] = 1
    tally[DONE] = _flood(floor, floor.mark[1 - side])
    return 1 - side


@kernel
def settle(floor, committed):  # type: ignore[no-untyped-def]
    """Keep the marks of the last :func:`update`, or go back to those before it once the boxes are back."""
    tally = floor.tally
    if committed:
        tally[SIDE] = (tally[SIDE] + tally[FLOODED]) % 2
    else:
        _undo(floor, floor.mark[tally[SIDE]])
        tally[DONE] = tally[DONE_BEFORE]
    tally[CHANGES] = tally[LOGGED] = tally[FLOODED] = 0
