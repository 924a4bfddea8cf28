"""The Metropolis-Hastings chain over layouts: one compiled loop, each proposal judged by the cliques that it touches.

A proposal is accepted with probability ``min(1, exp(beta (E_old - E_new)) q(old | new) / q(new | old))`` (Jiang et al., IJCV 2018, section
3.2).  What stands on a moved object moves along rigidly, and, when the draw says so, what is grouped around it too; a rigid motion
keeps volume, so it adds nothing to the ratio.  The uniform number that decides is drawn first: it bounds the energy that would still be
accepted, and all losses are sums from zero, so most proposals are turned down after a few cliques, and the costly losses (circulation) are
only computed for proposals that pass all others.  The decision is the same as with the whole energy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.kernels import INNER
from grammar.layout.circulation import Traffic, changes_floor, furnish, measure, traffic_of, walk, walk_on
from grammar.layout.energies import CIRCULATION, REACHED, full_energy, local_energy, place_object, weighted, wrap
from grammar.layout.floor_raster import NO_FLOOR, SIDE, Floor
from grammar.layout.moves import RELOCATE, propose
from grammar.layout.problem import (
    ACTIVE,
    BOUNDS,
    BOX,
    BOX_END,
    CANDIDATE,
    CORE,
    FLOOR,
    HALF_DEPTH,
    HALF_WIDTH,
    LEADS,
    MOUNT,
    OBJECT,
    ON_WALL,
    SLOT,
    SLOT_OWNER,
    WALL,
    Problem,
    State,
)
from grammar.layout.proposal import (
    CARRY,
    LEADER,
    NEW_SLOT,
    NEW_WALL,
    MoveSettings,
    Proposal,
    along_wall,
    empty_proposal,
    pick,
    wall_of_core,
)
from grammar.spec.rules import HARD_TERMS, MOVES


class Goal(NamedTuple):
    """How a chain runs and what it keeps.

    Tidiness grows geometrically from ``beta_first`` to ``beta_last``; a layout is feasible when none of its hard losses exceeds
    ``tolerance``, nor circulation and reach if the chain has a floor; ``keep_best``: of the feasible layouts the one of least energy is
    kept, else the last one.
    """

    beta_first: float
    beta_last: float
    tolerance: float
    keep_best: bool


class Work(NamedTuple):
    """Work space of a chain.

    who: (2, n) what moves, and which leader (0, 1) each of these follows; moved: (n,) 0, or a mark that what moves rigidly together
    shares; where, hold,
    placed: what the state held before a proposal, by object and box; energy: (3, t) losses of the layout, of the moved cliques before and
    after; proposal; traffic.
    """

    who: Ints
    moved: Ints
    where: Floats
    hold: Ints
    placed: Floats
    energy: Floats
    proposal: Proposal
    traffic: Traffic


class ChainRun(NamedTuple):
    """What a chain leaves: whether a feasible layout was kept, and the (t,) losses of its last state as the steps added them up."""

    found: bool
    energy: Floats


HISTORY = BOUNDS + 2 * len(MOVES)
"""Columns of a chain's history."""

NO_HISTORY = np.zeros((0, HISTORY))
_HUNG = 3
"""What moves with leader k is marked k + 1; what follows its core from wall to wall, and what stands on it, this plus its own index."""


def _work(problem: Problem, floor: Floor) -> Work:
    n = len(problem.link)
    return Work(
        who=np.zeros((2, n), np.int64),
        moved=np.zeros(n, np.int64),
        where=np.zeros((n, 4)),
        hold=np.zeros((n, 3), np.int64),
        placed=np.zeros((len(problem.box), 8)),
        energy=np.zeros((3, BOUNDS)),
        proposal=empty_proposal(),
        traffic=traffic_of(problem, floor),
    )


def enter(rng: np.random.Generator, problem: Problem, state: State, settings: MoveSettings, i: int, starts: int) -> bool:
    """Bring object ``i`` in at the best of ``starts`` poses drawn from the relocation's mixture; return whether any was possible."""
    return bool(_enter(rng, problem, state, settings, int(i), starts, _work(problem, NO_FLOOR)))


