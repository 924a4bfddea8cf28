"""Proposals of the layout chain, each with its Hastings ratio.

- translate, rotate (now and then by a quarter turn), slide along the direction of a random wall: symmetric diffusions
- swap: two objects exchange position and orientation; symmetric
- repoint: an object goes to a uniform place on another support surface that can carry it, keeping its yaw there; the ratio is that of the
  areas
- a row of units (:mod:`grammar.layout.unit_rows`) is shifted by translate and slide, has two units exchanged by rotate and swap, and goes
  to another slot by repoint and relocate; all symmetric
- relocate: an object is drawn afresh from a mixture of a uniform pose, poses at walls (snap to wall) and poses around its core or on a
  support surface, whose density is computed for the old pose and the new one

Translations, rotations, slides and swaps are the paper's (Jiang et al., IJCV 2018, section 3.2), the mixture takes the place of its random
restarts.  A pose's base measure is area times angle (length along the walls for what hangs there), over the bounding box of the room, the
walls, or the support surfaces.
"""

import math

import numpy as np

from grammar.geometry import walls
from grammar.geometry.kernels import inlined, kernel
from grammar.layout import columns as col
from grammar.layout.frames import (
    along_wall,
    copy_pose,
    hang,
    in_surface_frame,
    pick,
    put_on_surface,
    start_from,
    surface_owner,
    uniform_on_surface,
    wall_of_core,
    wrap,
)
from grammar.layout.relocate import relocate, relocation_density
from grammar.layout.unit_rows import is_head, propose_row
from grammar.spec.rules import MOVES

TRANSLATE = MOVES.index("translate")
ROTATE = MOVES.index("rotate")
SLIDE = MOVES.index("slide")
SWAP = MOVES.index("swap")
REPOINT = MOVES.index("repoint")
RELOCATE = MOVES.index("relocate")

_LEAST_DENSITY = 1e-300


@kernel
def _in_domain(problem, state, proposal, place):  # type: ignore[no-untyped-def]
    """Return whether a proposed pose lies in the space of poses: the room's bounding box, a wall's length, or a support surface."""
    i, x, y = proposal.tag[place, col.LEADER], proposal.pose[place, col.X], proposal.pose[place, col.Y]
    mount, wall, surface = problem.link[i, col.MOUNT], problem.wall, problem.surface
    if mount == col.WALL:
        w, half, core = proposal.tag[place, col.NEW_WALL], problem.object[i, col.HALF_WIDTH], problem.link[i, col.CORE]
        if core >= 0 and problem.link[core, col.MOUNT] == col.FLOOR and w != wall_of_core(problem, state, core):
            return False
        return half <= along_wall(wall, w, x, y) <= wall[w, walls.LENGTH] - half
    if mount == col.OBJECT:
        k = proposal.tag[place, col.NEW_SURFACE]
        u, v = in_surface_frame(problem, state, k, x, y)
        return abs(u) <= surface[k, col.SURFACE_HALF_DEPTH] and abs(v) <= surface[k, col.SURFACE_HALF_WIDTH]
    return problem.x_low <= x <= problem.x_high and problem.y_low <= y <= problem.y_high


@kernel
def propose(rng, problem, state, settings, move, i, movable, proposal):  # type: ignore[no-untyped-def]
    """Fill ``proposal`` with move number ``move`` of object ``i``.

    Returns:
        count: number of objects that lead the move, 0 when it does not apply to them.
        log_q_ratio: log q(old | new) - log q(new | old).
    """
    if is_head(problem, i):
        kind = 0 if move == TRANSLATE or move == SLIDE else 1 if move == ROTATE or move == SWAP else 2
        return propose_row(rng, problem, state, settings, i, np.int64(kind), proposal), 0.0
    start_from(state, proposal, np.int64(0), i)
    mount, count, log_q_ratio = problem.link[i, col.MOUNT], 1, 0.0
    if mount == col.FIXED:
        return 0, 0.0
    if move == TRANSLATE or move == SLIDE:
        _diffuse(rng, problem, state, settings, move, i, proposal)
    elif move == ROTATE:
        if mount != col.FLOOR and mount != col.OBJECT:
            return 0, 0.0
        _rotate(rng, settings, proposal)
    elif move == SWAP:
        count = _swap(rng, problem, state, i, movable, proposal)
    elif move == REPOINT:
        count, log_q_ratio = _repoint(rng, problem, state, i, proposal)
    else:
        old = relocation_density(problem, state, settings, i, proposal)
        relocate(rng, problem, state, settings, i, proposal)
        new = relocation_density(problem, state, settings, i, proposal)
        log_q_ratio = math.log(max(old, _LEAST_DENSITY)) - math.log(max(new, _LEAST_DENSITY))
    for place in range(count):
        if not _in_domain(problem, state, proposal, place):
            return 0, 0.0
    return count, log_q_ratio


