"""Proposals of the layout chain, each with its Hastings ratio.

- translate, rotate (now and then by a quarter turn), slide along the direction of a random wall: symmetric diffusions
- swap: two objects exchange position and orientation; symmetric
- repoint: an object goes to a uniform place on another top that can carry it, keeping its yaw there; the ratio is that of the areas
- relocate: an object is drawn afresh from a mixture of a uniform pose, poses at walls (snap to wall) and poses around its core or on a
  top, whose density is computed for the old pose and the new one

The first four are the paper's (Jiang et al., IJCV 2018, section 3.2), the mixture takes the place of its random restarts.  A pose's base
measure is area times angle (length along the walls for what hangs there), over the bounding box of the room, the walls, or the tops.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grammar.geometry.kernels import INNER
from grammar.layout.energies import in_slot, wrap
from grammar.layout.problem import (
    BOUNDS,
    CANDIDATE,
    CORE,
    FIXED,
    FLOOR,
    HALF_WIDTH,
    MODE_END,
    MOUNT,
    OBJECT,
    ON_WALL,
    SLOT,
    SLOT_HALF_DEPTH,
    SLOT_HALF_WIDTH,
    SLOT_OWNER,
    WALL,
)
from grammar.layout.proposal import (
    LEADER,
    NEW_SLOT,
    NEW_WALL,
    QUARTER_TURN,
    MoveSettings,
    along_wall,
    hang,
    move_settings,
    pick,
    put_on_slot,
    start_from,
    wall_of_core,
)
from grammar.layout.relocate import relocate, relocation_density
from grammar.spec.rules import MOVES

__all__ = ["MoveSettings", "move_settings", "propose"]

TRANSLATE, ROTATE, SLIDE, SWAP, REPOINT, RELOCATE = range(len(MOVES))


@njit(**INNER)
def _in_domain(problem, state, proposal, place):  # type: ignore[no-untyped-def]
    """Return whether a proposed pose lies in the space of poses: the room's bounding box, a wall's length, or a top."""
    i, x, y = proposal.tag[place, LEADER], proposal.pose[place, 0], proposal.pose[place, 1]
    mount, number = problem.link[i, MOUNT], problem.number
    if mount == WALL:
        w, half, core = proposal.tag[place, NEW_WALL], problem.object[i, HALF_WIDTH], problem.link[i, CORE]
        if core >= 0 and problem.link[core, MOUNT] == FLOOR and w != wall_of_core(problem, state, core):
            return False
        return half <= along_wall(problem.wall, w, x, y) <= problem.wall[w, 4] - half
    if mount == OBJECT:
        slot = proposal.tag[place, NEW_SLOT]
        u, v = in_slot(problem, state, slot, x, y)
        return abs(u) <= problem.slot[slot, SLOT_HALF_DEPTH] and abs(v) <= problem.slot[slot, SLOT_HALF_WIDTH]
    return number[BOUNDS] <= x <= number[BOUNDS + 2] and number[BOUNDS + 1] <= y <= number[BOUNDS + 3]


@njit(**INNER)
def propose(rng, problem, state, settings, move, i, movable, proposal):  # type: ignore[no-untyped-def]
    """Fill ``proposal`` with move number ``move`` of object ``i``.

    Returns:
        count: number of objects that lead the move, 0 when it does not apply to them.
        log_q_ratio: log q(old | new) - log q(new | old).
    """
    start_from(state, proposal, np.int64(0), i)
    pose, mount, count, log_q_ratio = proposal.pose, problem.link[i, MOUNT], 1, 0.0
    if mount == FIXED:
        return 0, 0.0
    if move == TRANSLATE or move == SLIDE:
        sd = settings.sd[0, pick(rng, settings.sd.shape[1])]
        if mount == WALL:
            w = state.hold[i, ON_WALL]
            hang(problem, proposal, np.int64(0), i, w, along_wall(problem.wall, w, pose[0, 0], pose[0, 1]) + sd * rng.standard_normal())
        elif move == TRANSLATE:
            pose[0, 0] += sd * rng.standard_normal()
            pose[0, 1] += sd * rng.standard_normal()
        else:
            if mount == OBJECT:
                yaw = state.where[int(problem.slot[state.hold[i, SLOT], SLOT_OWNER]), 2] + 0.5 * math.pi * pick(rng, 2)
            else:
                yaw = problem.wall[pick(rng, len(problem.wall)), 7]
            step = sd * rng.standard_normal()
            pose[0, 0] -= step * math.sin(yaw)
            pose[0, 1] += step * math.cos(yaw)
    elif move == ROTATE:
        if mount != FLOOR and mount != OBJECT:
            return 0, 0.0
        if rng.random() < settings.number[QUARTER_TURN]:
            turn = 0.5 * math.pi * (1 + pick(rng, 3))
        else:
            turn = settings.sd[1, pick(rng, settings.sd.shape[1])] * rng.standard_normal()
        pose[0, 2] = wrap(pose[0, 2] + turn)
    elif move == SWAP:
        count = _swap(rng, problem, state, i, movable, proposal)
    elif move == REPOINT:
        count, log_q_ratio = _repoint(rng, problem, state, i, proposal)
    else:
        old = relocation_density(problem, state, settings, i, proposal)
        relocate(rng, problem, state, settings, i, proposal)
        log_q_ratio = math.log(max(old, 1e-300)) - math.log(max(relocation_density(problem, state, settings, i, proposal), 1e-300))
    for place in range(count):
        if not _in_domain(problem, state, proposal, place):
            return 0, 0.0
    return count, log_q_ratio


@njit(**INNER)
def _swap(rng, problem, state, i, movable, proposal):  # type: ignore[no-untyped-def]
    j = movable[pick(rng, len(movable))]
    mount = problem.link[i, MOUNT]
    if i == j or mount != problem.link[j, MOUNT] or (mount != FLOOR and mount != WALL):
        return 0
    start_from(state, proposal, np.int64(1), j)
    for place in range(2):
        mover, other = (i, j) if place == 0 else (j, i)
        if mount == WALL:
            w = state.hold[other, ON_WALL]
            hang(problem, proposal, place, mover, w, along_wall(problem.wall, w, state.where[other, 0], state.where[other, 1]))
        else:
            for k in range(3):
                proposal.pose[place, k] = state.where[other, k]
    return 2


@njit(**INNER)
def _slot_area(problem, slot):  # type: ignore[no-untyped-def]
    return 4.0 * problem.slot[slot, SLOT_HALF_DEPTH] * problem.slot[slot, SLOT_HALF_WIDTH]


@njit(**INNER)
def _repoint(rng, problem, state, i, proposal):  # type: ignore[no-untyped-def]
    first, last = problem.link[i, CANDIDATE], problem.link[i, MODE_END]
    if last - first < 2:
        return 0, 0.0
    old, new = state.hold[i, SLOT], int(problem.mode[first + pick(rng, last - first), 0])
    turn = state.where[i, 2] - state.where[int(problem.slot[old, SLOT_OWNER]), 2]
    u = problem.slot[new, SLOT_HALF_DEPTH] * (2.0 * rng.random() - 1.0)
    v = problem.slot[new, SLOT_HALF_WIDTH] * (2.0 * rng.random() - 1.0)
    put_on_slot(problem, state, proposal, new, u, v, turn)
    return 1, math.log(_slot_area(problem, new)) - math.log(_slot_area(problem, old))
