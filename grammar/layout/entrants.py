"""Where the chain begins: several layouts are begun, short chains run in each, and the worse half drops out until one is left.

A single start settles in the first valley that it meets, and in a small room that is often one from which no layout without overlaps is in
reach.  All rounds take as many sweeps together, so that those which stay get twice as many each time (successive halving: Karnin, Koren
and Somekh, Almost Optimal Exploration in Multi-Armed Bandits, ICML 2013).  A structure of which even the best begun layout keeps a deep
overlap hardly ever finds a valid one later, and is given up.  What the chain samples from does not depend on where it begins.

Where the same furniture may stand in several rooms, as between other doors and windows, the entrants are shared by these, and the best one
of all tells which room it is.

An object comes in at the best of some poses drawn from the relocation's mixture.
"""

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


class Beginning(NamedTuple):
    """What layouts of one room are begun with.

    ``start``: what stays put and the rows of units; not changed.  ``stages`` bring in what stands and hangs; ``last``: what moves in every
    further round.
    """

    chain: Chain
    start: State
    stages: Sequence[Stage]
    last: Stage


class Entrant(NamedTuple):
    """A begun layout, the number of its room, its weighted energy, and its greatest loss of a hard term."""

    state: State
    room: int
    energy: float
    hard: float


class Begun(NamedTuple):
    """The best begun layout, the number of its room, and the (m, 2) proposals of each move, tried and accepted, in all of them.

    ``fits``: whether it is worth going on with; if not, the state has no more than what stays put where nothing came in anywhere.
    """

    state: State
    room: int
    fits: bool
    counts: Ints


def best_entrant(rng: np.random.Generator, rooms: Sequence[Beginning], schedule: Schedule, beta: float) -> Begun:
    """Begin ``schedule.entrants`` layouts, in one room after the other, and return the best one.

    The proposals of a room's stages, and of what moves in further rounds, are shared by the entrants that are left.  The structure fits
    nowhere if in every room an object could not come in, or if no entrant of some round has all hard losses within ``schedule.hopeless``.
    """
    counts = empty_counts()
    found: list[Entrant] = []
    closed: set[int] = set()
    for number in range(schedule.entrants):
        k = number % len(rooms)
        entrant = None if k in closed else _entered(rng, rooms[k], k, schedule, beta, counts)
        if entrant is None:
            closed.add(k)
        else:
            found.append(entrant)
    if not found:
        return Begun(copy_state(rooms[0].start), 0, False, counts)
    while len(found) > 1 and min(entrant.hard for entrant in found) <= schedule.hopeless:
        kept = sorted(found, key=lambda entrant: entrant.energy)[: len(found) // 2]
        found = [_swept(rng, rooms[one.room].chain, one, rooms[one.room].last, len(kept), beta, counts) for one in kept]
    best = min(found, key=lambda entrant: entrant.energy)
    return Begun(best.state, best.room, best.hard <= schedule.hopeless, counts)


def _entered(rng: np.random.Generator, room: Beginning, number: int, schedule: Schedule, beta: float, counts: Ints) -> Entrant | None:
    """Return a layout into which all stages have brought their objects, None if one could not come in."""
    entrant = Entrant(copy_state(room.start), number, 0.0, 0.0)
    for stage in room.stages:
        if not all(enter(rng, room.chain.problem, entrant.state, room.chain.moves, i, schedule.starts) for i in stage.entering):
            return None
        entrant = _swept(rng, room.chain, entrant, stage, schedule.entrants, beta, counts)
    return entrant


def _swept(rng: np.random.Generator, chain: Chain, entrant: Entrant, stage: Stage, sharing: int, beta: float, counts: Ints) -> Entrant:
    """Run a chain with an entrant's share of a stage's proposals in its state, and add them to ``counts``."""
    movable = stage.movable
    if not len(movable):
        return entrant
    info = run_chain(rng, chain, entrant.state, ChainRun(max(stage.proposals // sharing, 1) * len(movable), beta, 0.0), movable)
    counts += info.counts
    return entrant._replace(energy=float(matmul(info.energy, chain.problem.weight)), hard=float(info.energy[_HARD].max()))