@inlined
def _diffuse(rng, problem, state, settings, move, i, proposal):  # type: ignore[no-untyped-def]
    """Shift an object by a normal step: any way, along a direction of a wall or of its support, or along the wall that it hangs on."""
    pose, mount = proposal.pose, problem.link[i, col.MOUNT]
    sd = settings.translate_sd_m[pick(rng, len(settings.translate_sd_m))]
    if mount == col.WALL:
        w = state.hold[i, col.ON_WALL]
        along = along_wall(problem.wall, w, pose[0, col.X], pose[0, col.Y])
        hang(problem, proposal, np.int64(0), i, w, along + sd * rng.standard_normal())
    elif move == TRANSLATE:
        pose[0, col.X] += sd * rng.standard_normal()
        pose[0, col.Y] += sd * rng.standard_normal()
    else:
        if mount == col.OBJECT:
            yaw = state.where[surface_owner(problem, state.hold[i, col.SURFACE]), col.YAW] + 0.5 * math.pi * pick(rng, 2)
        else:
            yaw = problem.wall[pick(rng, len(problem.wall)), walls.WALL_YAW]
        step = sd * rng.standard_normal()
        pose[0, col.X] -= step * math.sin(yaw)
        pose[0, col.Y] += step * math.cos(yaw)


@inlined
def _rotate(rng, settings, proposal):  # type: ignore[no-untyped-def]
    """Turn an object by quarter turns or by a normal angle."""
    if rng.random() < settings.quarter_turn:
        turn = 0.5 * math.pi * (1 + pick(rng, 3))
    else:
        turn = settings.rotate_sd_rad[pick(rng, len(settings.rotate_sd_rad))] * rng.standard_normal()
    proposal.pose[0, col.YAW] = wrap(proposal.pose[0, col.YAW] + turn)


@kernel
def _swap(rng, problem, state, i, movable, proposal):  # type: ignore[no-untyped-def]
    """Let an object and a random other one that is mounted as it is exchange their poses; return how many lead the move."""
    j = movable[pick(rng, len(movable))]
    where, mount = state.where, problem.link[i, col.MOUNT]
    if i == j or problem.link[j, col.ROW] >= 0 or mount != problem.link[j, col.MOUNT] or (mount != col.FLOOR and mount != col.WALL):
        return 0
    start_from(state, proposal, np.int64(1), j)
    for place in range(2):
        mover, other = (i, j) if place == 0 else (j, i)
        if mount == col.WALL:
            w = state.hold[other, col.ON_WALL]
            hang(problem, proposal, place, mover, w, along_wall(problem.wall, w, where[other, col.X], where[other, col.Y]))
        else:
            copy_pose(state, other, proposal, place)
    return 2


@kernel
def _surface_area(problem, k):  # type: ignore[no-untyped-def]
    return 4.0 * problem.surface[k, col.SURFACE_HALF_DEPTH] * problem.surface[k, col.SURFACE_HALF_WIDTH]


@kernel
def _repoint(rng, problem, state, i, proposal):  # type: ignore[no-untyped-def]
    """Draw another target of an object's support address and a uniform place there; return the count of leaders and the Hastings ratio."""
    first, last = problem.link[i, col.TARGETS], problem.link[i, col.MODE_END]
    if last - first < 2:
        return 0, 0.0
    old, new = state.hold[i, col.SURFACE], int(problem.mode[first + pick(rng, last - first), col.TARGET])
    turn = state.where[i, col.YAW] - state.where[surface_owner(problem, old), col.YAW]
    u, v = uniform_on_surface(rng, problem, new)
    put_on_surface(problem, state, proposal, new, u, v, turn)
    return 1, math.log(_surface_area(problem, new)) - math.log(_surface_area(problem, old))
