"""Where the chain begins: several layouts are begun, short chains run in each, and the worse half drops out until one is left.

A single start settles in the first valley that it meets, and in a small room that is often one from which no layout without overlaps is in
reach.  All rounds take as many sweeps together, so that those which stay get twice as many each time (successive halving: Karnin, Koren
and Somekh, Almost Optimal Exploration in Multi-Armed Bandits, ICML 2013).  A structure of which even the best begun layout keeps a deep
overlap hardly ever finds a valid one later, and is given up.  What the chain samples from does not depend on where it begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Ints
from grammar.layout.enter import enter
from grammar.layout.mcmc import Chain, Run, empty_counts, run_chain
from grammar.layout.problem import State, copy_state
from grammar.spec.energy_terms import HARD_TERMS, TERMS
from grammar.spec.rules import Schedule

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

    Args:
        rng: advanced.
        chain: without a floor.
        start: what stays put and the runs; not changed.
        stages: bring in what stands and hangs; their proposals are shared by the entrants.
        last: what moves in every further round; its proposals are shared by the entrants that are left.
        schedule: numbers of entrants and of poses tried for an object that comes in, and the loss beyond which a structure is given up.
        beta: inverse temperature.

    Returns:
        state: None if an object could not come in, or if no entrant of some round has all hard losses within ``schedule.hopeless``.
        counts.
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
    info = run_chain(rng, chain, entrant.state, Run(max(sweeps, 1) * len(movable), beta, beta, 0.0, False), movable)
    counts += info.counts
    return Entrant(entrant.state, float(info.energy @ chain.problem.weight), float(info.energy[_HARD].max()))
