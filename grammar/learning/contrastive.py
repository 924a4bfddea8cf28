"""Weights of the energy terms by contrastive divergence (Hinton, Neural Computation 2002; Jiang et al., IJCV 2018, section 3.1).

The gradient of the log-likelihood in a weight is the mean loss under the model minus that in the data.  The model's mean is replaced by
that of chains which start at the observed layouts and make a few Metropolis-Hastings steps.  A loss that grows on the way is held down
too little, so its weight must rise.  Steps are taken in the logarithm of the weights with the gradient divided by the sum of both means:
losses are positive, in metres or radians, and their weights span orders of magnitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grammar.geometry.arrays import Bools, Floats
from grammar.layout.energies import full_energy
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import COUNTERS, MoveSettings, Problem, State, copy_state, move_settings
from grammar.learning.assign import AssignedRoom
from grammar.learning.observed_layout import observed_layout
from grammar.spec.categories import Categories
from grammar.spec.energy_terms import ENERGY_TERMS, TERMS, Weights, weight_vector
from grammar.spec.rules import MOVES, Grammar, MoveRule

_LEAST_LOSS = 1e-6
_LEAST_ROOMS, _LEAST_CLIQUES = 3, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveRow:
    """One iteration: the weights before it, the mean losses of the data and of the chains that left it; all per room, in term order."""

    iteration: int
    weights: tuple[float, ...]
    data: tuple[float, ...]
    model: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ContrastiveOptions:
    """How the weights are learned.

    ``sweeps``: proposals for each object in a chain; ``rate``: step in the logarithm of a weight at full disagreement; ``factor``: how far
    a weight may leave the base's, up or down.
    """

    iterations: int = 60
    sweeps: int = 4
    rate: float = 0.25
    factor: float = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ContrastiveResult:
    """Learned weights, the names of the terms that were learned, how many rooms taught them, and the learning curve."""

    weights: Weights
    learned: tuple[str, ...]
    rooms: int
    curve: tuple[CurveRow, ...]


def learn_weights(
    grammar: Grammar, categories: Categories, rooms: Sequence[AssignedRoom], options: ContrastiveOptions, rng: np.random.Generator
) -> ContrastiveResult:
    """Learn the weights of the terms that have cliques to learn from, if the observed rooms have such cliques.

    Why the weight of another term stays is said in its row of :data:`grammar.spec.energy_terms.ENERGY_TERMS`.

    Args:
        grammar: with its relations already learned; its weights are where the learning starts.
        categories: solids and tops.
        rooms: what was observed.
        options: of the learning.
        rng: source of all randomness.
    """
    layouts = [layout for layout in (observed_layout(grammar, categories, room) for room in rooms) if layout is not None]
    base = weight_vector(grammar.weights)
    if len(layouts) < _LEAST_ROOMS or options.iterations == 0:
        return ContrastiveResult(weights=grammar.weights, learned=(), rooms=len(layouts), curve=())
    settings = _small_moves(grammar.moves)
    weights = base.copy()
    taught = _taught(layouts)
    curve: list[CurveRow] = []
    tail: list[Floats] = []
    for iteration in range(options.iterations):
        data = np.mean([full_energy(problem._replace(weight=weights), state) for problem, state in layouts], axis=0)
        model = np.mean([_short_chain(rng, problem, state, weights, settings, grammar, options) for problem, state in layouts], axis=0)
        curve.append(CurveRow(iteration=iteration, weights=_tuple(weights), data=_tuple(data), model=_tuple(model)))
        step = options.rate / (1.0 + 4.0 * iteration / options.iterations) * (model - data) / (model + data + _LEAST_LOSS)
        moved = np.clip(weights * np.exp(step), base / options.factor, base * options.factor)
        weights = np.where(taught, moved, weights)
        if 2 * iteration >= options.iterations:
            tail.append(np.log(np.maximum(weights, 1e-12)))
    mean = np.where(taught, np.exp(np.mean(tail, axis=0)), base)
    learned = {name: float(f"{mean[t]:.4g}") for t, name in enumerate(TERMS) if taught[t]}
    return ContrastiveResult(weights=replace(grammar.weights, **learned), learned=tuple(learned), rooms=len(layouts), curve=tuple(curve))


def _small_moves(rule: MoveRule) -> MoveSettings:
    """Return the moves of the short chains: the diffusions only, since a chain of a few steps shall stay near the data."""
    kept = {name: getattr(rule, name) for name in ("translate", "rotate", "slide")}
    total = sum(kept.values())
    small = dict.fromkeys(MOVES, 0.0) | {name: share / total for name, share in kept.items()}
    return move_settings(replace(rule, **small))


def _taught(layouts: Sequence[tuple[Problem, State]]) -> Bools:
    """Return (t,) which terms the observed rooms have enough cliques for."""
    counts = {kind: sum(count(problem) for problem, _ in layouts) for kind, count in COUNTERS.items()}
    learned_from = [term.learned_from for term in ENERGY_TERMS.values()]
    return np.array([kind is not None and counts[kind] >= _LEAST_CLIQUES for kind in learned_from])


def _short_chain(
    rng: np.random.Generator,
    problem: Problem,
    state: State,
    weights: Floats,
    settings: MoveSettings,
    grammar: Grammar,
    options: ContrastiveOptions,
) -> Floats:
    """Return the losses of a layout after a few steps from the observed one."""
    chain, moving = Chain(problem._replace(weight=weights), settings), copy_state(state)
    movable, beta = np.arange(len(problem.mount)), grammar.schedule.beta
    run = ChainRun(options.sweeps * len(movable), beta, beta, grammar.schedule.hard_tolerance, False)
    run_chain(rng, chain, moving, run, movable)
    return np.asarray(full_energy(chain.problem, moving))


def _tuple(values: Floats) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def curve_csv(curve: Sequence[CurveRow]) -> str:
    """Return the learning curve as CSV: a row for each iteration and term."""
    lines = ["iteration,term,weight,data_loss,model_loss"]
    for row in curve:
        for t, name in enumerate(TERMS):
            lines.append(f"{row.iteration},{name},{row.weights[t]:.6g},{row.data[t]:.6g},{row.model[t]:.6g}")
    return "\n".join(lines) + "\n"
