"""Request -> valid furnished room: parse tree, layout, exact checks, and again until it passes.

A structure gets several layouts before another one is drawn, and a chain several rounds before it starts afresh, so that the checks change
the distribution of structures as little as possible.  Valid layouts that a person would find odd are passed over, so many as the budget
has, while their chain runs on for a few rounds; then the least odd one is taken.  Furniture gets, of some draws of doors and windows, those
between which it fits best, as layouts that are begun tell.  Whether it does, and whether other structures take the place of one whose
layouts are all odd, is the budget's ``gate``: where they do, as in the grammars that come with the program, finished rooms have structures
and places of doors and windows with other probabilities than the grammar says; the parse graph tells those of the grammar.
"""

import math
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from grammar.checks.faults import always_odd, find_faults, oddly_seated
from grammar.checks.furnished import furnished
from grammar.checks.metrics import SamplingCost
from grammar.checks.validity import check_room, door_start_m
from grammar.derivation.derive import Kept, derive_from
from grammar.derivation.overrides import overridden
from grammar.derivation.parse_tree import Item, ParseTree
from grammar.derivation.plan import Plan, make_plan
from grammar.geometry.arrays import Floats
from grammar.geometry.slopes import low_ceiling
from grammar.layout.assemble import assemble
from grammar.layout.circulation import empty_floor
from grammar.layout.columns import TRIED, YAW, X, Y, Z
from grammar.layout.entrants import Begun
from grammar.layout.floor_raster import NO_FLOOR, Floor
from grammar.layout.mcmc import Chain
from grammar.layout.problem import Problem, State, move_settings
from grammar.layout.schedule import begin, run_stages, run_together
from grammar.spec.categories import Categories
from grammar.spec.energy_terms import FLOOR_TERMS, TERMS
from grammar.spec.grammar_file import room_needs
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar
from scene_description import ModelReference, ParseGraph, Room, SceneObject, Support, ValidityReport

_MAX_SEED = 2**63 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledRoom:
    """A valid room before it gets materials: openings and objects have no parts, models no style, the room no surfaces."""

    room: Room
    objects: tuple[SceneObject, ...]
    parse_graph: ParseGraph
    validity: ValidityReport


def sample_room(grammar: Grammar, categories: Categories, request: SceneRequest, rng: np.random.Generator) -> SampledRoom:
    """Sample a valid room; see :func:`sample_room_with_cost`."""
    return sample_room_with_cost(grammar, categories, request, rng)[0]


def sample_room_with_cost(
    grammar: Grammar, categories: Categories, request: SceneRequest, rng: np.random.Generator
) -> tuple[SampledRoom, SamplingCost]:
    """Sample a valid room and tell what it cost; the same state of ``rng`` gives the same room.

    Raises:
        RequestError: no room meets the request, or none was valid within the budget; the line names the constraint.
    """
    if request.room_type != grammar.room_type:
        raise RequestError(
            f"room_type: expected the grammar's '{grammar.room_type}', got '{request.room_type}'; read the grammar of that type"
        )
    grammar = overridden(grammar, request)
    beta = request.beta if request.beta > 0.0 else grammar.schedule.beta
    attempts, odd, meter = 0, 0, _Meter()
    best: _Candidate | None = None
    failures: Counter[str] = Counter()
    for tree, problem, layout, energy in _tries(grammar, categories, request, beta, rng, meter):
        attempts += 1
        meter.odd = 0
        if layout is None:
            failures["layout without overlaps"] += 1
            continue
        objects = _objects(tree, categories, problem, layout)
        report = check_room(grammar, categories, tree.room, objects, {item.id: item.rule for item in tree.items}, attempts)
        failures.update(check.name for check in report.checks if not check.passed)
        if not report.valid:
            continue
        # keep the layout that a person would find least odd
        meter.valid = True
        faults = find_faults(furnished(grammar.room_type, tree.room, objects, categories), of_layout=True)
        found = sum(map(len, faults.values()))
        if best is None or found < best.faults:
            best = _Candidate(found, tree.room, objects, report, _parse_graph(grammar, tree, layout, problem, energy))
        odd += found > 0
        meter.odd = found
        if not found or odd > grammar.budget.odd:
            break
    if best is not None:
        cost = SamplingCost(attempts=attempts, proposals=meter.proposals, chain_s=meter.seconds)
        return _finished(best, attempts, rng), cost
    if meter.refused is not None:
        raise meter.refused
    worst = ", ".join(f"{name} ({count})" for name, count in failures.most_common(3))
    raise RequestError(
        f"request: expected a valid {grammar.room_type} within {attempts} layouts, got none; most failed at {worst}; "
        "ask for a larger room or fewer objects, or raise the budget"
    )


class _Candidate(NamedTuple):
    """A valid layout and how many objects it has at fault."""

    faults: int
    room: Room
    objects: tuple[SceneObject, ...]
    report: ValidityReport
    graph: ParseGraph


def _finished(best: _Candidate, attempts: int, rng: np.random.Generator) -> SampledRoom:
    """Return a layout as the room, with seeds for the models of its objects."""
    seeds = rng.integers(_MAX_SEED, size=len(best.objects))
    objects = tuple(replace(item, model=replace(item.model, seed=int(seed))) for item, seed in zip(best.objects, seeds, strict=True))
    report = replace(best.report, attempts=attempts)
    return SampledRoom(room=best.room, objects=objects, parse_graph=best.graph, validity=report)


