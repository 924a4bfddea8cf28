"""The Metropolis-Hastings chain over layouts, each proposal judged by the cliques that it touches.

A proposal is accepted with probability ``min(1, exp(beta (E_old - E_new)) q(old | new) / q(new | old))``, beta the inverse temperature
(Jiang et al., IJCV 2018, section 3.2).  The uniform number that decides is drawn first: it bounds the energy that would still be accepted,
and all losses are sums from zero, so most proposals are rejected after a few cliques, and the costly losses (circulation) are only computed
for proposals that pass all others.  The decision is the same as with the whole energy.

:func:`_step` decides one proposal; :func:`_run` keeps the layout, counts and the trace.
"""

import math
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.kernels import inlined, kernel, making_arrays
from grammar.layout import columns as col
from grammar.layout.circulation import (
    Traffic,
    changes_floor,
    commit_or_revert,
    measure,
    rasterize_objects,
    traffic_of,
    try_move,
)
from grammar.layout.energies import full_energy, local_energy
from grammar.layout.floor_raster import NO_FLOOR, SIDE, Floor
from grammar.layout.frames import pick
from grammar.layout.moves import propose
from grammar.layout.problem import MoveSettings, Problem, Proposal, State, copy_state, empty_proposal
from grammar.layout.rigid_moves import Moved, apply_move, copy_layout, followers_in_room, gather, nothing_moved, release, revert_move
from grammar.spec.energy_terms import FLOOR_TERMS, HARD_TERMS, TERM, TERMS
from grammar.spec.rules import MOVES

_ZERO_IF_FEASIBLE = np.array([TERMS.index(name) for name in (*FLOOR_TERMS, *HARD_TERMS)])
_LEAST_UNIFORM = 1e-300


class Chain(NamedTuple):
    """What a chain samples from and how it moves; no run changes any of it.

    ``floor``: of the unfurnished room; with it circulation and reach are part of the energy.  A run writes to it and leaves it as it was.
    """

    problem: Problem
    moves: MoveSettings
    floor: Floor = NO_FLOOR


class ChainRun(NamedTuple):
    """How long a chain runs, at which inverse temperature, and which layouts are feasible, of which it keeps the last one.

    A layout is feasible when no loss of a hard term exceeds ``tolerance``, nor circulation and reach if the chain has a floor.
    """

    proposals: int
    beta: float
    tolerance: float


class Trace(NamedTuple):
    """What a run was like after each of r evenly spaced proposals, the last one among them.

    energy: (r, t) unweighted losses; counts: (r, m, 2) proposals of each move, tried and accepted since the run began.
    """

    energy: Floats
    counts: Ints


class ChainInfo(NamedTuple):
    """What a run of the chain leaves beside its last state.

    kept: a feasible layout (not the boxes that follow from its poses), None if the chain met none; energy: (t,) losses of the last state as
    the steps added them up; counts: (m, 2) proposals of each move, tried and accepted; trace.
    """

    kept: State | None
    energy: Floats
    counts: Ints
    trace: Trace


class _Work(NamedTuple):
    """Work space of a run: (t,) losses of the layout, and of the moved cliques before and after; the proposal; who moves; the raster.

    kept, counts, trace: what :class:`ChainInfo` says of them.
    """

    energy: Floats
    before: Floats
    after: Floats
    proposal: Proposal
    moved: Moved
    traffic: Traffic
    kept: State
    counts: Ints
    trace: Trace


class _Step(NamedTuple):
    """What one step did: the move that it tried, whether it was accepted, and how many objects moved."""

    move: np.int64
    accepted: bool
    moved: np.int64


def _work(chain: Chain, state: State, samples: int) -> _Work:
    problem, terms = chain.problem, len(TERMS)
    return _Work(
        energy=full_energy(problem, state),
        before=np.zeros(terms),
        after=np.zeros(terms),
        proposal=empty_proposal(),
        moved=nothing_moved(problem),
        traffic=traffic_of(problem, chain.floor),
        kept=copy_state(state),
        counts=empty_counts(),
        trace=empty_trace(samples),
    )


def empty_trace(samples: int) -> Trace:
    """Return a trace of so many samples, all zero."""
    return Trace(np.zeros((samples, len(TERMS))), np.zeros((samples, len(MOVES), 2), np.int64))


def empty_counts() -> Ints:
    """Return the (m, 2) counts of a chain that has made no proposals."""
    return np.zeros((len(MOVES), 2), np.int64)


def run_chain(rng: np.random.Generator, chain: Chain, state: State, run: ChainRun, movable: Ints, samples: int = 0) -> ChainInfo:
    """Run the chain, which writes the state in place, and keep a feasible layout.

    ``movable``: (k,) int64 indices of the objects that lead moves; ``samples``: length of the trace.
    """
    work = _work(chain, state, samples)
    has_kept = _run(rng, chain, state, run, movable, work)
    return ChainInfo(work.kept if has_kept else None, work.energy, work.counts, work.trace)


