"""Small things in a furnished room: those of the grammar up to the clutter asked for, and those that the counts of its supports add.

The furniture is given and stays as it is.  Every thing has a level of clutter at which it comes and random numbers of its own, so a room at
clutter 2 holds what it holds at 1.5, in the same places, and more.
"""

import itertools
import math
from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.checks.faults import find_faults
from grammar.checks.furnished import furnished
from grammar.checks.validity import check_room
from grammar.derivation.constraints import numbers_asked
from grammar.small_things.fill import TIDY, Filling, Key, Placed, Source
from grammar.small_things.place import Obstacles
from grammar.small_things.sites import Surroundings, opening_boxes
from grammar.small_things.untidy import Move, moves
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule, plain_rule
from grammar.spec.request import SceneRequest
from grammar.spec.rules import Grammar
from scene_description import ParseGraph, ParseNode, Room, SceneObject, ValidityReport

THINNING = 0
"""Names the streams of random numbers of thinning; those of supports have their objects' ids, which count from 1."""


def small_things(
    objects: Sequence[SceneObject], categories: Categories, lamps: Collection[str] = (), kept: Collection[str] = ()
) -> frozenset[int]:
    """Return the ids of the small things among objects: what stands on others, but no lamp, watched screen, or what carries one of these.

    Args:
        objects: of a room.
        categories: their table.
        lamps: categories that give light.
        kept: further categories that are no small things here.
    """
    by_id = {item.id: item for item in objects}
    staying = {
        item.id
        for item in objects
        if item.support.kind != "object" or item.category in (*lamps, *kept) or "screen" in categories[item.category].roles
    }
    for key in tuple(staying):
        below = by_id[key].support.id
        while below in by_id and below not in staying:
            staying.add(below)
            below = by_id[below].support.id
    return frozenset(by_id) - staying


def taken_away(
    objects: Sequence[SceneObject], categories: Categories, lamps: Collection[str], request: SceneRequest, root: int
) -> frozenset[int]:
    """Return the ids of the small things that come above the clutter asked for.

    A thing comes at a level that is uniform between 0 and 1, but not before what it stands on.  What a request asks for at least stays.
    """
    if request.clutter >= 1.0:
        return frozenset()
    fixed = {text.split(":")[0].strip() for text in request.fixed}
    small = small_things(objects, categories, lamps, fixed)
    level: dict[int, float] = {}
    for item in sorted(objects, key=lambda item: (item.position_m[2], item.id)):
        if item.id in small:
            own = float(np.random.default_rng([root, THINNING, item.id]).random())
            level[item.id] = max(own, level.get(item.support.id or 0, 0.0))
    # take away the last to come first
    least: dict[str, int] = {}
    for name, low, _, _ in numbers_asked(request, categories):
        least[name] = max(low, least.get(name, low))
    count, gone = Counter(item.category for item in objects), set[int]()
    by_level = sorted((item for item in objects if item.id in level), key=lambda item: (level[item.id], item.position_m[2]), reverse=True)
    for item in by_level:
        few = count[item.category] <= least.get(item.category, 0) or len(objects) - len(gone) <= request.min_objects
        carries = any(other.support.id == item.id and other.id not in gone for other in objects)
        if level[item.id] >= request.clutter and not few and not carries:
            gone.add(item.id)
            count[item.category] -= 1
    return frozenset(gone)


SYMBOL = "loose_"
"""What the symbols of small things in a parse graph begin with."""

_MAX_SEED = 2**63 - 1


class FurnishedRoom(NamedTuple):
    """A furnished room as its grammar has it: shell, objects, derivation, and the report of its checks."""

    room: Room
    objects: tuple[SceneObject, ...]
    graph: ParseGraph
    report: ValidityReport


class Strewn(NamedTuple):
    """A room with its small things, the ids of those of its objects that come above the clutter asked for, and what may move to where.

    The validity report is that of the room without these.  They are still among the objects, and in the parse graph, so that looks can be
    drawn for the same objects at any clutter.
    """

    furnished: FurnishedRoom
    gone: frozenset[int]
    moved: tuple[SceneObject, ...]
    """Furniture as it is where all that may move has moved, at any clutter."""