class _Meter:
    """Adds up proposals and processor seconds of chains.

    ``odd``: objects at fault in the last layout if that was valid; ``valid``: whether any was; ``refused``: why no further structure was
    found, where that ended the search.
    """

    def __init__(self) -> None:
        self.proposals, self.seconds, self.odd, self.valid = 0, 0.0, 0, False
        self.refused: RequestError | None = None

    def __enter__(self) -> None:
        self.seconds -= time.thread_time()

    def __exit__(self, *_: object) -> None:
        self.seconds += time.thread_time()


def room_floor(grammar: Grammar, room: Room) -> Floor:
    """Return the raster of the unfurnished room, which the chain keeps if a term that is read off it has a weight."""
    if not any(getattr(grammar.weights, name) for name in FLOOR_TERMS):
        return NO_FLOOR
    limits = grammar.validity
    return empty_floor(room.polygon_m, door_start_m(room, limits.robot_radius_m), limits, low_ceiling(room, limits.robot_height_m))


def _tries(
    grammar: Grammar, categories: Categories, request: SceneRequest, beta: float, rng: np.random.Generator, meter: _Meter
) -> Iterator[tuple[ParseTree, Problem, State | None, Floats]]:
    """Yield layouts of one structure after the other until the budget is spent, or no further structure is found."""
    plan, kept, moves = make_plan(grammar, categories, request), Kept(), move_settings(grammar.moves)
    for number in range(grammar.budget.structures):
        try:
            trees = [_structure(plan, categories, kept, rng), *kept.reopened(plan, categories, rng)]
        except RequestError as refused:
            if not number:
                raise
            meter.refused = refused
            return
        rooms = [assemble(grammar, categories, tree, beta) for tree in trees]
        for _ in range(grammar.budget.layouts):
            with meter:
                begun = begin(rng, rooms, moves, grammar.schedule, beta)
            tree, problem = trees[begun.room], rooms[begun.room][0]
            for layout, energy in _rounds(grammar, Chain(problem, moves, room_floor(grammar, tree.room)), begun, beta, rng, meter):
                yield tree, problem, layout, energy
        if meter.valid and grammar.budget.gate == "layouts":
            return


def _structure(plan: Plan, categories: Categories, kept: Kept, rng: np.random.Generator) -> ParseTree:
    """Draw a structure; those whose every layout is odd are passed over, so many as the budget has and if its gate does so."""
    for _ in range(plan.grammar.budget.odd if plan.grammar.budget.gate == "structures" else 0):
        tree = derive_from(plan, categories, rng, kept)
        names = [item.rule.category for item in tree.items]
        if not always_odd(categories, names, room_needs(plan.grammar.room_type).company) and not oddly_seated(categories, tree.items):
            return tree
    return derive_from(plan, categories, rng, kept)


def _rounds(
    grammar: Grammar, chain: Chain, begun: Begun, beta: float, rng: np.random.Generator, meter: _Meter
) -> Iterator[tuple[State | None, Floats]]:
    """Yield layouts of a chain, one a round, until the budget is spent.

    There are more rounds after an odd layout as long as each has fewer objects at fault: what is wrong twice stays so.
    """
    schedule = grammar.schedule
    with meter:
        result = run_stages(rng, chain, begun, schedule, beta)
    meter.proposals += int(result.counts[:, TRIED].sum())
    yield result.layout, result.energy
    left, mends, before = grammar.budget.rounds - 1, grammar.budget.mends, math.inf
    while len(result.trace.energy) and (mends > 0 and meter.odd < before if meter.odd else left > 0):
        left, mends, before = left - 1, mends - (meter.odd > 0), meter.odd or before
        with meter:
            result = run_together(rng, chain, result.state, schedule, beta, schedule.again)
        meter.proposals += int(result.counts[:, TRIED].sum())
        yield result.layout, result.energy


def _objects(tree: ParseTree, categories: Categories, problem: Problem, layout: State) -> tuple[SceneObject, ...]:
    return tuple(
        SceneObject(
            id=item.id,
            category=item.rule.category,
            label=categories[item.rule.category].label_id,
            size_m=item.size_m,
            position_m=(float(layout.where[item.id - 1, X]), float(layout.where[item.id - 1, Y]), float(layout.where[item.id - 1, Z])),
            yaw_rad=float(layout.where[item.id - 1, YAW]),
            support=_support(item, problem, layout),
            group=item.core if item.core is not None and item.core <= tree.items[-1].id else None,
            model=ModelReference(generator=item.rule.category),
            parts=(),
        )
        for item in tree.items
    )


def _support(item: Item, problem: Problem, layout: State) -> Support:
    mount = item.rule.mount
    if mount == "object":
        return Support(kind=mount, id=int(problem.surface_owner[layout.surface[item.id - 1]]) + 1)
    return Support(kind=mount, wall=int(layout.on_wall[item.id - 1]) if mount == "wall" else None)


def _parse_graph(grammar: Grammar, tree: ParseTree, layout: State, problem: Problem, energy: Floats) -> ParseGraph:
    """Return the derivation with the supporters that the layout chose; their probabilities are the energy's support_address."""
    nodes = list(tree.nodes)
    for item in tree.items:
        if item.supporter_node is not None:
            supporter = int(problem.surface_owner[layout.surface[item.id - 1]]) + 1
            nodes[item.supporter_node] = replace(nodes[item.supporter_node], choice=str(supporter))
    weights = {name: float(getattr(grammar.weights, name)) for name in TERMS}
    energies = dict(zip(TERMS, energy.tolist(), strict=True))
    return ParseGraph(
        nodes=tuple(nodes),
        log_probability=float(sum(node.log_probability for node in nodes)),
        energies=energies,
        weights=weights,
        energy=float(sum(weights[name] * energies[name] for name in TERMS)),
    )
