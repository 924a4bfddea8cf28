"""Where the chain begins: several layouts are begun, short chains run in each, and the worse half drops out until one is left.

A single start settles in the first valley that it meets, and in a small room that is often one from which no layout without overlaps is in
reach.  All rounds take as many sweeps together, so that those which stay get twice as many each time (successive halving: Karnin, Koren
and Somekh, Almost Optimal Exploration in Multi-Armed Bandits, ICML 2013).  A structure of which even the best begun layout keeps a deep
overlap hardly ever finds a valid one later, and is given up.  What the chain samples from does not depend on where it begins.

An object comes in at the best of some poses drawn from the relocation's mixture.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Ints
from grammar.geometry.kernels import kernel, making_arrays
from grammar.layout import columns as col
from grammar.layout.energies import local_energy
from grammar.layout.mcmc import Chain, ChainRun, empty_counts, run_chain
from grammar.layout.moves import RELOCATE, propose
from grammar.layout.problem import MoveSettings, Problem, State, copy_state, empty_proposal
from grammar.layout.rigid_moves import apply_move, nothing_moved
from grammar.spec.energy_terms import HARD_TERMS, TERMS
from grammar.spec.rules import Schedule
from scene_description.products import matmul

_FURTHER = 200
"""Poses that are drawn for an object of which none lay in the room before it counts as one that cannot come in."""


def enter(rng: np.random.Generator, problem: Problem, state: State, settings: MoveSettings, i: int, starts: int) -> bool:
    """Bring object ``i`` in at the best of ``starts`` poses drawn from the relocation's mixture; return whether any was possible.

    Beside a core at the edge of the room, or at the end of its wall, most poses lie outside; where all do, more are drawn until one
    does not.
    """
    work = empty_proposal(), nothing_moved(problem), np.zeros(len(problem.weight))
    return bool(_enter(rng, problem, state, settings, int(i), starts, work))


@making_arrays
def _enter(rng, problem, state, settings, i, starts, work):  # type: ignore[no-untyped-def]
    """Put object ``i`` at the best of ``starts`` poses; the best one so far is kept in the proposal's second place."""
    proposal, moved, energy = work
    members, best, one = moved.members, np.inf, np.int64(1)
    members[0], moved.leader[0], moved.mark[i], state.hold[i, col.ACTIVE] = i, 0, 1, 1
    # A relocation's density is asked for the pose at hand too, so the object needs some support or wall to begin with.
    if problem.link[i, col.MOUNT] == col.OBJECT:
        state.hold[i, col.SURFACE] = int(problem.mode[problem.link[i, col.TARGETS], col.TARGET])
    if problem.link[i, col.MOUNT] == col.WALL:
        state.hold[i, col.ON_WALL] = 0
    # Draw poses, and keep the one of least energy.
    for drawn in range(starts + _FURTHER):
        if drawn >= starts and best < np.inf:
            break
        if propose(rng, problem, state, settings, np.int64(RELOCATE), i, members, proposal)[0] == 0:
            continue
        apply_move(problem, state, proposal, one, moved)
        total = local_energy(problem, state, members, one, moved.mark, best, energy)
        if total < best:
            best = total
            _copy_place(proposal, 0, 1)
    moved.mark[i] = 0
    if best == np.inf:
        state.hold[i, col.ACTIVE] = 0
        return False
    _copy_place(proposal, 1, 0)
    apply_move(problem, state, proposal, one, moved)
    return True


@kernel
def _copy_place(proposal, source, target):  # type: ignore[no-untyped-def]
    """Copy one of the two poses of a proposal over the other."""
    for k in range(col.POSE_WIDTH):
        proposal.pose[target, k], proposal.tag[target, k] = proposal.pose[source, k], proposal.tag[source, k]


_HARD = [TERMS.index(name) for name in HARD_TERMS]


class Stage(NamedTuple):
    """A stage of the run: the objects that come in, those that move, and the proposals for each of these."""

    entering: Ints
    movable: Ints
    proposals: int


class Entrant(NamedTuple):
    """A begun layout, its weighted energy, and its greatest loss of a hard term."""

    state: State
    energy: float
    hard: float


def best_entrant(
    rng: np.random.Generator, chain: Chain, start: State, stages: Sequence[Stage], last: Stage, schedule: Schedule, beta: float
) -> tuple[State | None, Ints]:
    """Begin ``schedule.entrants`` layouts and return the best one, with the (m, 2) proposals of each move, tried and accepted.

    ``start``: what stays put and the rows of units; not changed.  The proposals of ``stages``, which bring in what stands and hangs, and of
    ``last``, what moves in every further round, are shared by the entrants that are left.  The state is None if an object could not come
    in, or if no entrant of some round has all hard losses within ``schedule.hopeless``.
    """
    counts = empty_counts()
    found: list[Entrant] = []
    for _ in range(schedule.entrants):
        state = copy_state(start)
        entrant = Entrant(state, 0.0, 0.0)
        for stage in stages:
            if not all(enter(rng, chain.problem, state, chain.moves, i, schedule.starts) for i in stage.entering):
                return None, counts
            entrant = _swept(rng, chain, entrant, stage.movable, stage.proposals // schedule.entrants, beta, counts)
        found.append(entrant)
    while len(found) > 1 and min(entrant.hard for entrant in found) <= schedule.hopeless:
        kept = sorted(found, key=lambda entrant: entrant.energy)[: len(found) // 2]
        found = [_swept(rng, chain, entrant, last.movable, last.proposals // len(kept), beta, counts) for entrant in kept]
    best = min(found, key=lambda entrant: entrant.energy)
    return (best.state if best.hard <= schedule.hopeless else None), counts


def _swept(rng: np.random.Generator, chain: Chain, entrant: Entrant, movable: Ints, sweeps: int, beta: float, counts: Ints) -> Entrant:
    """Run a chain of so many sweeps in an entrant's state, and add its proposals to ``counts``."""
    if not len(movable):
        return entrant
    info = run_chain(rng, chain, entrant.state, ChainRun(max(sweeps, 1) * len(movable), beta, beta, 0.0, False), movable)
    counts += info.counts
    return Entrant(entrant.state, float(matmul(info.energy, chain.problem.weight)), float(info.energy[_HARD].max()))
