"""Losses of a layout: the cliques of walls, furniture, support and groups, and the measures of what no valid room has.

``E = sum of weight * loss`` over the terms of :data:`grammar.spec.rules.TERMS`, the Gibbs prior's exponent (Jiang et al., IJCV 2018,
section 2.2):

- wall: ``|distance - mean|`` and ``|yaw - mean|``, each over the mode's spread, to the wall that an object fits best, of all walls and all
  of its modes
- occlusion: ``max(0, 1 - d / d_acc)`` of the space before an object, d_acc deep, that another object or a wall leaves only d deep; objects
  of one group do not count for each other
- support: the sum over a top's four edges of ``|distance - mean|``, ``|yaw - mean|``, and -log of the address's probability
- group: the same as for walls, in the frame of the core object
- overlap, out_of_room, blocked (zones of doors, windows and pictures), overhang: depths in metres, zero in a valid room
- relation_odds: for the mode taken in each wall, support and group relation, what it is less dense than the object's densest mode there
- circulation, reach: see :mod:`grammar.layout.circulation`, which adds them where they have a weight

A relation with modes of probability p_k, spreads s_k and d dimensions is the mixture of the densities ``p_k s_k^-d exp(-beta w l / s_k)``,
each place given to the mode that is densest there.  The odds are part of the prior, so their cost is divided by beta, which does not
temper them: modes that the room leaves free alike, and that lie further apart than they are wide, are taken by their probabilities.

An energy vector holds the unweighted losses.  The part of it that changes when some objects move is the sum over the cliques that contain
one of them; cliques among objects that move rigidly together keep their losses and are left out.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grammar.geometry.arrays import Floats
from grammar.geometry.boxes import place_boxes, row_penetration
from grammar.geometry.kernels import INNER, LEAN
from grammar.geometry.walls import rectangle_outside
from grammar.geometry.zones import ACCESS, SWING, VIEW
from grammar.layout.problem import (
    ACTIVE,
    AROUND,
    BOUNDS,
    BOX,
    BOX_END,
    CANDIDATE,
    CENTRE,
    CORE,
    COST,
    FIXED,
    FLOOR,
    HALF_DEPTH,
    HALF_WIDTH,
    INNER_RADIUS,
    MIDDLE,
    MODE_END,
    MOUNT,
    NEAR,
    OBJECT,
    OUTER_RADIUS,
    PLACE,
    REACH,
    SLOT,
    SLOT_HALF_DEPTH,
    SLOT_HALF_WIDTH,
    SLOT_OWNER,
    STRAIGHT,
    WALL,
    WALL_MODE,
    ZONE,
    Problem,
    State,
)
from grammar.spec.rules import TERMS

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
    RELATION_ODDS,
    CIRCULATION,
    REACHED,
) = range(len(TERMS))

_TOUCH_M = 1e-6


@njit(**INNER)
def wrap(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit(**LEAN)
def place_object(problem, state, i):  # type: ignore[no-untyped-def]
    """Write the world boxes of object ``i`` after its pose changed."""
    where, link = state.where, problem.link
    place_boxes(problem.box, link[i, BOX], link[i, BOX_END], where[i, 0], where[i, 1], where[i, 3], where[i, 2], state.placed)


@njit(**INNER)
def _angle(turn, mean):  # type: ignore[no-untyped-def]
    return 0.0 if math.isnan(mean) else abs(wrap(turn - mean))


@njit(**INNER)
def _add_wall(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add the losses of object ``i`` to the wall and mode that it fits best.

    The gap is that between wall and footprint along the wall's normal; beyond a wall's ends the distance to its nearer end takes its place.
    """
    wall, mode, first, last = problem.wall, problem.mode, problem.link[i, WALL_MODE], problem.link[i, AROUND]
    x, y, yaw = state.where[i, 0], state.where[i, 1], state.where[i, 2]
    half_d, half_w, c, s = problem.object[i, HALF_DEPTH], problem.object[i, HALF_WIDTH], math.cos(yaw), math.sin(yaw)
    w_distance, w_orientation, w_odds = problem.number[WALL_DISTANCE], problem.number[WALL_ORIENTATION], problem.number[RELATION_ODDS]
    best, distance, orientation, odds = np.inf, 0.0, 0.0, 0.0
    for w in range(len(wall)):
        dx, dy, nx, ny = x - wall[w, 0], y - wall[w, 1], wall[w, 5], wall[w, 6]
        along, across = dx * wall[w, 2] + dy * wall[w, 3], dx * nx + dy * ny
        beyond = max(-along, along - wall[w, 4], 0.0)
        if beyond > 0.0:
            across = math.sqrt(across * across + beyond * beyond)
        gap = across - half_d * abs(c * nx + s * ny) - half_w * abs(s * nx - c * ny)
        for k in range(first, last):
            off = abs(gap - mode[k, 0]) * mode[k, NEAR]
            cost = w_distance * off + w_odds * mode[k, COST]
            if cost < best:
                angle = _angle(yaw - wall[w, 7], mode[k, 1]) * mode[k, STRAIGHT]
                cost += w_orientation * angle
                if cost < best:
                    best, distance, orientation, odds = cost, off, angle, mode[k, COST]
    out[WALL_DISTANCE] += distance
    out[WALL_ORIENTATION] += orientation
    out[RELATION_ODDS] += odds


