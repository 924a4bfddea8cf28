"""Ancestral sampling: grammar and request -> parse tree, with the log-probability of every choice.

Structure, room, sizes, openings and addresses are drawn from the root down.  A derivation that breaks a constraint (number of objects,
share of the floor, something that has nothing to stand on) is thrown away and drawn again within a budget; the log-probabilities are those
of the grammar (with the clutter asked for, without the categories that must not appear), not of the grammar given the other constraints.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from grammar.derivation.addresses import Draft, RejectedError, address_things, units_above
from grammar.derivation.constraints import Bound, category_bounds, constrained, count_range, number_range
from grammar.derivation.counting import Conditional, conditional
from grammar.derivation.counting import Counter as NumberOf
from grammar.derivation.densities import draw_index, draw_normal, draw_size
from grammar.derivation.fixed import Fixed, Pinned, check_fixed, conflict, matched, own_rule, pin, read_fixed
from grammar.derivation.openings import Attribute, DrawnOpening, draw_opening
from grammar.derivation.outlines import check_outline, draw_outline
from grammar.derivation.overrides import overridden
from grammar.derivation.parse_tree import ParseTree, Thing
from grammar.derivation.structure import Choice, draw_structure
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar, ObjectRule
from scene_description import Opening, ParseNode, Room
from scene_description.polygons import signed_area_m2
from scene_description.strict import shorten
from scene_description.types import Point2

Size = tuple[float, float, float]

_RARE = 0.2
"""Structures are drawn given their numbers of objects where fewer than this share would meet the bounds."""

_LONGEST_TEXT = 200

_COUNTED_COST = 10
"""A structure drawn given its numbers takes the time of so many others, but none is thrown away for its numbers."""


def derive(grammar: Grammar, categories: Categories, request: SceneRequest, rng: np.random.Generator) -> ParseTree:
    """Draw one parse tree that meets the request.

    Raises:
        RequestError: no derivation can meet it, or none did within the budget; the line names the constraint.
    """
    plan = make_plan(grammar, categories, request)
    reasons: Counter[str] = Counter()
    budget = grammar.budget.derivations if plan.counted is None else max(grammar.budget.derivations // _COUNTED_COST, 1)
    for _ in range(budget):
        try:
            return _derive_once(plan, categories, rng)
        except RejectedError as rejected:
            reasons[str(rejected)] += 1
    worst = "; ".join(f"{count} failed at: {reason}" for reason, count in reasons.most_common(3))
    raise RequestError(
        f"request: expected a {grammar.room_type} within {budget} derivations, got none; {worst}; "
        "relax that constraint or raise budget.derivations"
    )


class Plan(NamedTuple):
    """A request made ready: the grammar that it leaves, bounds by category, the outline that it gives or (), fixed objects.

    ``known`` are the names that the grammar knows; ``counted`` draws structures where those drawn freely would seldom do.
    """

    grammar: Grammar
    request: SceneRequest
    bounds: Mapping[str, Bound]
    outline: tuple[Point2, ...]
    items: tuple[Fixed, ...]
    known: frozenset[str]
    counted: Conditional | None


def make_plan(grammar: Grammar, categories: Categories, request: SceneRequest) -> Plan:
    """Check a request as far as that can be done without drawing, and fold it into the grammar.

    Raises:
        RequestError: a constraint cannot be met; the line names it.
    """
    for name in ("must_have", "must_not", "counts", "sizes", "fixed", "weights", "odds", "validity"):
        for text in getattr(request, name):
            if not text.isprintable() or len(text) > _LONGEST_TEXT:
                raise RequestError(f"{name}: expected printable texts of at most {_LONGEST_TEXT} characters, got {shorten(text)}")
    if request.room_polygon_m and (request.room_width_m > 0.0 or request.room_depth_m > 0.0):
        raise RequestError("room_polygon_m: expected no room_width_m and room_depth_m beside it, got both; set those to 0")
    if request.min_objects > request.max_objects:
        raise RequestError(f"min_objects: expected at most max_objects = {request.max_objects}, got {request.min_objects}")
    for name in request.must_not:
        if name not in categories and name not in grammar.objects:
            raise RequestError(f"must_not: {name}: expected a category of categories.yaml, got an unknown one")
    items, changed = read_fixed(request), overridden(grammar, request)
    check_fixed(changed, categories, items)
    bounds, changed = category_bounds(changed, request), constrained(grammar, request)
    known = frozenset(name for symbol, rule in changed.objects.items() for name in (symbol, rule.category))
    extras = sum(item.name not in known for item in items)
    least, most = (number + extras for number in count_range(changed))
    if request.max_objects < least:
        raise RequestError(
            f"max_objects: expected at least {least}, the fewest objects of a {grammar.room_type}, got {request.max_objects}"
        )
    if request.min_objects > most:
        raise RequestError(f"min_objects: expected at most {most}, the most objects of a {grammar.room_type}, got {request.min_objects}")
    outline = check_outline(request.room_polygon_m) if request.room_polygon_m else ()
    counters = [NumberOf(name.name, name.symbols, name.least, name.most) for key, name in bounds.items() if key not in changed.openings]
    if request.min_objects > least or request.max_objects < most:
        name = f"number of objects within [{request.min_objects}, {request.max_objects}]"
        bound = max(request.min_objects - extras, 0), request.max_objects - extras
        counters.insert(0, NumberOf(name, frozenset(changed.objects), *bound))
    counted = conditional(changed, counters, lambda counter: number_range(changed, lambda s: int(s in counter.symbols))[1], _RARE)
    return Plan(changed, request, bounds, outline, items, known, counted)


def _derive_once(plan: Plan, categories: Categories, rng: np.random.Generator) -> ParseTree:
    grammar, request = plan.grammar, plan.request
    structure = draw_structure(grammar, rng) if plan.counted is None else plan.counted.draw(rng)
    extras = [item for item in plan.items if item.name not in plan.known]
    structure.extend(Choice(f"fixed_{item.name}", "terminal", -1, item.name, 0.0) for item in extras)
    terminals = [i for i, vertex in enumerate(structure) if vertex.kind == "terminal"]
    if not request.min_objects <= len(terminals) <= request.max_objects:
        raise RejectedError(f"number of objects within [{request.min_objects}, {request.max_objects}]")
    symbols = [structure[i].symbol for i in terminals]
    for name, bound in plan.bounds.items():
        if name not in grammar.openings and not bound.least <= sum(symbol in bound.symbols for symbol in symbols) <= bound.most:
            raise RejectedError(bound.name)
    rules = [grammar.objects[symbol] for symbol in symbols[: len(symbols) - len(extras)]] + [own_rule(item) for item in extras]
    places = _match(plan, symbols, rules)
    sizes = [_size(plan, places.get(k), rule, rng) for k, rule in enumerate(rules)]
    room, room_attributes = _draw_room(grammar, request, plan.outline, rng)
    covered = sum(
        s[0] * s[1] for rule, s in zip(rules, sizes, strict=True) if rule.mount == "floor" and not categories[rule.category].underlay
    )
    if covered > grammar.room.floor_share_max * signed_area_m2(room.polygon_m):
        raise RejectedError(f"furniture on at most {grammar.room.floor_share_max:g} of the floor")
    pinned = _pin(plan, categories, room, places, rules, sizes, rng)
    openings, opening_counts = _draw_openings(grammar, categories, room, rng)
    room = replace(room, openings=tuple(item.opening for item in openings))
    against = conflict(grammar, categories, room, [(plan.items[places[k]], rules[k], sizes[k], place) for k, place in pinned.items()])
    if against is not None:
        raise RejectedError(against)
    first = len(openings) + 1
    thing_of = {item: first + k for k, item in places.items()}
    drafts = [
        Draft(id=first + k, symbol=symbols[k], rule=rules[k], size_m=sizes[k], units=units_above(structure, i))
        for k, i in enumerate(terminals)
    ]
    for k, place in pinned.items():
        drafts[k].pinned = place if place.on is None else place._replace(on=thing_of[place.on])
    things, corners = address_things(categories, room, drafts, rng)
    nodes = [ParseNode(symbol="scene", kind="or", choice=grammar.room_type), ParseNode(symbol="room", kind="terminal", parent=0)]
    nodes.extend(replace(_attribute_node(attribute, None), parent=1) for attribute in (*room_attributes, *opening_counts))
    for item in openings:
        parent = len(nodes)
        nodes.append(
            ParseNode(symbol=item.opening.category, kind="terminal", parent=1, choice=item.opening.category, object=item.opening.id)
        )
        nodes.extend(replace(_attribute_node(attribute, item.opening.id), parent=parent) for attribute in item.attributes)
    return ParseTree(
        room=room,
        things=_append_things(structure, things, nodes),
        nodes=tuple(nodes),
        corners=tuple((corner.x_m, corner.y_m, corner.yaw_rad) for corner in corners),
    )


def _match(plan: Plan, symbols: Sequence[str], rules: Sequence[ObjectRule]) -> dict[int, int]:
    """Return for the terminals that fixed objects take which of these it is."""
    found = matched(plan.items, symbols, rules)
    if found is None:
        raise RejectedError("fixed: an object of the grammar for each fixed one")
    return found


def _size(plan: Plan, item: int | None, rule: ObjectRule, rng: np.random.Generator) -> Size:
    asked = None if item is None else plan.items[item].size_m
    return draw_size(rng, rule)[0] if asked is None else asked


def _pin(
    plan: Plan,
    categories: Categories,
    room: Room,
    places: Mapping[int, int],
    rules: Sequence[ObjectRule],
    sizes: Sequence[Size],
    rng: np.random.Generator,
) -> dict[int, Pinned]:
    """Return for the terminals that fixed objects take where they stay; ``on`` is still a place in the list of fixed objects."""
    terminal_of = {item: k for k, item in places.items()}
    pinned: dict[int, Pinned] = {}
    for item, fixed in enumerate(plan.items):
        k = terminal_of[item]
        below = None
        if fixed.on is not None:
            carrier = terminal_of[fixed.on]
            below = (rules[carrier].category, sizes[carrier], pinned[carrier])
        height = rules[k].centre_height_m
        bottom = room.height_m - sizes[k][2] if rules[k].mount == "ceiling" else 0.0
        if height is not None:
            bottom = draw_normal(rng, height)[0] - 0.5 * sizes[k][2]
        place = pin(fixed, rules[k], sizes[k], bottom, room, below, categories)
        if isinstance(place, str):
            raise RejectedError(place)
        pinned[k] = place._replace(sized=fixed.size_m is not None)
    return pinned


def _append_things(
    structure: Sequence[Choice], drafts: Sequence[tuple[Thing, list[ParseNode]]], nodes: list[ParseNode]
) -> tuple[Thing, ...]:
    """Append the structure's vertices and what hangs below the things to ``nodes``; return the things with their places there."""
    index_of = {-1: 0}
    things: list[Thing] = []
    for i, vertex in enumerate(structure):
        parent, index = index_of[vertex.parent], len(nodes)
        index_of[i] = index
        if vertex.kind == "terminal":
            thing, below = drafts[len(things)]
            nodes.append(ParseNode(symbol=vertex.symbol, kind="terminal", parent=parent, choice=vertex.choice, object=thing.id))
            nodes.extend(replace(node, parent=index) for node in below)
            last = len(nodes) - 1 if thing.supporters else None
            things.append(replace(thing, node=index, supporter_node=last))
        else:
            nodes.append(
                ParseNode(
                    symbol=vertex.symbol, kind=vertex.kind, parent=parent, choice=vertex.choice, log_probability=vertex.log_probability
                )
            )
    return tuple(things)