def strew(source: Source, lamps: Collection[str], sampled: FurnishedRoom, rng: np.random.Generator) -> Strewn:
    """Return the room with small things.

    Args:
        source: what they are drawn from, with the clutter asked for.
        lamps: categories that give light, which any clutter leaves.
        sampled: the furnished room, as its grammar has it.
        rng: one number is taken from it.
    """
    root = int(rng.integers(_MAX_SEED))
    gone = taken_away(sampled.objects, source.categories, lamps, source.request, root)
    found = _moves(source, sampled, root)
    moved = tuple(move.item for move in found)
    still = frozenset(item.id for item in moved if not item.model.ajar)
    filling = Filling(source, sampled.room, sampled.objects, root, moved, still)
    kept = _kept_moves(source, sampled, gone, found)
    there = _after(sampled.objects, gone, kept)
    added = list(filling.things(there))
    if not gone and not added and not moved:
        return Strewn(sampled, gone, moved)
    added, report = _valid(source, sampled, there, _after(sampled.objects, gone, _in_order(kept)), added)
    graph = _graph(sampled.graph, added, filling)
    room = FurnishedRoom(sampled.room, (*_after(sampled.objects, (), kept), *(thing.item for thing in added)), graph, report)
    return Strewn(room, gone, moved)


def _moves(source: Source, sampled: FurnishedRoom, root: int) -> list[Move]:
    """Return what moves in a room, whatever clutter is asked for; nothing that a request has put where it is."""
    asked = {text.split(":")[0].strip() for text in source.request.fixed}
    around = Surroundings(source.categories, sampled.room, sampled.objects)
    doors = opening_boxes(source.grammar, sampled.room, swings=True)
    swings = Obstacles(doors, np.zeros(len(doors), np.int64))
    found = moves(source.rules, around, sampled.objects, root, source.held, swings)
    return [move for move in found if move.item.category not in asked]


def _kept_moves(source: Source, sampled: FurnishedRoom, gone: Collection[int], found: Sequence[Move]) -> Sequence[Move]:
    """Return of what moves up to the clutter asked for as much as leaves the room valid and in order no odder, the first ones first."""
    rules = rules_of(source.grammar, sampled.graph, sampled.objects)
    moved = [move for move in found if move.level <= source.request.clutter]
    before = len(_faults(source, sampled, _after(sampled.objects, gone, [])))
    for count in range(len(moved), 0, -1):
        now = _after(sampled.objects, gone, moved[:count])
        report = check_room(source.grammar, source.categories, sampled.room, now, rules, sampled.report.attempts)
        if report.valid and len(_faults(source, sampled, _after(sampled.objects, gone, _in_order(moved[:count])))) <= before:
            return moved[:count]
    return []


def _in_order(found: Sequence[Move]) -> list[Move]:
    return [move for move in found if move.level <= TIDY]


def _after(objects: Sequence[SceneObject], gone: Collection[int], found: Sequence[Move]) -> list[SceneObject]:
    """Return the objects that are there, as they have moved."""
    by_id = {move.item.id: move.item for move in found}
    return [by_id.get(item.id, item) for item in objects if item.id not in gone]


def _faults(source: Source, sampled: FurnishedRoom, objects: Sequence[SceneObject]) -> list[int]:
    """Return the ids of the objects of a room that are at fault of use, once for each fault."""
    found = find_faults(furnished(source.grammar.room_type, sampled.room, objects, source.categories), of_layout=True)
    return [key for keys in found.values() for key in keys]


