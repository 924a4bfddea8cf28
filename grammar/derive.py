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

from grammar.categories import Categories
from grammar.constraints import Bound, category_bounds, constrained
from grammar.densities import draw_index, draw_normal, draw_size
from grammar.openings import Attribute, DrawnOpening, draw_opening
from grammar.outlines import area_m2, check_outline, draw_outline
from grammar.parse_tree import ParseTree, Thing
from grammar.request import RequestError, SceneRequest
from grammar.rules import NONE, Grammar, ObjectRule
from grammar.solids import surface_top
from grammar.structure import Choice, count_range, draw_structure
from grammar.walls import wall_lengths
from scene_description import Opening, ParseNode, Room
from scene_description.types import Point2

Size = tuple[float, float, float]


class _Rejected(Exception):
    """The derivation breaks the constraint that the text names."""


class _Address(NamedTuple):
    """Targets that an address may take (object ids, None for nothing) and their probabilities."""

    targets: tuple[int | None, ...]
    probabilities: tuple[float, ...]


def derive(grammar: Grammar, categories: Categories, request: SceneRequest, rng: np.random.Generator) -> ParseTree:
    """Draw one parse tree that meets the request.

    Raises:
        RequestError: no derivation can meet it, or none did within the budget; the line names the constraint.
    """
    _check_request(grammar, request)
    bounds, grammar = category_bounds(grammar, request), constrained(grammar, request)
    outline = check_outline(request.room_polygon_m) if request.room_polygon_m else ()
    reasons: Counter[str] = Counter()
    for _ in range(grammar.budget.derivations):
        try:
            return _derive_once(grammar, categories, request, bounds, outline, rng)
        except _Rejected as rejected:
            reasons[str(rejected)] += 1
    worst, count = reasons.most_common(1)[0]
    raise RequestError(
        f"request: expected a {grammar.room_type} within {grammar.budget.derivations} derivations, got none; {count} failed at: {worst}; "
        "relax that constraint or raise budget.derivations"
    )


def _check_request(grammar: Grammar, request: SceneRequest) -> None:
    if request.room_polygon_m and (request.room_width_m > 0.0 or request.room_depth_m > 0.0):
        raise RequestError("room_polygon_m: expected no room_width_m and room_depth_m beside it, got both; set those to 0")
    least, most = count_range(grammar)
    if request.min_objects > request.max_objects:
        raise RequestError(f"min_objects: expected at most max_objects = {request.max_objects}, got {request.min_objects}")
    if request.max_objects < least:
        raise RequestError(
            f"max_objects: expected at least {least}, the fewest objects of a {grammar.room_type}, got {request.max_objects}"
        )
    if request.min_objects > most:
        raise RequestError(f"min_objects: expected at most {most}, the most objects of a {grammar.room_type}, got {request.min_objects}")


def _derive_once(
    grammar: Grammar,
    categories: Categories,
    request: SceneRequest,
    bounds: Mapping[str, Bound],
    outline: tuple[Point2, ...],
    rng: np.random.Generator,
) -> ParseTree:
    structure = draw_structure(grammar, rng)
    terminals = [i for i, vertex in enumerate(structure) if vertex.kind == "terminal"]
    if not request.min_objects <= len(terminals) <= request.max_objects:
        raise _Rejected(f"number of objects within [{request.min_objects}, {request.max_objects}]")
    rules = [grammar.objects[structure[i].symbol] for i in terminals]
    numbers = Counter(rule.category for rule in rules)
    for category, bound in bounds.items():
        if not bound.least <= numbers[category] <= bound.most:
            raise _Rejected(bound.name)
    sizes = [draw_size(rng, rule) for rule in rules]
    room, room_attributes = _draw_room(grammar, request, outline, rng)
    covered = sum(
        s[0] * s[1] for rule, (s, _) in zip(rules, sizes, strict=True) if rule.mount == "floor" and not categories[rule.category].underlay
    )
    if covered > grammar.room.floor_share_max * area_m2(room.polygon_m):
        raise _Rejected(f"furniture on at most {grammar.room.floor_share_max:g} of the floor")
    openings, opening_counts = _draw_openings(grammar, categories, room, rng)
    room = replace(room, openings=tuple(item.opening for item in openings))

    context = _Context(
        categories,
        room,
        {item.opening.id: item.opening.category for item in openings}
        | {len(openings) + k + 1: structure[i].symbol for k, i in enumerate(terminals)},
        {len(openings) + k + 1: size for k, (size, _) in enumerate(sizes)},
        {len(openings) + k + 1: rule for k, rule in enumerate(rules)},
    )
    drafts = [_draw_thing(len(openings) + k + 1, log, context, rng) for k, (_, log) in enumerate(sizes)]
    nodes = [ParseNode(symbol="scene", kind="or", choice=grammar.room_type), ParseNode(symbol="room", kind="terminal", parent=0)]
    nodes.extend(replace(_attribute_node(attribute, None), parent=1) for attribute in (*room_attributes, *opening_counts))
    for item in openings:
        parent = len(nodes)
        nodes.append(
            ParseNode(symbol=item.opening.category, kind="terminal", parent=1, choice=item.opening.category, object=item.opening.id)
        )
        nodes.extend(replace(_attribute_node(attribute, item.opening.id), parent=parent) for attribute in item.attributes)
    return ParseTree(room=room, things=_append_things(structure, drafts, nodes), nodes=tuple(nodes))


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
            raise _Rejected(f"no arm of the room narrower than {grammar.room.shapes.narrowest_m:g} m")
        polygon, shape = drawn
        attributes.append(shape)
        low, high, area = grammar.room.area_low_m2, grammar.room.area_high_m2, area_m2(polygon)
        if not (request.room_width_m > 0.0 and request.room_depth_m > 0.0) and not low <= area <= high:
            raise _Rejected(f"room area within [{low:g}, {high:g}] m2")
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
                raise _Rejected(f"a wall with space for a {kind}")
            drawn.append(item)
    return drawn, counts