def run_chain(
    rng: np.random.Generator,
    problem: Problem,
    state: State,
    settings: MoveSettings,
    goal: Goal,
    movable: Ints,
    proposals: int,
    kept: State,
    counts: Ints,
    floor: Floor = NO_FLOOR,
    history: Floats = NO_HISTORY,
) -> ChainRun:
    """Run the chain and keep a feasible layout.

    Args:
        rng: advanced.
        problem: the layout problem.
        state: written in place.
        settings: of the moves.
        goal: tidiness and what to keep.
        movable: (k,) int64 indices of the objects that lead moves.
        proposals: how many.
        kept: state that receives a feasible layout (not the boxes that follow from its poses).
        counts: (6, 2) int64, proposals and acceptances by move are added.
        floor: of the unfurnished room, left as it was; with it circulation and reach are part of the energy.
        history: (r, t + 12) receives after r evenly spaced proposals, the last one among them, the losses, and ``counts`` by column.
    """
    work = _work(problem, floor)
    work.energy[0] = full_energy(problem, state)
    found = _run(rng, problem, state, settings, goal, movable, proposals, kept, counts, floor, history, work)
    return ChainRun(bool(found), work.energy[0])


@njit(**INNER)
def _release(count, work):  # type: ignore[no-untyped-def]
    """Mark the gathered objects as staying."""
    for m in range(count):
        work.moved[work.who[0, m]] = 0


@njit(**INNER)
def _gather(problem, state, i, leader, carry, count, work):  # type: ignore[no-untyped-def]
    """Append object ``i`` and everything that moves along with it; return the new count, or -1 if two leaders meet."""
    link, who, moved, first = problem.link, work.who, work.moved, count
    if moved[i] > 0:
        _release(count, work)
        return -1
    who[0, count], who[1, count], moved[i] = i, leader, leader + 1
    count += 1
    while first < count:
        owner = who[0, first]
        first += 1
        if link[owner, LEADS] == 0:
            continue
        for j in range(len(link)):
            if not state.hold[j, ACTIVE]:
                continue
            stands = link[j, MOUNT] == OBJECT and int(problem.slot[state.hold[j, SLOT], SLOT_OWNER]) == owner
            hangs = link[j, MOUNT] == WALL and link[j, CORE] == owner and link[owner, MOUNT] == FLOOR
            if stands or hangs or (carry and link[j, MOUNT] == FLOOR and link[j, CORE] == owner):
                if moved[j] > 0:
                    _release(count, work)
                    return -1
                who[0, count], who[1, count], moved[j] = j, leader, _HUNG + j if hangs else moved[owner]
                count += 1
    return count


@njit(**INNER)
def _hang_again(problem, state, i, work):  # type: ignore[no-untyped-def]
    """Move what hangs above a core that stands to the wall at the core's new back, as far along it from the core as before.

    Which wall that is depends on the core's pose alone, so the way back leads to the old place, and lengths along walls are kept.
    """
    where, wall, core = state.where, problem.wall, problem.link[i, CORE]
    old, new = state.hold[i, ON_WALL], wall_of_core(problem, state, core)
    along = along_wall(wall, old, where[i, 0], where[i, 1]) - along_wall(wall, old, work.where[core, 0], work.where[core, 1])
    along += along_wall(wall, new, where[core, 0], where[core, 1])
    half = problem.object[i, HALF_DEPTH]
    where[i, 0] = wall[new, 0] + wall[new, 2] * along + wall[new, 5] * half
    where[i, 1] = wall[new, 1] + wall[new, 3] * along + wall[new, 6] * half
    where[i, 2], state.hold[i, ON_WALL] = wall[new, 7], new