@making_arrays
def _run(rng, chain, state, run, movable, work):  # type: ignore[no-untyped-def]
    """Make all proposals of a run; return whether ``kept`` of the work space holds a feasible layout."""
    kept, counts, trace = work.kept, work.counts, work.trace
    problem, floor, energy, moved, proposals = chain.problem, chain.floor, work.energy, work.moved, run.proposals
    has_floor = len(floor.covered) > 0
    if has_floor:
        rasterize_objects(problem, state, floor, work.traffic, np.int64(1))
        energy[TERM.circulation], energy[TERM.reach] = measure(problem, state, floor, floor.mark[floor.tally[SIDE]], work.traffic)
    feasible, has_kept, sample = _feasible(energy, run.tolerance), False, 0
    for n in range(proposals):
        step = _step(rng, chain, state, movable, run.beta, work)
        # Count it.
        counts[step.move, col.TRIED] += 1
        if step.accepted:
            counts[step.move, col.ACCEPTED] += 1
            # Keep the last layout before the chain leaves the feasible ones.
            was_feasible, feasible = feasible, _feasible(energy, run.tolerance)
            if was_feasible and not feasible:
                has_kept = True
                copy_layout(state, kept, step.moved, moved)
        # Trace it.
        if sample < len(trace.energy) and (sample + 1) * proposals <= (n + 1) * len(trace.energy):
            _trace(energy, counts, sample, trace)
            sample += 1
    if feasible:
        has_kept = True
        copy_layout(state, kept, np.int64(0), moved)
    if has_floor:
        rasterize_objects(problem, state, floor, work.traffic, np.int64(0))
    return has_kept


@inlined
def _step(rng, chain, state, movable, beta, work):  # type: ignore[no-untyped-def]
    """Propose a move and accept or reject it; the state and the energy of ``work`` are those after it."""
    problem, floor, weight, energy, moved = chain.problem, chain.floor, chain.problem.weight, work.energy, work.moved
    # Draw the move, the object that leads it, whether its group comes along, and the number that decides.
    u, move = rng.random(), np.int64(0)
    while move < len(chain.moves.cumulative) - 1 and u >= chain.moves.cumulative[move]:
        move += 1
    i = movable[pick(rng, len(movable))]
    carry = rng.random() < chain.moves.carry
    threshold = math.log(max(rng.random(), _LEAST_UNIFORM))
    # Propose, and gather what moves along.
    leaders, log_q_ratio = propose(rng, problem, state, chain.moves, move, i, movable, work.proposal)
    count = np.int64(0)
    for place in range(leaders):
        if count >= 0:
            count = gather(problem, state, work.proposal.tag[place, col.LEADER], place, carry, count, moved)
    if count <= 0:
        return _Step(move, False, np.int64(0))
    # Bound the energy after the move that would still be accepted.
    walking = weight[TERM.circulation] * energy[TERM.circulation] + weight[TERM.reach] * energy[TERM.reach]
    limit = local_energy(problem, state, moved.members, count, moved.mark, np.inf, work.before)
    limit += (log_q_ratio - threshold) / beta + walking
    # Move, and measure the cliques that change, up to that bound.
    apply_move(problem, state, work.proposal, count, moved)
    total = np.inf
    if followers_in_room(problem, state, count, moved):
        total = local_energy(problem, state, moved.members, count, moved.mark, limit, work.after)
    # Measure the floor only if all else is accepted.
    circulation, missed = energy[TERM.circulation], energy[TERM.reach]
    if total < limit and len(floor.covered) > 0:
        changes = changes_floor(problem, moved.members, count)
        if changes:
            circulation, missed = try_move(problem, state, moved.before.placed, moved.members, count, floor, work.traffic)
        total += weight[TERM.circulation] * circulation + weight[TERM.reach] * missed
        if changes:
            commit_or_revert(problem, state, moved.before.placed, moved.members, count, floor, work.traffic, total < limit)
    # Accept or reject.
    accepted = total < limit
    if accepted:
        for term in range(len(energy)):
            energy[term] += work.after[term] - work.before[term]
        energy[TERM.circulation], energy[TERM.reach] = circulation, missed
    else:
        revert_move(problem, state, count, moved)
    release(count, moved)
    return _Step(move, accepted, count)


@inlined
def _feasible(energy, tolerance):  # type: ignore[no-untyped-def]
    """Return whether no loss that is zero in a feasible layout exceeds the tolerance."""
    worst = 0.0
    for k in range(len(_ZERO_IF_FEASIBLE)):
        worst = max(worst, energy[_ZERO_IF_FEASIBLE[k]])
    return worst <= tolerance


@kernel
def _trace(energy, counts, sample, trace):  # type: ignore[no-untyped-def]
    """Write one sample of the trace."""
    for term in range(len(energy)):
        trace.energy[sample, term] = energy[term]
    for move in range(len(counts)):
        for k in range(2):
            trace.counts[sample, move, k] = counts[move, k]