class _Context(NamedTuple):
    """What the addresses of one derivation can point to."""

    categories: Categories
    room: Room
    symbol_of: Mapping[int, str]
    size_of: Mapping[int, Size]
    rule_of: Mapping[int, ObjectRule]


def _draw_thing(identifier: int, size_log: float, context: _Context, rng: np.random.Generator) -> tuple[Thing, list[ParseNode]]:
    """Return one thing and the nodes below its terminal, neither yet with their places in the list of nodes."""
    symbol, size, rule = context.symbol_of[identifier], context.size_of[identifier], context.rule_of[identifier]
    if rule.mount == "wall" and size[1] >= max(wall_lengths(context.room.polygon_m)):
        raise _Rejected(f"a wall as wide as {symbol}")
    bottom, height_log = _draw_bottom(rule, size, context.room, rng)
    below = [_attribute_node(Attribute("size", " x ".join(f"{side:.3f}" for side in size) + " m", size_log), identifier)]
    if rule.centre_height_m is not None:
        below.append(_attribute_node(Attribute("centre_height", f"{bottom + 0.5 * size[2]:.3f} m", height_log), identifier))
    core, stands = None, _Address((), ())
    if rule.cores is not None:
        address = _address(rule.cores, context, list(context.symbol_of))
        if not address.targets:
            raise _Rejected(f"an object that {symbol} belongs to")
        chosen = draw_index(rng, address.probabilities)
        core = address.targets[chosen]
        below.append(
            ParseNode(
                symbol="core",
                kind="address",
                choice=NONE if core is None else str(core),
                log_probability=math.log(address.probabilities[chosen]),
                object=identifier,
            )
        )
    if rule.supporters is not None:
        stands = _address(rule.supporters, context, [target for target in context.rule_of if _fits(context, target, size)])
        if not stands.targets:
            raise _Rejected(f"an object that {symbol} can stand on")
        below.append(ParseNode(symbol="supporter", kind="address", object=identifier))
    thing = Thing(
        id=identifier,
        symbol=symbol,
        rule=rule,
        size_m=size,
        core=core,
        supporters=tuple(target for target in stands.targets if target is not None),
        supporter_log_probability=tuple(math.log(p) for p in stands.probabilities),
        bottom_m=bottom,
        node=0,
        supporter_node=None,
    )
    return thing, below


def _draw_bottom(rule: ObjectRule, size: Size, room: Room, rng: np.random.Generator) -> tuple[float, float]:
    """Return the height of a thing's underside in metres and the log-density of drawing it."""
    if rule.mount == "ceiling":
        return room.height_m - size[2], 0.0
    if rule.centre_height_m is None:
        return 0.0, 0.0
    centre, log = draw_normal(rng, rule.centre_height_m)
    bottom = centre - 0.5 * size[2]
    if bottom < 0.0 or bottom + size[2] > room.height_m:
        raise _Rejected("things on walls between floor and ceiling")
    return bottom, log


def _address(weights: Mapping[str, float], context: _Context, allowed: Sequence[int]) -> _Address:
    """Return the address's distribution over what this room holds: a symbol's weight is shared evenly by its objects."""
    targets: list[int | None] = []
    shares: list[float] = []
    for symbol, weight in weights.items():
        found: list[int | None] = [None] if symbol == NONE else [i for i in allowed if context.symbol_of[i] == symbol]
        if weight > 0.0:
            targets.extend(found)
            shares.extend(weight / len(found) for _ in found)
    return _Address(tuple(targets), tuple(share / sum(shares) for share in shares))


def _fits(context: _Context, target: int, size: Size) -> bool:
    """Return whether a footprint fits on some top of a thing, turned by a quarter or not."""
    category = context.categories[context.rule_of[target].category]
    small, large = sorted(size[:2])
    tops = (sorted(surface_top(surface, context.size_of[target])[1:]) for surface in category.surfaces)
    return any(small <= 2.0 * top[0] and large <= 2.0 * top[1] for top in tops)


def _attribute_node(attribute: Attribute, identifier: int | None) -> ParseNode:
    return ParseNode(
        symbol=attribute.name, kind="attribute", choice=attribute.value, log_probability=attribute.log_probability, object=identifier
    )
