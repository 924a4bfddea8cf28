"""What moves along with the leaders of a proposal, and how all of it moves and comes back.

A moved unit takes its whole row along.  What stands on a moved object moves along rigidly, and, when the draw says so, what is grouped
around it too.  What hangs above a core that stands follows it from wall to wall.  A rigid motion keeps volume, so it adds nothing to the
Hastings ratio.
"""

import math
from typing import NamedTuple

import numpy as np

from grammar.geometry import walls
from grammar.geometry.arrays import Ints
from grammar.geometry.boxes import BOX_WIDTH
from grammar.geometry.kernels import inlined, kernel
from grammar.layout import columns as col
from grammar.layout.frames import along_wall, place_object, point_at_wall, surface_owner, wall_of_core, wrap
from grammar.layout.problem import Problem, State, zero_state
from grammar.layout.unit_rows import is_head, move_row

_HUNG = 3
"""What moves with leader k is marked k + 1; units of a moved row, and what follows its core from wall to wall, this plus its own index."""


class Moved(NamedTuple):
    """Work space for the objects that one proposal moves.

    members: (n,) their indices; leader: (n,) which leader (0, 1) each of these follows; mark: (n,) by object, 0 for what stays, else a mark
    that what moves rigidly together shares; before: what the state held for the members before they moved.
    """

    members: Ints
    leader: Ints
    mark: Ints
    before: State


def nothing_moved(problem: Problem) -> Moved:
    """Return work space in which nothing moves."""
    n = len(problem.link)
    return Moved(np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64), zero_state(problem))


@inlined
def release(count, moved):  # type: ignore[no-untyped-def]
    """Mark the gathered objects as staying."""
    for m in range(count):
        moved.mark[moved.members[m]] = 0


@kernel
def gather(problem, state, i, leader, carry, count, moved):  # type: ignore[no-untyped-def]
    """Append object ``i`` and everything that moves along with it; return the new count, or -1 if two leaders meet.

    ``carry``: what is grouped around an object and stands on the floor moves along with it.
    """
    link, members, mark, first = problem.link, moved.members, moved.mark, count
    if mark[i] > 0:
        release(count, moved)
        return -1
    members[count], moved.leader[count], mark[i] = i, leader, leader + 1
    count += 1
    if is_head(problem, i):
        for j in range(len(link)):
            if link[j, col.ROW] == link[i, col.ROW] and j != i:
                members[count], moved.leader[count], mark[j] = j, leader, _HUNG + j
                count += 1
    # Go through the members in the order in which they came in; each appends its own followers.
    while first < count:
        owner = members[first]
        first += 1
        if link[owner, col.LEADS] == 0:
            continue
        for j in range(len(link)):
            if not state.hold[j, col.ACTIVE]:
                continue
            mount, belongs = link[j, col.MOUNT], link[j, col.CORE] == owner
            stands = mount == col.OBJECT and surface_owner(problem, state.hold[j, col.SURFACE]) == owner
            hangs = mount == col.WALL and belongs and link[owner, col.MOUNT] == col.FLOOR
            if stands or hangs or (carry and mount == col.FLOOR and belongs):
                if mark[j] > 0:
                    release(count, moved)
                    return -1
                members[count], moved.leader[count], mark[j] = j, leader, _HUNG + j if hangs else mark[owner]
                count += 1
    return count


@inlined
def _copy_object(problem, source, target, i):  # type: ignore[no-untyped-def]
    """Copy what a state holds for object ``i``, but whether it takes part."""
    for k in range(col.WHERE_WIDTH):
        target.where[i, k] = source.where[i, k]
    for k in range(col.HOLD_WIDTH):
        if k != col.ACTIVE:
            target.hold[i, k] = source.hold[i, k]
    for b in range(problem.link[i, col.SOLIDS], problem.link[i, col.BOX_END]):
        for k in range(BOX_WIDTH):
            target.placed[b, k] = source.placed[b, k]


@inlined
def _lead(problem, state, i, proposal, place):  # type: ignore[no-untyped-def]
    """Write the new pose of a leader."""
    where, hold, pose = state.where, state.hold, proposal.pose
    where[i, col.X], where[i, col.Y], where[i, col.YAW] = pose[place, col.X], pose[place, col.Y], pose[place, col.YAW]
    hold[i, col.SURFACE], hold[i, col.ON_WALL] = proposal.tag[place, col.NEW_SURFACE], proposal.tag[place, col.NEW_WALL]
    if problem.link[i, col.MOUNT] == col.OBJECT:
        surface = hold[i, col.SURFACE]
        where[i, col.Z] = where[surface_owner(problem, surface), col.Z] + problem.surface[surface, col.SURFACE_Z]


