"""When which objects move: the staged run of the chain over one parse tree.

The five stages of Jiang et al. (IJCV 2018, section 6) bring the objects in; then all of them move together until the layout is done.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Floats, Ints
from grammar.layout.circulation import circulation_losses
from grammar.layout.energies import CIRCULATION, REACHED, full_energy, place_object
from grammar.layout.floor_raster import NO_FLOOR, Floor
from grammar.layout.mcmc import HISTORY, NO_HISTORY, Goal, enter, run_chain
from grammar.layout.moves import MoveSettings
from grammar.layout.problem import BOUNDS, CANDIDATE, CEILING, FIXED, FLOOR, OBJECT, WALL, Problem, State, copy_state
from grammar.spec.rules import Convergence, Schedule


class ChainResult(NamedTuple):
    """What a run of the chain leaves.

    layout: a feasible layout, or None if the chain met none; energy: (t,) its unweighted losses; state: where the chain stopped;
    counts: (6, 2) proposals and acceptances by move; history: (r, t + 12) losses after each sweep in which all objects moved together, and
    the proposals and acceptances by move up to it; converged: whether the energies' histogram stood still before the proposals were spent.
    """

    layout: State | None
    energy: Floats
    state: State
    counts: Ints
    history: Floats
    converged: bool


def run_stages(
    rng: np.random.Generator,
    problem: Problem,
    start: State,
    settings: MoveSettings,
    schedule: Schedule,
    beta: float,
    floor: Floor = NO_FLOOR,
) -> ChainResult:
    """Run all stages once from a state that holds only the fixed objects, which is not changed."""
    state, counts = copy_state(start), np.zeros((6, 2), np.int64)
    kept, goal = copy_state(state), Goal(beta, beta, schedule.hard_tolerance, False)
    for entering, movable, each in _stages(problem, schedule):
        for i in entering:
            if not enter(rng, problem, state, settings, i, schedule.starts):
                return ChainResult(None, full_energy(problem, state), state, counts, NO_HISTORY, False)
        if len(movable):
            run_chain(rng, problem, state, settings, goal, movable, each * len(movable), kept, counts)
    return run_together(rng, problem, state, settings, schedule, beta, counts, schedule.together, floor, first=True)


def run_together(
    rng: np.random.Generator,
    problem: Problem,
    state: State,
    settings: MoveSettings,
    schedule: Schedule,
    beta: float,
    counts: Ints,
    each: int,
    floor: Floor = NO_FLOOR,
    first: bool = False,
) -> ChainResult:
    """Let all objects move for ``each`` proposals per object, from ``state``, which is written in place.

    ``first``: this run follows the stages, so it anneals if the schedule says so.
    """
    movable = np.flatnonzero(~problem.pinned)
    begin = min(schedule.anneal_from_beta, beta) if first else beta
    test, best, least, converged = schedule.convergence, None, np.inf, False
    kept, history, energy = copy_state(state), NO_HISTORY, full_energy(problem, state)
    while len(history) < each and not converged:
        sweeps = min(test.lag, each - len(history)) if test.window else each
        ends = [begin * (beta / begin) ** (done / each) for done in (len(history), len(history) + sweeps)]
        goal, rows = Goal(ends[0], ends[1], schedule.hard_tolerance, schedule.keep == "best"), np.zeros((sweeps, HISTORY))
        found, energy = run_chain(
            rng, problem, state, settings, goal, movable, sweeps * len(movable), kept, counts, floor, rows if len(movable) else NO_HISTORY
        )
        history = np.concatenate([history, rows])
        total = float(layout_energy(problem, kept, floor) @ problem.weight) if found else np.inf
        if found and (schedule.keep == "last" or total < least):
            best, least = copy_state(kept), total
        converged = best is not None and begin == beta and has_converged(history[:, :BOUNDS] @ problem.weight, test)
    if best is None:
        return ChainResult(None, energy, state, counts, history, converged)
    energy = layout_energy(problem, best, floor)
    return ChainResult(best, energy, state, counts, history, converged)


def layout_energy(problem: Problem, state: State, floor: Floor = NO_FLOOR) -> Floats:
    """Place the boxes of a state and return its (t,) unweighted losses, circulation and reach included where there is a floor."""
    for i in range(len(problem.link)):
        place_object(problem, state, i)
    energy: Floats = full_energy(problem, state)
    if floor is not NO_FLOOR:
        energy[CIRCULATION], energy[REACHED] = circulation_losses(problem, state, floor)
    return energy


def has_converged(energies: Floats, test: Convergence) -> bool:
    """Return whether the histogram of the last energies is the one of ``lag`` samples before.

    Args:
        energies: (r,) one for each sweep.
        test: window, lag, greatest total variation distance, bins (over the range that both windows cover).
    """
    if not test.window or len(energies) < test.window + test.lag:
        return False
    now, before = energies[-test.window :], energies[-test.window - test.lag : -test.lag]
    low, high = min(now.min(), before.min()), max(now.max(), before.max())
    counts = [np.histogram(part, test.bins, (low, max(high, low + 1e-9)))[0] for part in (now, before)]
    return bool(0.5 * np.abs(counts[0] - counts[1]).sum() / test.window < test.epsilon)


def _stages(problem: Problem, schedule: Schedule) -> list[tuple[Ints, Ints, int]]:
    """Return for every stage the objects that come in, those that move, and the proposals for each of these."""
    n = len(problem.link)
    mount, grouped = np.where(problem.pinned, FIXED, problem.mount), problem.core >= 0
    is_core = np.isin(np.arange(n), problem.core)
    follows = (mount == WALL) & grouped & (problem.mount[problem.core] == FLOOR)
    hangs = np.flatnonzero(((mount == WALL) & ~follows) | (mount == CEILING))
    cores = np.flatnonzero((mount == FLOOR) & is_core & ~grouped)
    associates = np.flatnonzero((mount == FLOOR) & grouped)
    unpaired = np.flatnonzero((mount == FLOOR) & ~grouped & ~is_core)
    over_cores, over_associates = (np.flatnonzero(follows & np.isin(problem.core, below)) for below in (cores, associates))
    over_others = np.setdiff1d(np.flatnonzero(follows), np.concatenate([over_cores, over_associates]))
    supported = _bottom_up(problem, np.flatnonzero(mount == OBJECT))
    gathered = np.concatenate([cores, over_cores, associates, over_associates])
    return [
        (hangs, hangs, schedule.walls),
        (np.concatenate([cores, over_cores]), np.concatenate([cores, over_cores]), schedule.cores),
        (np.concatenate([_cores_first(problem, associates), over_associates]), gathered, schedule.associates),
        (np.concatenate([over_others, unpaired]), np.concatenate([gathered, over_others, unpaired]), schedule.unpaired),
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
        owners = problem.slot_owner[problem.modes(i, CANDIDATE)[:, 0].astype(np.int64)]
        return 1 + max((level(int(owner)) for owner in owners), default=0)

    return np.array(sorted(supported.tolist(), key=lambda i: (level(i), i)), np.int64)
