"""When which objects move: the staged run of the chain over one parse tree.

Stages as those of Jiang et al. (IJCV 2018, section 6) bring the objects in, those that stand or hang in several layouts of which the best
one goes on (:mod:`grammar.layout.entrants`); then all objects move together until the layout is done.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Bools, Floats, Ints
from grammar.layout import columns as col
from grammar.layout.circulation import circulation_losses
from grammar.layout.energies import full_energy
from grammar.layout.entrants import Beginning, Begun, Stage, best_entrant, enter
from grammar.layout.floor_raster import NO_FLOOR
from grammar.layout.frames import place_object
from grammar.layout.mcmc import Chain, ChainRun, Trace, empty_counts, empty_trace, run_chain
from grammar.layout.problem import MoveSettings, Problem, State
from grammar.spec.energy_terms import TERM
from grammar.spec.rules import Convergence, Schedule
from scene_description.products import matmul

_LARGE_M2 = 0.25
"""What is larger and belongs to a corner comes in before what would stand there else."""


class ChainResult(NamedTuple):
    """What the stages, or another round of the last of them, leave.

    layout: a feasible layout, or None if the chain met none; energy: (t,) its unweighted losses; state: where the chain stopped; counts:
    (m, 2) proposals of each move, tried and accepted, over all stages; trace: of the stage in which all objects move together, a sample
    after each sweep; converged: whether the energies' histogram stood still before the proposals were spent.
    """

    layout: State | None
    energy: Floats
    state: State
    counts: Ints
    trace: Trace
    converged: bool


def begin(rng: np.random.Generator, rooms: Sequence[tuple[Problem, State]], moves: MoveSettings, schedule: Schedule, beta: float) -> Begun:
    """Begin layouts of all that stands or hangs, and return the best one of all rooms.

    ``rooms``: the same objects between other walls, doors or windows, each room with a state that holds only what stays put there, which is
    not changed.
    """
    beginnings = []
    for problem, start in rooms:
        *stages, supported = _stages(problem, schedule)
        standing = Stage(supported.entering[:0], np.setdiff1d(leaders(problem), supported.entering), schedule.unpaired // 2)
        beginnings.append(Beginning(Chain(problem, moves), start, stages, standing))
    return best_entrant(rng, beginnings, schedule, beta)


def run_stages(rng: np.random.Generator, chain: Chain, begun: Begun, schedule: Schedule, beta: float) -> ChainResult:
    """Bring in what stands on objects, then let all move, at inverse temperature ``beta``, in the state of a begun layout."""
    problem, without_floor, state, counts = chain.problem, chain._replace(floor=NO_FLOOR), begun.state, begun.counts
    supported = _stages(problem, schedule)[-1]
    if not begun.fits or not all(enter(rng, problem, state, chain.moves, i, schedule.starts) for i in supported.entering):
        return ChainResult(None, full_energy(problem, state), state, counts, empty_trace(0), False)
    if len(supported.movable):
        run = ChainRun(supported.proposals * len(supported.movable), beta, schedule.hard_tolerance)
        counts = counts + run_chain(rng, without_floor, state, run, supported.movable).counts
    result = run_together(rng, chain, state, schedule, beta, schedule.together)
    return result._replace(counts=counts + result.counts)


def run_together(rng: np.random.Generator, chain: Chain, state: State, schedule: Schedule, beta: float, sweeps: int) -> ChainResult:
    """Let all objects move together, which writes the state in place.

    ``sweeps``: proposals for each object that moves, if the energies do not stand still before.
    """
    movable, test = leaders(chain.problem), schedule.convergence
    kept, converged = None, False
    counts, trace, energy = empty_counts(), empty_trace(0), full_energy(chain.problem, state)
    while len(trace.energy) < sweeps and not converged:
        # Run up to the next test of convergence.
        part = min(test.lag, sweeps - len(trace.energy)) if test.window else sweeps
        info = run_chain(rng, chain, state, ChainRun(part * len(movable), beta, schedule.hard_tolerance), movable, part)
        energy = info.energy
        if info.kept is not None:
            kept = info.kept
        # Go on where the energies still change.
        trace = Trace(np.concatenate([trace.energy, info.trace.energy]), np.concatenate([trace.counts, counts + info.trace.counts]))
        counts = counts + info.counts
        converged = kept is not None and has_converged(matmul(trace.energy, chain.problem.weight), test)
    if kept is not None:
        energy = layout_energy(chain, kept)
    return ChainResult(kept, energy, state, counts, trace, converged)


def layout_energy(chain: Chain, state: State) -> Floats:
    """Place the boxes of a state and return its (t,) unweighted losses, circulation and reach included where the chain has a floor."""
    for i in range(len(chain.problem.link)):
        place_object(chain.problem, state, i)
    energy: Floats = full_energy(chain.problem, state)
    if chain.floor is not NO_FLOOR:
        energy[TERM.circulation], energy[TERM.reach] = circulation_losses(chain.problem, state, chain.floor)
    return energy


def has_converged(energies: Floats, test: Convergence) -> bool:
    """Return whether the histogram of the last energies, (r,) one for each sweep, is the one of ``lag`` samples before."""
    if not test.window or len(energies) < test.window + test.lag:
        return False
    now, before = energies[-test.window :], energies[-test.window - test.lag : -test.lag]
    low, high = min(now.min(), before.min()), max(now.max(), before.max())
    counts = [np.histogram(part, test.bins, (low, max(high, low + 1e-9)))[0] for part in (now, before)]
    return bool(0.5 * np.abs(counts[0] - counts[1]).sum() / test.window < test.epsilon)


def _moves_alone(problem: Problem) -> Bools:
    """Return which objects are no units of a row and do not hang in line above one, (n,)."""
    alone: Bools = (problem.link[:, col.ROW] < 0) & (problem.link[:, col.IN_LINE] == 0)
    return alone


def leaders(problem: Problem) -> Ints:
    """Return the objects that lead moves: all that do not stay put and move alone, and the head of each row of units."""
    found = ~problem.pinned & _moves_alone(problem)
    found[problem.row[:, col.ROW_HEAD]] = True
    return np.flatnonzero(found)


def _stages(problem: Problem, schedule: Schedule) -> list[Stage]:
    """Return the stages that bring in cores, what groups around these, what stands alone, what hangs, what stands on objects.

    What hangs comes late, as small things give way to large ones, unless something belongs to it.
    Runs are there from the beginning and move, each by its head, as soon as cores do.
    """
    n = len(problem.link)
    mount = np.where(problem.pinned | ~_moves_alone(problem), col.FIXED, problem.mount)
    heads, grouped = problem.row[:, col.ROW_HEAD], problem.core >= 0
    is_core = np.isin(np.arange(n), problem.core)
    follows = (mount == col.WALL) & grouped & (problem.mount[problem.core] == col.FLOOR)
    hangs = np.flatnonzero(((mount == col.WALL) & ~follows) | (mount == col.CEILING))
    area = 4.0 * problem.object[:, col.HALF_DEPTH] * problem.object[:, col.HALF_WIDTH]
    in_corner = grouped & problem.pinned[problem.core] & (area > _LARGE_M2)
    cores = np.concatenate([np.flatnonzero((mount == col.FLOOR) & part) for part in (in_corner, is_core & ~grouped)])
    associates = np.flatnonzero((mount == col.FLOOR) & grouped & ~in_corner)
    unpaired = np.flatnonzero((mount == col.FLOOR) & ~grouped & ~is_core)
    over_cores, over_associates = (np.flatnonzero(follows & np.isin(problem.core, below)) for below in (cores, associates))
    over_others = np.setdiff1d(np.flatnonzero(follows), np.concatenate([over_cores, over_associates]))
    supported = _bottom_up(problem, np.flatnonzero(mount == col.OBJECT))
    held = np.isin(hangs, problem.core)
    first = np.concatenate([hangs[held], cores, over_cores])
    second = np.concatenate([_cores_first(problem, associates), over_associates])
    third = np.concatenate([over_others, unpaired])
    return [
        Stage(first, np.concatenate([heads, first]), schedule.cores),
        Stage(second, np.concatenate([heads, first, second]), schedule.associates),
        Stage(third, np.concatenate([heads, first, second, third]), schedule.unpaired),
        Stage(hangs[~held], hangs[~held], schedule.walls),
        Stage(supported, supported, schedule.supported),
    ]


def _cores_first(problem: Problem, associates: Ints) -> Ints:
    """Return associates so that a core that has a core itself comes after it."""

    def depth(i: int) -> int:
        return 0 if problem.core[i] < 0 else 1 + depth(int(problem.core[i]))

    return np.array(sorted(associates.tolist(), key=lambda i: (depth(i), i)), np.int64)


def _bottom_up(problem: Problem, supported: Ints) -> Ints:
    """Return supported objects so that whatever may carry another one comes before it."""

    def level(i: int) -> int:
        owners = problem.surface_owner[problem.targets(i)]
        return 1 + max((level(int(owner)) for owner in owners), default=0)

    return np.array(sorted(supported.tolist(), key=lambda i: (level(i), i)), np.int64)