@njit(**INNER)
def _apply(problem, state, count, work):  # type: ignore[no-untyped-def]
    """Write the leaders' new poses and move their followers rigidly; what was there before goes to ``work``."""
    where, hold, proposal = state.where, state.hold, work.proposal
    for m in range(count):
        i, place = work.who[0, m], work.who[1, m]
        leader = proposal.tag[place, LEADER]
        for k in range(4):
            work.where[i, k] = where[i, k]
        work.hold[i, SLOT], work.hold[i, ON_WALL] = hold[i, SLOT], hold[i, ON_WALL]
        for b in range(problem.link[i, BOX], problem.link[i, BOX_END]):
            for k in range(8):
                work.placed[b, k] = state.placed[b, k]
        if leader == i:
            for k in range(3):
                where[i, k] = proposal.pose[place, k]
            hold[i, SLOT], hold[i, ON_WALL] = proposal.tag[place, NEW_SLOT], proposal.tag[place, NEW_WALL]
            if problem.link[i, MOUNT] == OBJECT:
                slot = hold[i, SLOT]
                where[i, 3] = where[int(problem.slot[slot, SLOT_OWNER]), 3] + problem.slot[slot, 2]
        elif work.moved[i] == _HUNG + i:
            _hang_again(problem, state, i, work)
        else:
            head = leader if work.moved[i] < _HUNG else work.moved[i] - _HUNG
            turn = where[head, 2] - work.where[head, 2]
            c, s = math.cos(turn), math.sin(turn)
            dx, dy = where[i, 0] - work.where[head, 0], where[i, 1] - work.where[head, 1]
            where[i, 0], where[i, 1] = where[head, 0] + dx * c - dy * s, where[head, 1] + dx * s + dy * c
            where[i, 2] = wrap(where[i, 2] + turn)
            where[i, 3] += where[head, 3] - work.where[head, 3]
        place_object(problem, state, i)


@njit(**INNER)
def _restore(problem, state, count, work):  # type: ignore[no-untyped-def]
    """Undo :func:`_apply`."""
    for m in range(count):
        i = work.who[0, m]
        for k in range(4):
            state.where[i, k] = work.where[i, k]
        state.hold[i, SLOT], state.hold[i, ON_WALL] = work.hold[i, SLOT], work.hold[i, ON_WALL]
        for b in range(problem.link[i, BOX], problem.link[i, BOX_END]):
            for k in range(8):
                state.placed[b, k] = work.placed[b, k]


@njit(**INNER)
def _keep(state, kept, count, work):  # type: ignore[no-untyped-def]
    """Copy a layout as it was before the proposal of ``count`` objects (0: as it is)."""
    for i in range(len(state.where)):
        for k in range(4):
            kept.where[i, k] = state.where[i, k]
        for k in range(3):
            kept.hold[i, k] = state.hold[i, k]
    for m in range(count):
        i = work.who[0, m]
        for k in range(4):
            kept.where[i, k] = work.where[i, k]
        kept.hold[i, SLOT], kept.hold[i, ON_WALL] = work.hold[i, SLOT], work.hold[i, ON_WALL]


@njit(cache=True, error_model="numpy")
def _enter(rng, problem, state, settings, i, starts, work):  # type: ignore[no-untyped-def]
    """Put object ``i`` at the best of ``starts`` poses; the best one so far is kept in the proposal's second place."""
    proposal, members, energy = work.proposal, work.who[0], work.energy[2]
    best = np.inf
    members[0], work.who[1, 0], work.moved[i], state.hold[i, ACTIVE] = i, 0, 1, 1
    if problem.link[i, MOUNT] == OBJECT:
        state.hold[i, SLOT] = int(problem.mode[problem.link[i, CANDIDATE], 0])
    if problem.link[i, MOUNT] == WALL:
        state.hold[i, ON_WALL] = 0
    for _ in range(starts):
        if propose(rng, problem, state, settings, np.int64(RELOCATE), i, members, proposal)[0] == 0:
            continue
        _apply(problem, state, np.int64(1), work)
        total = local_energy(problem, state, members, np.int64(1), work.moved, best, energy)
        if total < best:
            best = total
            for k in range(3):
                proposal.pose[1, k], proposal.tag[1, k] = proposal.pose[0, k], proposal.tag[0, k]
    work.moved[i] = 0
    if best == np.inf:
        state.hold[i, ACTIVE] = 0
        return False
    for k in range(3):
        proposal.pose[0, k], proposal.tag[0, k] = proposal.pose[1, k], proposal.tag[1, k]
    _apply(problem, state, np.int64(1), work)
    return True


@njit(**INNER)
def _followers_in_room(problem, state, count, work):  # type: ignore[no-untyped-def]
    """Return whether what was carried along is still in the space of poses: the room's bounding box, or a wall's length."""
    number = problem.number
    for m in range(count):
        i = work.who[0, m]
        if problem.link[i, MOUNT] == FLOOR:
            x, y = state.where[i, 0], state.where[i, 1]
            if not (number[BOUNDS] <= x <= number[BOUNDS + 2] and number[BOUNDS + 1] <= y <= number[BOUNDS + 3]):
                return False
        elif problem.link[i, MOUNT] == WALL:
            w, half = state.hold[i, ON_WALL], problem.object[i, HALF_WIDTH]
            if not half <= along_wall(problem.wall, w, state.where[i, 0], state.where[i, 1]) <= problem.wall[w, 4] - half:
                return False
    return True


