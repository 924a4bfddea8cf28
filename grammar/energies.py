"""Losses of a layout: the cliques of walls, furniture, support and groups, and the measures of what no valid room has.

``E = sum of weight * loss`` over the terms of :data:`grammar.rules.TERMS`, the Gibbs prior's exponent (Jiang et al., IJCV 2018, section
2.2):

- wall: ``|distance - mean|`` and ``|yaw - mean|`` to the wall that an object fits best, of all walls and all of its modes
- occlusion: ``max(0, 1 - d / d_acc)`` of the space before an object, d_acc deep, that another object or a wall leaves only d deep; objects
of
  one group do not count for each other
- support: the sum over a top's four edges of ``|distance - mean|``, ``|yaw - mean|``, and -log of the address's probability
- group: the same as for walls, in the frame of the core object
- overlap, out_of_room, blocked (zones of doors, windows and pictures), overhang: depths in metres, zero in a valid room

An energy vector holds the unweighted losses.  The part of it that changes when some objects move is the sum over the cliques that contain
one of them, so a proposal costs what its own objects cost.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grammar.boxes import place_boxes, row_penetration
from grammar.layout import ACCESS, FIXED, FLOOR, OBJECT, SWING, VIEW, WALL, Floats, Problem, State
from grammar.rules import TERMS
from grammar.walls import rectangle_outside

(
    OVERLAP,
    OUT_OF_ROOM,
    BLOCKED,
    OVERHANG,
    WALL_DISTANCE,
    WALL_ORIENTATION,
    OCCLUSION,
    SUPPORT_POSITION,
    SUPPORT_ORIENTATION,
    SUPPORT_ADDRESS,
    GROUP_DISTANCE,
    GROUP_ORIENTATION,
    ROOM_CENTRE,
) = range(len(TERMS))

_TOUCH_M = 1e-6


@njit(cache=True)
def wrap(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@njit(cache=True)
def place_object(problem, state, i):  # type: ignore[no-untyped-def]
    """Write the world boxes of object ``i`` after its pose changed."""
    x, y, yaw, z = state.pose[i, 0], state.pose[i, 1], state.pose[i, 2], state.z[i]
    place_boxes(problem.box, problem.box_first[i], problem.box_first[i + 1], x, y, z, yaw, state.solid)
    place_boxes(problem.zone, problem.zone_first[i], problem.zone_first[i + 1], x, y, z, yaw, state.zone)


@njit(cache=True)
def wall_losses(wall, wall_yaw, mode, first, last, x, y, yaw, half_d, half_w, w_distance, w_orientation):  # type: ignore[no-untyped-def]
    """Return the distance and orientation losses of an object to the wall and mode (rows ``first`` to ``last - 1``) that it fits best.

    The gap is that between wall and footprint along the wall's normal; beyond a wall's ends the distance to its nearer end takes its place.
    """
    best, distance, orientation = np.inf, 0.0, 0.0
    for w in range(len(wall)):
        dx, dy, turn = x - wall[w, 0], y - wall[w, 1], yaw - wall_yaw[w]
        along, across = dx * wall[w, 2] + dy * wall[w, 3], dx * wall[w, 5] + dy * wall[w, 6]
        beyond = max(-along, along - wall[w, 4], 0.0)
        if beyond > 0.0:
            across = math.sqrt(across * across + beyond * beyond)
        gap = across - half_d * abs(math.cos(turn)) - half_w * abs(math.sin(turn))
        for k in range(first, last):
            off = abs(gap - mode[k, 0])
            angle = 0.0 if math.isnan(mode[k, 1]) else abs(wrap(turn - mode[k, 1]))
            cost = w_distance * off + w_orientation * angle
            if cost < best:
                best, distance, orientation = cost, off, angle
    return distance, orientation


@njit(cache=True)
def group_losses(pose, i, core, around, first, last, w_distance, w_orientation):  # type: ignore[no-untyped-def]
    """Return the distance and orientation losses of object ``i`` to the mode around its core that it fits best."""
    dx, dy, yaw = pose[i, 0] - pose[core, 0], pose[i, 1] - pose[core, 1], pose[core, 2]
    c, s = math.cos(yaw), math.sin(yaw)
    x, y, turn = dx * c + dy * s, dy * c - dx * s, pose[i, 2] - yaw
    best, distance, orientation = np.inf, 0.0, 0.0
    for k in range(first, last):
        off = math.sqrt((x - around[k, 0]) ** 2 + (y - around[k, 1]) ** 2)
        angle = 0.0 if math.isnan(around[k, 2]) else abs(wrap(turn - around[k, 2]))
        cost = w_distance * off + w_orientation * angle
        if cost < best:
            best, distance, orientation = cost, off, angle
    return distance, orientation


@njit(cache=True)
def in_slot(pose, owner, slot, k, x, y):  # type: ignore[no-untyped-def]
    """Return a world point in the frame of the middle of top ``k``, whose owner has its pose in ``pose``."""
    c, s = math.cos(pose[owner, 2]), math.sin(pose[owner, 2])
    dx, dy = x - pose[owner, 0], y - pose[owner, 1]
    return dx * c + dy * s - slot[k, 0], dy * c - dx * s - slot[k, 1]


@njit(cache=True)
def place_target(place, k, top_d, top_w, half_d, half_w):  # type: ignore[no-untyped-def]
    """Return x and y that placement ``k`` means on a top of these half extents for an object of those (NaN: anywhere)."""
    turn = 0.0 if math.isnan(place[k, 2]) else place[k, 2]
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    return place[k, 0] * max(top_d - half_d * c - half_w * s, 0.0), place[k, 1] * max(top_w - half_d * s - half_w * c, 0.0)


@njit(cache=True)
def support_losses(place, first, last, x, y, turn, top_d, top_w, half_d, half_w, w_position, w_orientation):  # type: ignore[no-untyped-def]
    """Return overhang, and the position and orientation losses to the placement that an object at x, y on a top fits best.

    The distances to two opposite edges change by the same amount, so the sum over four edges is twice that over the axes.
    """
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    overhang = max(abs(x) + half_d * c + half_w * s - top_d, 0.0) + max(abs(y) + half_d * s + half_w * c - top_w, 0.0)
    best, position, orientation = np.inf, 0.0, 0.0
    for k in range(first, last):
        mean_x, mean_y = place_target(place, k, top_d, top_w, half_d, half_w)
        off = 0.0 if math.isnan(mean_x) else 2.0 * abs(x - mean_x)
        off += 0.0 if math.isnan(mean_y) else 2.0 * abs(y - mean_y)
        angle = 0.0 if math.isnan(place[k, 2]) else abs(wrap(turn - place[k, 2]))
        cost = w_position * off + w_orientation * angle
        if cost < best:
            best, position, orientation = cost, off, angle
    return overhang, position, orientation


@njit(cache=True)
def total_overlap(solid, first_i, last_i, first_j, last_j):  # type: ignore[no-untyped-def]
    """Return the summed depth of the footprints of the solids of two objects, where their heights meet."""
    total = 0.0
    for a in range(first_i, last_i):
        for b in range(first_j, last_j):
            if min(solid[a, 3], solid[b, 3]) - max(solid[a, 2], solid[b, 2]) > _TOUCH_M:
                total += max(row_penetration(solid, a, solid, b), 0.0)
    return total


@njit(cache=True)
def zone_losses(zone, zone_kind, zone_depth, first, last, solid, first_j, last_j, mount_j, related):  # type: ignore[no-untyped-def]
    """Return occlusion and blocked depth: what one object's solids take from the zones ``first`` to ``last - 1`` of another."""
    occlusion, blocked = 0.0, 0.0
    for k in range(first, last):
        kind = zone_kind[k]
        if kind == ACCESS:
            blocks = mount_j == FLOOR and not related
        else:
            blocks = kind == SWING or mount_j == (FLOOR if kind == VIEW else WALL)
        if not blocks:
            continue
        deepest = 0.0
        for b in range(first_j, last_j):
            if min(zone[k, 3], solid[b, 3]) - max(zone[k, 2], solid[b, 2]) > _TOUCH_M:
                deepest = max(deepest, row_penetration(zone, k, solid, b))
        if kind == ACCESS:
            occlusion += min(deepest / zone_depth[k], 1.0)
        else:
            blocked += deepest
    return occlusion, blocked