def _valid(
    source: Source, sampled: FurnishedRoom, there: Sequence[SceneObject], in_order: Sequence[SceneObject], added: Sequence[Placed]
) -> tuple[list[Placed], ValidityReport]:
    """Return the things with which the room is valid, and its report: all of them, or those that can be added one after the other.

    Those that come up to clutter 1 add no fault of use either to what is there then, ``in_order``; what comes later is a mess.
    """
    rules, before = rules_of(source.grammar, sampled.graph, sampled.objects), _faults(source, sampled, in_order)
    units = _units(added)
    unit_of = {thing.item.id: first for first, things in units.items() for thing in things}

    def judged(kept: Collection[int]) -> tuple[list[Placed], ValidityReport, Collection[int] | None]:
        """Return the things of these units, the report of the room with them, and the ids of what is at fault; None: it passes."""
        things = [thing for thing in added if unit_of[thing.item.id] in kept]
        known = rules | {item.id: plain_rule(item.category, item.support.kind, item.size_m) for item, *_ in things}
        objects = [*there, *(thing.item for thing in things)]
        report = check_room(source.grammar, source.categories, sampled.room, objects, known, sampled.report.attempts)
        if not report.valid:
            return things, report, [key for check in report.checks if not check.passed for key in check.objects]
        faults = _faults(source, sampled, [*in_order, *(thing.item for thing in things if thing.level <= TIDY)])
        return things, report, None if len(faults) <= len(before) else faults

    # leave out what is at fault; where that is furniture alone, all that stands on nothing, or else all things
    kept, dropped = set(units), set[int]()
    things, report, at_fault = judged(kept)
    while at_fault is not None and kept:
        apart = {first for first in kept if units[first][0].item.support.kind != "object"}
        named = kept & {unit_of.get(key, 0) for key in at_fault} or apart or kept
        kept, dropped = kept - named, dropped | (named & apart)
        things, report, at_fault = judged(kept)

    def add_again(part: Sequence[int], fails: bool) -> bool:
        """Add what fits of some units, and return whether all do; ``fails``: they are known not to."""
        nonlocal things, report
        if part and not fails:
            more, judgement, faulty = judged(kept.union(part))
            if faulty is None:
                kept.update(part)
                things, report = more, judgement
                return True
        if len(part) > 1:
            # where the first half passes, the second one holds what does not
            add_again(part[len(part) // 2 :], add_again(part[: len(part) // 2], False))
        return False

    add_again(sorted(dropped), kept | dropped == set(units))
    return things, report


def _units(added: Sequence[Placed]) -> dict[int, list[Placed]]:
    """Return things by the first one of each unit, with all that stands on it, or on what stands on it, and the members of their groups."""
    first_of: dict[int, int] = {}
    units: dict[int, list[Placed]] = {}
    core = 0
    for thing in added:
        core = thing.item.id if thing.core else core
        below = thing.item.support.id or 0
        first = first_of.get(below, core if thing.core else first_of[core])
        first_of[thing.item.id] = first
        units.setdefault(first, []).append(thing)
    return units


def rules_of(grammar: Grammar, graph: ParseGraph, objects: Sequence[SceneObject]) -> dict[int, ObjectRule]:
    """Return the rule that each object is checked by, by id: of its terminal in the parse graph, else of its category and support.

    Small things have a plain one, since they come only to places that suit them; so has what the grammar does not know.
    """
    symbols = {node.object: node.symbol for node in graph.nodes if node.kind == "terminal"}
    found = {}
    for item in objects:
        symbol = symbols.get(item.id, "")
        known = [] if symbol.startswith(SYMBOL) else [grammar.objects.get(symbol), *grammar.objects.values()]
        fitting = (rule for rule in known if rule and (rule.category, rule.mount) == (item.category, item.support.kind))
        found[item.id] = next(fitting, None) or plain_rule(item.category, item.support.kind, item.size_m)
    return found


def _graph(graph: ParseGraph, added: Sequence[Placed], filling: Filling) -> ParseGraph:
    """Return the parse graph with a Set node for each site that has small things, below its own terminal or the root, and their nodes.

    A group is a Set node of its own, with the terminals of its core and members; an address node below a terminal has the supporter that a
    member chose within the group.
    """
    arrived: Mapping[Key, list[Placed]] = defaultdict(list)
    for thing in added:
        arrived[thing.site].append(thing)
    terminal = {node.object: k for k, node in enumerate(graph.nodes) if node.kind == "terminal" and node.object is not None}
    nodes = list(graph.nodes)
    for site, things in sorted(arrived.items()):
        owner, parent, count = terminal.get(site.owner, 0), len(nodes), sum(thing.core for thing in things)
        odds = _log_poisson(count, filling.mean(site))
        nodes.append(ParseNode(symbol=f"{SYMBOL}things", kind="set", parent=owner, choice=str(count), log_probability=odds))
        for k, thing in enumerate(things):
            if thing.group and thing.core:
                more = sum(1 for _ in itertools.takewhile(lambda other: not other.core, things[k + 1 :]))
                group, symbol = len(nodes), f"{SYMBOL}{thing.group}"
                odds = thing.log_probability
                nodes.append(ParseNode(symbol=symbol, kind="set", parent=parent, choice=str(1 + more), log_probability=odds))
            nodes += _thing_nodes(thing, len(nodes), group if thing.group else parent)
    added_log = sum(node.log_probability for node in nodes[len(graph.nodes) :])
    return replace(graph, nodes=tuple(nodes), log_probability=graph.log_probability + added_log)


def _thing_nodes(thing: Placed, index: int, parent: int) -> list[ParseNode]:
    """Return the terminal of a thing, whose node has this index, and the address node of the supporter that it chose in its group."""
    item, odds = thing.item, 0.0 if thing.group and thing.core else thing.log_probability
    symbol = f"{SYMBOL}{item.category}"
    nodes = [ParseNode(symbol=symbol, kind="terminal", parent=parent, choice=item.category, log_probability=odds, object=item.id)]
    if thing.log_address is not None:
        choice = str(item.support.id)
        nodes.append(ParseNode(symbol=symbol, kind="address", parent=index, choice=choice, log_probability=thing.log_address))
    return nodes


def _log_poisson(count: int, mean: float) -> float:
    """Return the log-probability of a count under a Poisson distribution."""
    return count * math.log(max(mean, 1e-300)) - mean - math.lgamma(count + 1)