@njit(**INNER)
def _add_group(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add the losses of object ``i`` to the mode around its core that it fits best."""
    where, mode, core = state.where, problem.mode, problem.link[i, CORE]
    dx, dy, yaw = where[i, 0] - where[core, 0], where[i, 1] - where[core, 1], where[core, 2]
    c, s = math.cos(yaw), math.sin(yaw)
    x, y, turn = dx * c + dy * s, dy * c - dx * s, where[i, 2] - yaw
    w_distance, w_orientation, w_odds = problem.number[GROUP_DISTANCE], problem.number[GROUP_ORIENTATION], problem.number[RELATION_ODDS]
    best, distance, orientation, odds = np.inf, 0.0, 0.0, 0.0
    for k in range(problem.link[i, AROUND], problem.link[i, PLACE]):
        off = math.sqrt((x - mode[k, 0]) ** 2 + (y - mode[k, 1]) ** 2) * mode[k, NEAR]
        angle = _angle(turn, mode[k, 2]) * mode[k, STRAIGHT]
        cost = w_distance * off + w_orientation * angle + w_odds * mode[k, COST]
        if cost < best:
            best, distance, orientation, odds = cost, off, angle, mode[k, COST]
    out[GROUP_DISTANCE] += distance
    out[GROUP_ORIENTATION] += orientation
    out[RELATION_ODDS] += odds


@njit(**INNER)
def in_slot(problem, state, k, x, y):  # type: ignore[no-untyped-def]
    """Return a world point in the frame of the middle of top ``k``."""
    slot, owner = problem.slot, int(problem.slot[k, SLOT_OWNER])
    where = state.where
    c, s = math.cos(where[owner, 2]), math.sin(where[owner, 2])
    dx, dy = x - where[owner, 0], y - where[owner, 1]
    return dx * c + dy * s - slot[k, 0], dy * c - dx * s - slot[k, 1]


@njit(**INNER)
def place_target(problem, i, k, slot):  # type: ignore[no-untyped-def]
    """Return x and y that placement ``k`` of object ``i`` means on a top (NaN: anywhere)."""
    mode, half_d, half_w = problem.mode, problem.object[i, HALF_DEPTH], problem.object[i, HALF_WIDTH]
    c, s = 1.0, 0.0
    if not math.isnan(mode[k, 2]):
        c, s = abs(math.cos(mode[k, 2])), abs(math.sin(mode[k, 2]))
    x = mode[k, 0] * max(problem.slot[slot, SLOT_HALF_DEPTH] - half_d * c - half_w * s, 0.0)
    return x, mode[k, 1] * max(problem.slot[slot, SLOT_HALF_WIDTH] - half_d * s - half_w * c, 0.0)


@njit(**INNER)
def _add_support(problem, state, i, out):  # type: ignore[no-untyped-def]
    """Add overhang, address, and the losses to the placement that object ``i`` fits best on its top.

    The distances to two opposite edges change by the same amount, so the sum over four edges is twice that over the axes.
    """
    link, mode, k = problem.link, problem.mode, state.hold[i, SLOT]
    x, y = in_slot(problem, state, k, state.where[i, 0], state.where[i, 1])
    turn = state.where[i, 2] - state.where[int(problem.slot[k, SLOT_OWNER]), 2]
    half_d, half_w, c, s = problem.object[i, HALF_DEPTH], problem.object[i, HALF_WIDTH], abs(math.cos(turn)), abs(math.sin(turn))
    out[OVERHANG] += max(abs(x) + half_d * c + half_w * s - problem.slot[k, SLOT_HALF_DEPTH], 0.0)
    out[OVERHANG] += max(abs(y) + half_d * s + half_w * c - problem.slot[k, SLOT_HALF_WIDTH], 0.0)
    best, position, orientation, odds = np.inf, 0.0, 0.0, 0.0
    for m in range(link[i, PLACE], link[i, CANDIDATE]):
        mean_x, mean_y = place_target(problem, i, m, k)
        off = 0.0 if math.isnan(mean_x) else 2.0 * abs(x - mean_x)
        off += 0.0 if math.isnan(mean_y) else 2.0 * abs(y - mean_y)
        off, angle = off * mode[m, NEAR], _angle(turn, mode[m, 2]) * mode[m, STRAIGHT]
        cost = problem.number[SUPPORT_POSITION] * off + problem.number[SUPPORT_ORIENTATION] * angle
        cost += problem.number[RELATION_ODDS] * mode[m, COST]
        if cost < best:
            best, position, orientation, odds = cost, off, angle, mode[m, COST]
    out[SUPPORT_POSITION] += position
    out[SUPPORT_ORIENTATION] += orientation
    out[RELATION_ODDS] += odds
    for m in range(link[i, CANDIDATE], link[i, MODE_END]):
        if int(mode[m, 0]) == k:
            out[SUPPORT_ADDRESS] += mode[m, 1]


@njit(**INNER)
def _add_overlap(problem, state, i, j, out):  # type: ignore[no-untyped-def]
    """Add the summed depth of the footprints of the solids of two objects, where their heights meet."""
    link, placed = problem.link, state.placed
    for a in range(link[i, BOX], link[i, ZONE]):
        for b in range(link[j, BOX], link[j, ZONE]):
            if min(placed[a, 3], placed[b, 3]) - max(placed[a, 2], placed[b, 2]) > _TOUCH_M:
                out[OVERLAP] += max(row_penetration(placed, a, placed, b), 0.0)


@njit(**INNER)
def _add_zones(problem, state, i, j, related, out):  # type: ignore[no-untyped-def]
    """Add occlusion and blocked depth: what the solids of object ``j`` take from the zones of object ``i``."""
    link, placed, mount = problem.link, state.placed, problem.link[j, MOUNT]
    for k in range(link[i, ZONE], link[i, REACH]):
        kind = int(problem.box[k, 6])
        if kind == ACCESS:
            blocks = mount == FLOOR and not related
        else:
            blocks = kind == SWING or mount == (FLOOR if kind == VIEW else WALL)
        if not blocks:
            continue
        deepest = 0.0
        for b in range(link[j, BOX], link[j, ZONE]):
            if min(placed[k, 3], placed[b, 3]) - max(placed[k, 2], placed[b, 2]) > _TOUCH_M:
                deepest = max(deepest, row_penetration(placed, k, placed, b))
        if kind == ACCESS:
            out[OCCLUSION] += min(deepest / problem.box[k, 7], 1.0)
        else:
            out[BLOCKED] += deepest


@njit(**INNER)
def _add_unary(problem, state, i, moved, out):  # type: ignore[no-untyped-def]
    """Add what object ``i`` costs on its own or with walls, and with the top and the core that do not move along with it."""
    link, placed = problem.link, state.placed
    mount, core = link[i, MOUNT], link[i, CORE]
    if mount == FIXED:
        return
    x, y, yaw = state.where[i, 0], state.where[i, 1], state.where[i, 2]
    if mount != OBJECT:
        half_d, half_w = problem.object[i, HALF_DEPTH], problem.object[i, HALF_WIDTH]
        out[OUT_OF_ROOM] += rectangle_outside(problem.wall, x, y, math.cos(yaw), math.sin(yaw), half_d, half_w)
    for k in range(link[i, ZONE], link[i, REACH]):
        if problem.box[k, 6] == ACCESS:
            outside = rectangle_outside(
                problem.wall, placed[k, 0], placed[k, 1], placed[k, 6], placed[k, 7], placed[k, 4], placed[k, 5]
            )  # fmt: skip
            out[OCCLUSION] += min(outside / problem.box[k, 7], 1.0)
    if link[i, AROUND] > link[i, WALL_MODE]:
        _add_wall(problem, state, i, out)
    if core >= 0 and state.hold[core, ACTIVE] and moved[core] != moved[i]:
        _add_group(problem, state, i, out)
    if mount == OBJECT and moved[int(problem.slot[state.hold[i, SLOT], SLOT_OWNER])] != moved[i]:
        _add_support(problem, state, i, out)
    if problem.object[i, CENTRE] > 0.0:
        out[ROOM_CENTRE] += math.hypot(x - problem.number[MIDDLE], y - problem.number[MIDDLE + 1])


@njit(**INNER)
def weighted(problem, energy):  # type: ignore[no-untyped-def]
    """Return the weighted sum of an energy vector."""
    total = 0.0
    for term in range(len(energy)):
        total += problem.number[term] * energy[term]
    return total


@njit(**LEAN)
def local_energy(problem, state, members, count, moved, limit, out):  # type: ignore[no-untyped-def]
    """Write to ``out`` the losses of the cliques that change when the first ``count`` ``members`` move; return their weighted sum.

    ``moved[i]`` is 0 for what stays and equal for objects that move rigidly together.  All losses grow from zero, so once the sum exceeds
    ``limit`` the rest is left out.
    """
    where, link, thing = state.where, problem.link, problem.object
    for term in range(len(out)):
        out[term] = 0.0
    total = 0.0
    for m in range(count):
        i = members[m]
        _add_unary(problem, state, i, moved, out)
        total = weighted(problem, out)
        if total > limit:
            return total
        for j in range(len(link)):
            if not state.hold[j, ACTIVE] or moved[j] == moved[i] or (moved[j] > 0 and j < i):
                continue
            if link[j, CORE] == i and moved[j] == 0:
                _add_group(problem, state, j, out)
            dx, dy = where[i, 0] - where[j, 0], where[i, 1] - where[j, 1]
            squared = dx * dx + dy * dy
            if squared > (thing[i, OUTER_RADIUS] + thing[j, OUTER_RADIUS]) ** 2:
                continue
            if squared < (thing[i, INNER_RADIUS] + thing[j, INNER_RADIUS]) ** 2:
                _add_overlap(problem, state, i, j, out)
            related = link[i, CORE] == j or link[j, CORE] == i or (link[i, CORE] >= 0 and link[i, CORE] == link[j, CORE])
            for turn in range(2):
                owner, other = (i, j) if turn == 0 else (j, i)
                reach = thing[owner, OUTER_RADIUS] + thing[other, INNER_RADIUS]
                if link[owner, REACH] > link[owner, ZONE] and squared < reach * reach:
                    _add_zones(problem, state, owner, other, related, out)
            total = weighted(problem, out)
            if total > limit:
                return total
    return weighted(problem, out)


def full_energy(problem: Problem, state: State) -> Floats:
    """Return the (t,) unweighted losses of the whole layout, active objects only; without circulation and reach."""
    members = np.flatnonzero(state.active)
    moved, out = np.zeros(len(problem.link), np.int64), np.zeros(BOUNDS)
    moved[members] = members + 1
    local_energy(problem, state, members, len(members), moved, np.inf, out)
    return out