@njit(cache=True)
def _unary_losses(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add what object ``i`` costs on its own or with walls, top and core."""
    mount, core, weight = problem.mount[i], problem.core[i], problem.weight
    if mount == FIXED:
        return
    x, y, yaw = state.pose[i, 0], state.pose[i, 1], state.pose[i, 2]
    half_d, half_w = problem.half[i, 0], problem.half[i, 1]
    if mount != OBJECT:
        out[OUT_OF_ROOM] += rectangle_outside(problem.wall, problem.reflex, x, y, math.cos(yaw), math.sin(yaw), half_d, half_w)
    zone = state.zone
    for k in range(problem.zone_first[i], problem.zone_first[i + 1]):
        if problem.zone_kind[k] == ACCESS:
            outside = rectangle_outside(
                problem.wall, problem.reflex, zone[k, 0], zone[k, 1], zone[k, 6], zone[k, 7], zone[k, 4], zone[k, 5]
            )
            out[OCCLUSION] += min(outside / problem.zone_depth[k], 1.0)
    first, last = problem.wall_mode_first[i], problem.wall_mode_first[i + 1]
    if last > first:
        distance, orientation = wall_losses(
            problem.wall, problem.wall_yaw, problem.wall_mode, first, last, x, y, yaw, half_d, half_w,
            weight[WALL_DISTANCE], weight[WALL_ORIENTATION],
        )  # fmt: skip
        out[WALL_DISTANCE] += distance
        out[WALL_ORIENTATION] += orientation
    if core >= 0 and state.active[core]:
        _add_group(problem, state, i, out)
    if mount == OBJECT:
        _add_support(problem, state, i, out)
    if problem.centre[i] > 0.0:
        out[ROOM_CENTRE] += math.hypot(x - problem.middle[0], y - problem.middle[1])


@njit(cache=True)
def _add_group(problem, state, i, out):  # type: ignore[no-untyped-def]
    first, last = problem.around_first[i], problem.around_first[i + 1]
    distance, orientation = group_losses(
        state.pose, i, problem.core[i], problem.around, first, last, problem.weight[GROUP_DISTANCE], problem.weight[GROUP_ORIENTATION]
    )
    out[GROUP_DISTANCE] += distance
    out[GROUP_ORIENTATION] += orientation


@njit(cache=True)
def _add_support(problem, state, i, out):  # type: ignore[no-untyped-def]
    k, slot, weight = state.slot[i], problem.slot, problem.weight
    owner = problem.slot_owner[k]
    x, y = in_slot(state.pose, owner, slot, k, state.pose[i, 0], state.pose[i, 1])
    turn = state.pose[i, 2] - state.pose[owner, 2]
    overhang, position, orientation = support_losses(
        problem.place, problem.place_first[i], problem.place_first[i + 1], x, y, turn, slot[k, 3], slot[k, 4],
        problem.half[i, 0], problem.half[i, 1], weight[SUPPORT_POSITION], weight[SUPPORT_ORIENTATION],
    )  # fmt: skip
    out[OVERHANG] += overhang
    out[SUPPORT_POSITION] += position
    out[SUPPORT_ORIENTATION] += orientation
    for c in range(problem.candidate_first[i], problem.candidate_first[i + 1]):
        if problem.candidate[c] == k:
            out[SUPPORT_ADDRESS] += problem.candidate_cost[c]


@njit(cache=True)
def local_energy(problem, state, members, count, marked, out):  # type: ignore[no-untyped-def]
    """Write to ``out`` the losses of all cliques that contain one of the first ``count`` ``members``, which are ``marked`` and active."""
    pose, active, solid, zone = state.pose, state.active, state.solid, state.zone
    radius, core, mount, box_first, zone_first = problem.radius, problem.core, problem.mount, problem.box_first, problem.zone_first
    zone_kind, zone_depth = problem.zone_kind, problem.zone_depth
    out[:] = 0.0
    for m in range(count):
        i = members[m]
        _unary_losses(problem, state, i, out)
        for j in range(len(mount)):
            if not active[j] or j == i or (marked[j] and j < i):
                continue
            if core[j] == i and not marked[j]:
                _add_group(problem, state, j, out)
            dx, dy = pose[i, 0] - pose[j, 0], pose[i, 1] - pose[j, 1]
            squared = dx * dx + dy * dy
            if squared > (radius[i, 1] + radius[j, 1]) ** 2:
                continue
            if squared < (radius[i, 0] + radius[j, 0]) ** 2:
                out[OVERLAP] += total_overlap(solid, box_first[i], box_first[i + 1], box_first[j], box_first[j + 1])
            related = core[i] == j or core[j] == i or (core[i] >= 0 and core[i] == core[j])
            for owner, other in ((i, j), (j, i)):
                first, last = zone_first[owner], zone_first[owner + 1]
                if last > first and squared < (radius[owner, 1] + radius[other, 0]) ** 2:
                    occlusion, blocked = zone_losses(
                        zone, zone_kind, zone_depth, first, last, solid, box_first[other], box_first[other + 1], mount[other], related
                    )
                    out[OCCLUSION] += occlusion
                    out[BLOCKED] += blocked


@njit(cache=True)
def full_energy(problem: Problem, state: State) -> Floats:
    """Return the (t,) unweighted losses of the whole layout, active objects only."""
    marked = state.active.copy()
    members = np.flatnonzero(marked)
    out = np.zeros(len(problem.weight))
    local_energy(problem, state, members, len(members), marked, out)
    return out
