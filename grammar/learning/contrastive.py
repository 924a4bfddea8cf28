"""Weights of the energy terms by contrastive divergence (Hinton, Neural Computation 2002; Jiang et al., IJCV 2018, section 3.1).

The gradient of the log-likelihood in a weight is the mean loss under the model minus that in the data.  The model's mean is replaced by
that of chains which start at the observed layouts and make a few Metropolis-Hastings steps.  A loss that grows on the way is held down
too little, so its weight must rise.  Steps are taken in the logarithm of the weights with the gradient divided by the sum of both means:
losses are positive, in metres or radians, and their weights span orders of magnitude.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grammar.derivation.parse_tree import Item, ParseTree
from grammar.geometry import boxes
from grammar.geometry.arrays import Bools, Floats
from grammar.geometry.boxes import row_penetration
from grammar.geometry.walls import wall_lengths
from grammar.layout import columns as col
from grammar.layout.assemble import assemble
from grammar.layout.energies import full_energy
from grammar.layout.frames import place_object
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import COUNTERS, MoveSettings, Problem, State, copy_state, move_settings
from grammar.learning.assign import AssignedRoom
from grammar.learning.observed import wall_poses
from grammar.spec.categories import Categories
from grammar.spec.energy_terms import ENERGY_TERMS, TERMS, Weights, weight_vector
from grammar.spec.rules import MOVES, Grammar, MoveRule
from scene_description.types import Room

_OVERLAP_M = 0.03
_HEIGHTS_M = 1e-3

_LEAST_LOSS = 1e-6
_LEAST_ROOMS, _LEAST_CLIQUES = 3, 3


def observed_layout(grammar: Grammar, categories: Categories, room: AssignedRoom) -> tuple[Problem, State] | None:
    """Return the problem and the observed state, None if fewer than two objects are left.

    Left out are objects on nothing that the grammar lets carry them, hanging objects away from walls, and the smaller one of two that
    stand deep in each other, since no chain of the grammar leaves them so.  Rooms are taken without doors and windows.
    """
    items = _items(grammar, room)
    while items:
        shell = Room(
            polygon_m=room.room.polygon_m,
            height_m=room.room.height_m,
            wall_thickness_m=grammar.room.wall_thickness_m,
            openings=(),
            surfaces=(),
        )
        tree = ParseTree(room=shell, items=tuple(item for item, _ in items), nodes=())
        problem, state = assemble(grammar, categories, tree)
        bad = _settle(problem, state, room, [index for _, index in items])
        if bad is None:
            return (problem, state) if len(items) >= 2 else None
        gone = {items[bad][0].id}
        items = _renumbered([pair for pair in items if pair[0].id not in gone], gone)
    return None


def _items(grammar: Grammar, room: AssignedRoom) -> list[tuple[Item, int]]:
    """Return a placed object for each observed one that can take part, with the index of that; ids count from 1."""
    items: list[tuple[Item, int]] = []
    dropped: set[int] = set()
    longest = max(wall_lengths(room.room.polygon_m))
    for i, seen in enumerate(room.objects):
        rule = grammar.objects[seen.symbol]
        supported = seen.on is not None and bool(rule.supporters) and room.objects[seen.on].symbol in (rule.supporters or {})
        if (rule.mount == "object") != (seen.on is not None) or (rule.mount == "object" and not supported):
            dropped.add(i + 1)
        elif (rule.mount == "wall" and seen.seen.size_m[1] >= longest) or rule.mount == "ceiling":
            dropped.add(i + 1)
        share = (rule.supporters or {}).get(room.objects[seen.on].symbol, 0.0) if supported and seen.on is not None else 0.0
        item = Item(
            id=i + 1,
            symbol=seen.symbol,
            rule=rule,
            size_m=seen.seen.size_m,
            core=seen.core + 1 if seen.core is not None else None,
            supporters=(seen.on + 1,) if supported and seen.on is not None else (),
            supporter_log_probability=(math.log(max(share, 1e-6)),) if supported else (),
            bottom_m=max(seen.seen.position_m[2], 0.0) if rule.mount == "wall" else 0.0,
            node=0,
            supporter_node=None,
        )
        items.append((item, i))
    return _renumbered([pair for pair in items if pair[0].id not in dropped], dropped)


def _renumbered(items: Sequence[tuple[Item, int]], gone: set[int]) -> list[tuple[Item, int]]:
    """Return the objects with ids from 1 and references that follow; what stands on an object that is gone goes too."""
    kept = list(items)
    while any(set(item.supporters) & gone for item, _ in kept):
        gone = gone | {item.id for item, _ in kept if set(item.supporters) & gone}
        kept = [pair for pair in kept if pair[0].id not in gone]
    number = {item.id: k + 1 for k, (item, _) in enumerate(kept)}
    return [
        (
            replace(
                item,
                id=number[item.id],
                core=number.get(item.core) if item.core is not None else None,
                supporters=tuple(number[target] for target in item.supporters),
            ),
            index,
        )
        for item, index in kept
    ]


def _settle(problem: Problem, state: State, room: AssignedRoom, indices: Sequence[int]) -> int | None:
    """Write the observed poses; return the index of an object that cannot stay, None if all can."""
    for k, index in enumerate(indices):
        seen = room.objects[index].seen
        state.pose[k] = seen.position_m[0], seen.position_m[1], seen.yaw_rad
        state.active[k] = True
        if problem.mount[k] == col.OBJECT:
            surfaces = problem.targets(k)
            if len(surfaces) == 0:
                return k
            below = int(problem.surface_owner[surfaces[0]])
            base = room.objects[indices[below]].seen.position_m[2]
            height = problem.surface[:, col.SURFACE_Z]
            state.surface[k] = surfaces[int(np.argmin([abs(base + height[surface] - seen.position_m[2]) for surface in surfaces]))]
            state.z[k] = height[state.surface[k]] + (base if problem.mount[below] == col.OBJECT else 0.0)
        elif problem.mount[k] == col.WALL:
            near = [at for at in wall_poses(room.room.polygon_m, seen) if abs(at.turn_rad) < 0.1 and abs(at.gap_m) < 0.1]
            if not near:
                return k
            state.on_wall[k] = min(near, key=lambda at: abs(at.gap_m)).wall
            start_x, start_y, along_x, along_y, length, normal_x, normal_y, wall_yaw, _ = problem.wall[state.on_wall[k]]
            along = (seen.position_m[0] - start_x) * along_x + (seen.position_m[1] - start_y) * along_y
            depth, width = problem.object[k, [col.HALF_DEPTH, col.HALF_WIDTH]]
            if length < 2.0 * width:
                return k
            along = min(max(along, width), length - width)
            state.pose[k] = start_x + along_x * along + normal_x * depth, start_y + along_y * along + normal_y * depth, wall_yaw
        place_object(problem, state, k)
    return _deepest(problem, state)


def _deepest(problem: Problem, state: State) -> int | None:
    """Return the smaller one of the two objects that overlap most, None if none does by much."""
    worst, found = _OVERLAP_M, None
    solids = [range(link[col.SOLIDS], link[col.ZONES]) for link in problem.link]
    owner = np.repeat(np.arange(len(solids)), [len(rows) for rows in solids])
    solid = state.placed[[row for rows in solids for row in rows]]
    area = problem.object[:, col.HALF_DEPTH] * problem.object[:, col.HALF_WIDTH]
    for a in range(len(solid)):
        for b in range(a + 1, len(solid)):
            shared = min(solid[a, boxes.Z_HIGH], solid[b, boxes.Z_HIGH]) - max(solid[a, boxes.Z_LOW], solid[b, boxes.Z_LOW])
            if owner[a] != owner[b] and shared > _HEIGHTS_M:
                depth = row_penetration(solid, a, solid, b)
                if depth > worst:
                    worst = depth
                    found = int(min(owner[a], owner[b], key=lambda i: float(area[i])))
    return found


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
    run = ChainRun(options.sweeps * len(movable), beta, grammar.schedule.hard_tolerance)
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
