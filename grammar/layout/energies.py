"""The energy of a layout: the weighted sum of the losses of its cliques, whole or the part that a move changes.

``E = sum of weight * loss`` over the terms of :data:`grammar.spec.energy_terms.ENERGY_TERMS`, the Gibbs prior's exponent (Jiang et al.,
IJCV 2018, section 2.2):

- wall: ``|distance - mean|`` and ``|yaw - mean|``, each over the mode's spread, to the wall that an object fits best, of all walls and all
  of its modes
- occlusion: ``max(0, 1 - d / d_acc)`` of the access space before an object, d_acc deep, that another object or a wall leaves only d deep;
  what belongs to the object does not count, as chairs at a desk
- support: the sum over a support surface's four edges of ``|distance - mean|``, ``|yaw - mean|``, and -log of the address's probability
- group: the same as for walls, in the frame of the core object
- screen_aside: how far a screen and the seat that it is watched from look past each other
- overlap, out_of_room, blocked (zones of doors, windows and pictures), overhang, off_wall (backs of shelves, wardrobes, beds and the
  like, a side of baths and showers): metres, zero in a valid room
- run_order: the wishes of a run's units that their order does not meet
- relation_odds: for the mode taken in each wall, support and group relation, what it is less dense than the object's densest mode there
- circulation, reach: see :mod:`grammar.layout.circulation`, which adds them where they have a weight

A relation with modes of probability p_k, spreads s_k and d dimensions is the mixture of the densities ``p_k s_k^-d exp(-beta w l / s_k)``,
each place given to the mode that is densest there.  The odds are part of the prior, so their cost is divided by the inverse temperature
beta, which does not temper them: modes that the room leaves free alike, and that lie further apart than they are wide, are taken by their
probabilities.

An energy vector holds the unweighted losses.  The part of it that changes when some objects move is the sum over the cliques that contain
one of them; cliques among objects that move rigidly together keep their losses and are left out.
"""

from __future__ import annotations

import numpy as np

from grammar.geometry.arrays import Floats
from grammar.geometry.kernels import entry, inlined, kernel
from grammar.layout import columns as col
from grammar.layout.frames import surface_owner
from grammar.layout.losses import (
    add_above_slopes,
    add_group,
    add_occlusion_by_walls,
    add_off_wall,
    add_out_of_room,
    add_overlap,
    add_room_centre,
    add_support,
    add_view,
    add_wall,
    add_zones,
)
from grammar.layout.problem import Problem, State
from grammar.layout.runs import add_run_order, is_head


@kernel
def _add_unary(problem, state, i, moved, out):  # type: ignore[no-untyped-def]
    """Add what object ``i`` costs on its own or with walls, and with the support and the core that do not move along with it."""
    link, mount, core = problem.link, problem.link[i, col.MOUNT], problem.link[i, col.CORE]
    if mount == col.FIXED:
        return
    if mount != col.OBJECT:
        add_out_of_room(problem, state, i, out)
    if len(problem.slope):
        add_above_slopes(problem, state, i, out)
    add_occlusion_by_walls(problem, state, i, out)
    if link[i, col.AROUND_MODES] > link[i, col.WALL_MODES]:
        add_wall(problem, state, i, out)
    if min(problem.object[i, col.BACK_GAP], problem.object[i, col.SIDE_GAP]) < np.inf:
        add_off_wall(problem, state, i, out)
    if core >= 0 and state.hold[core, col.ACTIVE] and moved[core] != moved[i]:
        add_group(problem, state, i, out)
    if mount == col.OBJECT and moved[surface_owner(problem, state.hold[i, col.SURFACE])] != moved[i]:
        add_support(problem, state, i, out)
    watcher = link[i, col.WATCHED]
    if watcher >= 0 and state.hold[watcher, col.ACTIVE] and moved[watcher] != moved[i]:
        add_view(problem, state, i, out)
    if problem.object[i, col.CENTRED] > 0.0:
        add_room_centre(problem, state, i, out)
    if is_head(problem, i):
        add_run_order(problem, state, link[i, col.RUN], out)


@inlined
def _add_pair(problem, state, i, j, squared, out):  # type: ignore[no-untyped-def]
    """Add overlap, occlusion and blocked depth of two objects; ``squared``: distance of their origins."""
    link, item = problem.link, problem.object
    if squared < (item[i, col.INNER_RADIUS] + item[j, col.INNER_RADIUS]) ** 2:
        add_overlap(problem, state, i, j, out)
    for turn in range(2):
        owner, other = (i, j) if turn == 0 else (j, i)
        reach = item[owner, col.OUTER_RADIUS] + item[other, col.INNER_RADIUS]
        if link[owner, col.STRIPS] > link[owner, col.ZONES] and squared < reach * reach:
            add_zones(problem, state, owner, other, out)


@kernel
def weighted(problem, energy):  # type: ignore[no-untyped-def]
    """Return the weighted sum of an energy vector."""
    total = 0.0
    for term in range(len(energy)):
        total += problem.weight[term] * energy[term]
    return total


@entry
def local_energy(problem, state, members, count, moved, limit, out):  # type: ignore[no-untyped-def]
    """Write to ``out`` the losses of the cliques that change when the first ``count`` ``members`` move; return their weighted sum.

    ``moved[i]`` is 0 for what stays and equal for objects that move rigidly together.  All losses grow from zero, so once the sum exceeds
    ``limit`` the rest is left out.
    """
    where, link, item = state.where, problem.link, problem.object
    for term in range(len(out)):
        out[term] = 0.0
    total = 0.0
    for m in range(count):
        # Add what the member costs with walls, its support and its core.
        i = members[m]
        _add_unary(problem, state, i, moved, out)
        total = weighted(problem, out)
        if total > limit:
            return total
        # Add its cliques with every other object; those with members of lower index were added with these.
        for j in range(len(link)):
            if not state.hold[j, col.ACTIVE] or moved[j] == moved[i] or (moved[j] > 0 and j < i):
                continue
            if link[j, col.CORE] == i and moved[j] == 0:
                add_group(problem, state, j, out)
            if link[j, col.WATCHED] == i and moved[j] == 0:
                add_view(problem, state, j, out)
            # Circles about the origins tell which objects cannot meet.
            dx, dy = where[i, col.X] - where[j, col.X], where[i, col.Y] - where[j, col.Y]
            squared = dx * dx + dy * dy
            if squared > (item[i, col.OUTER_RADIUS] + item[j, col.OUTER_RADIUS]) ** 2:
                continue
            _add_pair(problem, state, i, j, squared, out)
            total = weighted(problem, out)
            if total > limit:
                return total
    return weighted(problem, out)


def full_energy(problem: Problem, state: State) -> Floats:
    """Return the (t,) unweighted losses of the whole layout, active objects only; without circulation and reach."""
    members = np.flatnonzero(state.active)
    moved, out = np.zeros(len(problem.link), np.int64), np.zeros(len(problem.weight))
    moved[members] = members + 1
    local_energy(problem, state, members, len(members), moved, np.inf, out)
    return out