@inlined
def _hang_again(problem, state, i, moved):  # type: ignore[no-untyped-def]
    """Move what hangs above a core that stands to the wall at the core's new back, as far along it from the core as before.

    Which wall that is depends on the core's pose alone, so the way back leads to the old place, and lengths along walls are kept.
    """
    where, before, wall, core = state.where, moved.before.where, problem.wall, problem.link[i, col.CORE]
    old, new = state.hold[i, col.ON_WALL], wall_of_core(problem, state, core)
    along = along_wall(wall, old, where[i, col.X], where[i, col.Y]) - along_wall(wall, old, before[core, col.X], before[core, col.Y])
    along += along_wall(wall, new, where[core, col.X], where[core, col.Y])
    where[i, col.X], where[i, col.Y] = point_at_wall(wall, new, along, problem.object[i, col.HALF_DEPTH])
    where[i, col.YAW], state.hold[i, col.ON_WALL] = wall[new, walls.WALL_YAW], new


@inlined
def _follow(state, i, head, moved):  # type: ignore[no-untyped-def]
    """Move object ``i`` rigidly with the object ``head``, which has moved already."""
    where, before = state.where, moved.before.where
    turn = where[head, col.YAW] - before[head, col.YAW]
    c, s = math.cos(turn), math.sin(turn)
    dx, dy = where[i, col.X] - before[head, col.X], where[i, col.Y] - before[head, col.Y]
    where[i, col.X], where[i, col.Y] = where[head, col.X] + dx * c - dy * s, where[head, col.Y] + dx * s + dy * c
    where[i, col.YAW] = wrap(where[i, col.YAW] + turn)
    where[i, col.Z] += where[head, col.Z] - before[head, col.Z]


@kernel
def apply_move(problem, state, proposal, count, moved):  # type: ignore[no-untyped-def]
    """Write the leaders' new poses and move their followers; what was there before goes to ``moved.before``."""
    for m in range(count):
        _copy_object(problem, state, moved.before, moved.members[m])
    if is_head(problem, proposal.tag[0, col.LEADER]):
        move_row(problem, state, proposal)
    for m in range(count):
        i, place, mark = moved.members[m], moved.leader[m], moved.mark[moved.members[m]]
        leader = proposal.tag[place, col.LEADER]
        if problem.link[i, col.ROW] >= 0:
            pass  # a row moves as a whole
        elif leader == i:
            _lead(problem, state, i, proposal, place)
        elif mark == _HUNG + i:
            _hang_again(problem, state, i, moved)
        else:
            _follow(state, i, leader if mark < _HUNG else mark - _HUNG, moved)
        place_object(problem, state, i)


@kernel
def revert_move(problem, state, count, moved):  # type: ignore[no-untyped-def]
    """Undo :func:`apply_move`."""
    for m in range(count):
        _copy_object(problem, moved.before, state, moved.members[m])


@kernel
def copy_layout(state, kept, count, moved):  # type: ignore[no-untyped-def]
    """Copy to ``kept`` a layout, without its boxes, as it was before the move of ``count`` objects (0: as it is)."""
    for i in range(len(state.where)):
        for k in range(col.WHERE_WIDTH):
            kept.where[i, k] = state.where[i, k]
        for k in range(col.HOLD_WIDTH):
            kept.hold[i, k] = state.hold[i, k]
    for m in range(count):
        i = moved.members[m]
        for k in range(col.WHERE_WIDTH):
            kept.where[i, k] = moved.before.where[i, k]
        for k in range(col.HOLD_WIDTH):
            if k != col.ACTIVE:
                kept.hold[i, k] = moved.before.hold[i, k]


@kernel
def followers_in_room(problem, state, count, moved):  # type: ignore[no-untyped-def]
    """Return whether what was carried along is still in the space of poses: the room's bounding box, or a wall's length."""
    for m in range(count):
        i = moved.members[m]
        x, y = state.where[i, col.X], state.where[i, col.Y]
        if problem.link[i, col.MOUNT] == col.FLOOR:
            if not (problem.x_low <= x <= problem.x_high and problem.y_low <= y <= problem.y_high):
                return False
        elif problem.link[i, col.MOUNT] == col.WALL:
            w, half = state.hold[i, col.ON_WALL], problem.object[i, col.HALF_WIDTH]
            if not half <= along_wall(problem.wall, w, x, y) <= problem.wall[w, walls.LENGTH] - half:
                return False
    return True
