"""When which objects move: the staged run of the chain over one parse tree.

The five stages of Jiang et al. (IJCV 2018, section 6) bring the objects in; then all of them move together until the layout is done.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grammar.energies import full_energy, place_object
from grammar.layout import CEILING, FIXED, FLOOR, OBJECT, WALL, Floats, Ints, Problem, State, copy_state
from grammar.mcmc import Goal, enter, run_chain
from grammar.moves import MoveSettings
from grammar.rules import Schedule


class ChainResult(NamedTuple):
    """What a run of the chain leaves.

    layout: a feasible layout, or None if the chain met none; energy: (t,) its unweighted losses; state: where the chain stopped;
    counts: (6, 2) proposals and acceptances by move.
    """

    layout: State | None
    energy: Floats
    state: State
    counts: Ints


def run_stages(
    rng: np.random.Generator, problem: Problem, start: State, settings: MoveSettings, schedule: Schedule, beta: float
) -> ChainResult:
    """Run all stages once from a state that holds only the fixed objects, which is not changed."""
    state, counts = copy_state(start), np.zeros((6, 2), np.int64)
    kept, goal = copy_state(state), Goal(beta, beta, schedule.hard_tolerance, False)
    for entering, movable, each in _stages(problem, schedule):
        for i in entering:
            if not enter(rng, problem, state, settings, i, schedule.starts):
                return ChainResult(None, full_energy(problem, state), state, counts)
        if len(movable):
            run_chain(rng, problem, state, settings, goal, movable, each * len(movable), kept, counts)
    return run_together(rng, problem, state, settings, schedule, beta, counts, schedule.together, first=True)


def run_together(
    rng: np.random.Generator,
    problem: Problem,
    state: State,
    settings: MoveSettings,
    schedule: Schedule,
    beta: float,
    counts: Ints,
    each: int,
    first: bool = False,
) -> ChainResult:
    """Let all objects move for ``each`` proposals per object, from ``state``, which is written in place.

    ``first``: this run follows the stages, so it anneals if the schedule says so.
    """
    movable = np.flatnonzero(problem.mount != FIXED)
    kept = copy_state(state)
    begin = min(schedule.anneal_from_beta, beta) if first else beta
    goal = Goal(begin, beta, schedule.hard_tolerance, schedule.keep == "best")
    found, energy = run_chain(rng, problem, state, settings, goal, movable, each * len(movable), kept, counts)
    if not found:
        return ChainResult(None, energy, state, counts)
    for i in range(len(problem.mount)):
        place_object(problem, kept, i)
    return ChainResult(kept, full_energy(problem, kept), state, counts)


def _stages(problem: Problem, schedule: Schedule) -> list[tuple[Ints, Ints, int]]:
    """Return for every stage the objects that come in, those that move, and the proposals for each of these."""
    n = len(problem.mount)
    mount, grouped = problem.mount, problem.core >= 0
    is_core = np.isin(np.arange(n), problem.core)
    hangs = np.flatnonzero((mount == WALL) | (mount == CEILING))
    cores = np.flatnonzero((mount == FLOOR) & is_core & ~grouped)
    associates = np.flatnonzero((mount == FLOOR) & grouped)
    unpaired = np.flatnonzero((mount == FLOOR) & ~grouped & ~is_core)
    supported = _bottom_up(problem, np.flatnonzero(mount == OBJECT))
    return [
        (hangs, hangs, schedule.walls),
        (cores, cores, schedule.cores),
        (_cores_first(problem, associates), np.concatenate([cores, associates]), schedule.associates),
        (unpaired, np.concatenate([cores, associates, unpaired]), schedule.unpaired),
        (supported, supported, schedule.supported),
    ]


def _cores_first(problem: Problem, associates: Ints) -> Ints:
    """Return associates so that a core that has a core itself comes after it."""

    def depth(i: int) -> int:
        return 0 if problem.core[i] < 0 else 1 + depth(int(problem.core[i]))

    return np.array(sorted(associates.tolist(), key=lambda i: (depth(i), i)), np.int64)


def _bottom_up(problem: Problem, supported: Ints) -> Ints:
    """Return supported objects so that whatever may carry another one comes before it."""

    def level(i: int) -> int:
        owners = problem.slot_owner[problem.candidate[problem.candidate_first[i] : problem.candidate_first[i + 1]]]
        return 1 + max((level(int(owner)) for owner in owners), default=0)

    return np.array(sorted(supported.tolist(), key=lambda i: (level(i), i)), np.int64)