def _draw_room(
    grammar: Grammar, request: SceneRequest, outline: tuple[Point2, ...], rng: np.random.Generator
) -> tuple[Room, list[Attribute]]:
    attributes, sides = [], []
    for name in () if outline else ("width_m", "depth_m"):
        asked = getattr(request, f"room_{name}")
        side, log = (asked, 0.0) if asked > 0.0 else draw_normal(rng, getattr(grammar.room, name))
        sides.append(side)
        attributes.append(Attribute(name, f"{side:.3f} m{' (requested)' if asked > 0.0 else ''}", log))
    height, log = draw_normal(rng, grammar.room.height_m)
    attributes.append(Attribute("height_m", f"{height:.3f} m", log))
    polygon = outline
    if outline:
        attributes.append(Attribute("shape", f"outline with {len(outline)} walls (requested)", 0.0))
    else:
        drawn = draw_outline(rng, grammar.room.shapes, sides[0], sides[1])
        if drawn is None:
            raise RejectedError(f"no arm of the room narrower than {grammar.room.shapes.narrowest_m:g} m")
        polygon, shape = drawn
        attributes.append(shape)
        low, high, area = grammar.room.area_low_m2, grammar.room.area_high_m2, signed_area_m2(polygon)
        if not (request.room_width_m > 0.0 and request.room_depth_m > 0.0) and not low <= area <= high:
            raise RejectedError(f"room area within [{low:g}, {high:g}] m2")
    return Room(polygon_m=polygon, height_m=height, wall_thickness_m=grammar.room.wall_thickness_m, openings=(), surfaces=()), attributes


def _draw_openings(
    grammar: Grammar, categories: Categories, room: Room, rng: np.random.Generator
) -> tuple[list[DrawnOpening], list[Attribute]]:
    """Return the openings of a room and how many of each kind were drawn."""
    drawn: list[DrawnOpening] = []
    counts: list[Attribute] = []
    kinds: tuple[Literal["door", "window"], ...] = ("door", "window")
    for kind in kinds:
        rule = grammar.openings[kind]
        copies = draw_index(rng, rule.multiplicity)
        counts.append(Attribute(f"{kind}_count", str(copies), math.log(rule.multiplicity[copies])))
        for _ in range(copies):
            others: list[Opening] = [item.opening for item in drawn]
            item = draw_opening(kind, rule, len(drawn) + 1, categories[kind].label_id, room.polygon_m, room.height_m, others, rng)
            if item is None:
                raise RejectedError(f"a wall with space for a {kind}")
            drawn.append(item)
    return drawn, counts


def _attribute_node(attribute: Attribute, identifier: int | None) -> ParseNode:
    return ParseNode(
        symbol=attribute.name, kind="attribute", choice=attribute.value, log_probability=attribute.log_probability, object=identifier
    )