@njit(**INNER)
def _feasible(energy, tolerance):  # type: ignore[no-untyped-def]
    worst = max(energy[CIRCULATION], energy[REACHED])
    for term in range(HARD_TERMS):
        worst = max(worst, energy[term])
    return worst <= tolerance


@njit(cache=True, error_model="numpy")
def _run(rng, problem, state, settings, goal, movable, proposals, kept, counts, floor, history, work):  # type: ignore[no-untyped-def]
    energy, before, after, members = work.energy[0], work.energy[1], work.energy[2], work.who[0]
    walks, weight = len(floor.covered) > 0, problem.number
    if walks:
        furnish(problem, state, floor, work.traffic, np.int64(1))
        energy[CIRCULATION], energy[REACHED] = measure(problem, state, floor, floor.mark[floor.tally[SIDE]], work.traffic)
    good, found, best, row = _feasible(energy, goal.tolerance), False, np.inf, 0
    if good and goal.keep_best:
        found, best = True, weighted(problem, energy)
        _keep(state, kept, np.int64(0), work)
    ratio = (goal.beta_last / goal.beta_first) ** (1.0 / max(proposals - 1, 1))
    beta = goal.beta_first / ratio
    for step in range(proposals):
        beta *= ratio
        u, move = rng.random(), np.int64(0)
        while move < len(settings.cumulative) - 1 and u >= settings.cumulative[move]:
            move += 1
        i = movable[pick(rng, len(movable))]
        carry = rng.random() < settings.number[CARRY]
        threshold = math.log(max(rng.random(), 1e-300))
        counts[move, 0] += 1
        leaders, log_q_ratio = propose(rng, problem, state, settings, move, i, movable, work.proposal)
        count = np.int64(0)
        for place in range(leaders):
            if count >= 0:
                count = _gather(problem, state, work.proposal.tag[place, LEADER], place, carry, count, work)
        if count > 0:
            walking = weight[CIRCULATION] * energy[CIRCULATION] + weight[REACHED] * energy[REACHED]
            limit = local_energy(problem, state, members, count, work.moved, np.inf, before)
            limit += (log_q_ratio - threshold) / beta + walking
            _apply(problem, state, count, work)
            total = np.inf
            if _followers_in_room(problem, state, count, work):
                total = local_energy(problem, state, members, count, work.moved, limit, after)
            circulation, missed = energy[CIRCULATION], energy[REACHED]
            if total < limit and walks:
                changes = changes_floor(problem, members, count)
                if changes:
                    circulation, missed = walk(problem, state, work.placed, members, count, floor, work.traffic)
                total += weight[CIRCULATION] * circulation + weight[REACHED] * missed
                if changes:
                    walk_on(problem, state, work.placed, members, count, floor, work.traffic, total < limit)
            if total < limit:
                counts[move, 1] += 1
                for term in range(len(energy)):
                    energy[term] += after[term] - before[term]
                energy[CIRCULATION], energy[REACHED] = circulation, missed
                was_good = good
                good = _feasible(energy, goal.tolerance)
                if goal.keep_best:
                    if good and weighted(problem, energy) < best:
                        found, best = True, weighted(problem, energy)
                        _keep(state, kept, np.int64(0), work)
                elif was_good and not good:
                    found = True
                    _keep(state, kept, count, work)
            else:
                _restore(problem, state, count, work)
            _release(count, work)
        if row < len(history) and (row + 1) * proposals <= (step + 1) * len(history):
            for term in range(len(energy)):
                history[row, term] = energy[term]
            for k in range(len(counts)):
                history[row, len(energy) + k], history[row, len(energy) + len(counts) + k] = counts[k, 0], counts[k, 1]
            row += 1
    if good and not goal.keep_best:
        found = True
        _keep(state, kept, np.int64(0), work)
    if walks:
        furnish(problem, state, floor, work.traffic, np.int64(0))
    return found
