"""Ancestral sampling: grammar and request -> parse tree, with the log-probability of every choice.

Structure, sizes, room, openings and addresses are drawn from the root down.  A derivation that breaks a constraint (number of objects,
share of the floor, an object without a supporter) is rejected and drawn again within a budget.  The log-probabilities are those of the
grammar (with the clutter asked for, without the excluded categories), not of the grammar given the other constraints.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.derivation.addresses import check_targets, draw_addresses
from grammar.derivation.crowding import used_share, wall_share
from grammar.derivation.densities import draw_height, draw_size
from grammar.derivation.drafts import Draft, Size, units_above
from grammar.derivation.fixed import FixedObject, check_pinned, match_terminals, pin, rule_of_fixed
from grammar.derivation.openings import DrawnOpening, SpecialWalls, draw_numbers, draw_openings, numbers_fit
from grammar.derivation.parse_tree import (
    Attribute,
    BelowSlopesError,
    Item,
    ParseTree,
    Pinned,
    RejectedError,
    UnfitFurnitureError,
    attribute_node,
)
from grammar.derivation.plan import Plan, make_plan
from grammar.derivation.shell import DrawnSize, check_covered, draw_covered_m2, draw_extent, draw_room, is_given
from grammar.derivation.slopes import check_tall, draw_slopes, loaded_heights_m
from grammar.derivation.structure import Vertex, draw_structure
from grammar.derivation.unit_rows import place_unit_rows
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar
from scene_description import ParseNode, Room
from scene_description.polygons import signed_area_m2

_CONDITIONAL_COST = 10
"""Drawing a structure given its numbers of objects takes the time of so many free ones, but none is rejected for its numbers."""
_SAME_EXTENT, _SAME_SIZE = 300, 4
"""Derivations in a row with one drawn area (one in fifty suits a kitchen of 6 m2), and how many that suit a size of a mixture may fail."""

_OPENINGS_TRIED = 4
"""Places of doors and windows that are tried for one room, so that a structure that fits between some is not given up."""

_BELOW_SLOPES = 300
"""Derivations for which no sloped ceiling is found before a request for one is refused."""

_CEILINGS_TRIED = 5
"""Draws of sloped ceilings, doors and windows for one structure, the eaves higher each time."""


def derive(grammar: Grammar, categories: Categories, request: SceneRequest, rng: np.random.Generator) -> ParseTree:
    """Draw one parse tree that meets the request.

    Raises:
        RequestError: no derivation can meet it, or none did within the budget; the line names the constraint.
    """
    return derive_from(make_plan(grammar, categories, request), categories, rng)


class _Terminals(NamedTuple):
    """The regular terminals of a structure, in depth-first order: their vertices, symbols, rules, sizes.

    ``fixed``: number of the terminal -> number of the fixed object that takes its place.
    """

    vertices: list[int]
    symbols: list[str]
    rules: list[ObjectRule]
    sizes: list[Size]
    fixed: dict[int, int]


class _Contents(NamedTuple):
    """What is to be in the room: the structure, its terminals, how high each may be with what stands on it, and where fixed ones stay."""

    structure: list[Vertex]
    terminals: _Terminals
    loaded_m: Sequence[float]
    pinned: Mapping[int, Pinned]

    @property
    def things(self) -> list[tuple[str, ObjectRule, Size]]:
        """Symbols, rules and sizes."""
        return list(zip(self.terminals.symbols, self.terminals.rules, self.terminals.sizes, strict=True))


class Furniture(NamedTuple):
    """Furniture and the room that was drawn for it, without openings.

    ``special``: walls of the room; ``attributes``: how it was drawn; ``numbers``: of openings of each kind, for all their places.
    """

    contents: _Contents
    room: Room
    special: SpecialWalls
    attributes: Sequence[Attribute]
    numbers: Mapping[str, int]


class Kept:
    """What is kept from one derivation to the next while no layout is found: size and openings of a room, and furniture that suits it.

    So a small room stays small and one with many doors keeps these where it is the furniture that does not fit, and furniture stays where
    it is the places of the doors that are in its way.
    One size of a mixture goes with the last of ``_SAME_SIZE`` sets of furniture that suit it and find no room, of which one counts twice
    that finds a room but no layout with any of ``_OPENINGS_TRIED`` draws of doors and windows; the caller asks for all but the first of
    these.  An area goes with the first set that finds a room.
    """

    def __init__(self) -> None:
        self._drawn: DrawnSize | None = None
        self._numbers: Mapping[str, int] | None = None
        self._tried = self._suited = 0
        self._furniture: Furniture | None = None

    @property
    def _is_of_mixture(self) -> bool:
        return self._drawn is not None and self._drawn.component is not None

    def size(self, plan: Plan, rng: np.random.Generator) -> DrawnSize | None:
        """Return the size for the next derivation."""
        if self._tried % _SAME_EXTENT == 0 or (self._suited >= _SAME_SIZE and self._is_of_mixture):
            self._drawn, self._tried, self._suited, self._numbers = draw_extent(plan.grammar.room, plan.request, rng), 0, 0, None
        self._tried += 1
        return self._drawn

    def numbers(self, grammar: Grammar, room: Room, rng: np.random.Generator) -> Mapping[str, int]:
        """Return how many openings of each kind a room of the size has, those of the last one where its walls are as long as they ask."""
        if self._numbers is None or not numbers_fit(grammar, room, self._numbers):
            self._numbers = draw_numbers(grammar, room, rng)
        return self._numbers

    def suit(self, furniture: Furniture | None) -> None:
        """Count furniture that covers as much as the size asks for, None if there is no room for it."""
        self._suited += 1 + (furniture is not None)
        self._furniture = furniture
        if furniture is not None and not self._is_of_mixture:
            self._tried = 0

    def reopened(self, plan: Plan, categories: Categories, rng: np.random.Generator) -> list[ParseTree]:
        """Return the last furniture in the same room with other doors and windows, of all draws but the first those that fit.

        Without a size of a mixture it has none where the budget's gate keeps the odds that the grammar gives.
        """
        found: list[ParseTree] = []
        if self._furniture is not None and (self._is_of_mixture or plan.grammar.budget.gate == "structures"):
            for _ in range(_OPENINGS_TRIED - 1):
                with suppress(RejectedError):
                    found.append(_opened(plan, categories, self._furniture, rng))
        return found


def derive_from(plan: Plan, categories: Categories, rng: np.random.Generator, kept: Kept | None = None) -> ParseTree:
    """Draw one parse tree of a plan, see :func:`derive`, in the size of room that is kept from one to the next."""
    kept = kept or Kept()
    reasons: Counter[str] = Counter()
    below_slopes: Counter[str] = Counter()
    budget = plan.grammar.budget.derivations if plan.conditional is None else max(plan.grammar.budget.derivations // _CONDITIONAL_COST, 1)
    for _ in range(budget):
        try:
            tree, furniture = _derive_once(plan, categories, kept, rng)
        except BelowSlopesError as rejected:
            below_slopes[str(rejected)] += 1
            if plan.grammar.room.slopes.probability >= 1.0 and below_slopes.total() == _BELOW_SLOPES:
                raise RequestError(
                    f"room_ceiling: expected '{plan.request.room_ceiling}' with space for the furniture of room type "
                    f"'{plan.grammar.room_type}' below, got none for {_BELOW_SLOPES} sets of it; {_worst(below_slopes)}; "
                    "ask for a higher room_eaves_m, a larger room, fewer objects or another room_ceiling"
                ) from rejected
        except RejectedError as rejected:
            reasons[str(rejected)] += 1
            if not isinstance(rejected, UnfitFurnitureError):
                kept.suit(None)
        else:
            kept.suit(furniture)
            return tree
    raise RequestError(
        f"request: expected a {plan.grammar.room_type} within {budget} derivations, got none; {_worst(reasons + below_slopes)}; "
        "relax that constraint or raise budget.derivations"
    )


def _worst(reasons: Counter[str]) -> str:
    """Return the commonest reasons with their numbers, as words."""
    return "; ".join(f"{count} failed at: {reason}" for reason, count in reasons.most_common(3))


def _derive_once(plan: Plan, categories: Categories, kept: Kept, rng: np.random.Generator) -> tuple[ParseTree, Furniture]:
    grammar, slopes, extent = plan.grammar, plan.grammar.room.slopes, kept.size(plan, rng)
    structure = _draw_structure(plan, rng)
    asked = _asked_m2(grammar, structure)
    terminals, covered = _draw_terminals(plan, categories, structure, asked, extent, rng)
    flat, flat_attributes, special = draw_room(grammar, plan.request, plan.outline, covered + asked, rng, extent)
    is_sloped = slopes.probability > 0.0 and not special.bay and bool(rng.random() < slopes.probability)
    if slopes.probability > 0.0 and not special.bay and not is_sloped:
        flat_attributes.append(Attribute("slopes", "none", math.log(1.0 - slopes.probability)))
    tries = _CEILINGS_TRIED if is_sloped else _OPENINGS_TRIED
    contents = _Contents(structure, terminals, [0.0] * len(terminals.symbols), {})

    def pinned_in(room: Room) -> _Contents:
        if covered > grammar.room.floor_share_max * signed_area_m2(room.polygon_m):
            raise RejectedError(f"furniture on at most {grammar.room.floor_share_max:g} of the floor")
        return contents._replace(pinned=_pin(plan, categories, room, terminals, rng))

    if is_sloped:
        contents = contents._replace(loaded_m=loaded_heights_m(categories, contents.things))
    else:
        _check_crowding(plan, categories, flat, terminals)
        contents = pinned_in(flat)
    numbers, room, room_attributes = kept.numbers(grammar, flat, rng), flat, flat_attributes
    for tried in range(tries):
        try:
            # draw the ceiling, higher and higher eaves
            if is_sloped:
                room, room_attributes = draw_slopes(
                    slopes, flat, flat_attributes, rng, grows=not is_given(plan.request), raised=tried / (tries - 1)
                )
                check_tall(grammar, room, contents.things)
                contents = pinned_in(room)
            furniture = Furniture(contents, room, special, room_attributes, numbers)
            tree = _opened(plan, categories, furniture, rng)
            break
        except RejectedError as rejected:
            if tried == tries - 1 or (isinstance(rejected, UnfitFurnitureError) and not is_sloped):
                raise (BelowSlopesError(str(rejected)) if is_sloped else rejected) from rejected
    return tree, furniture


def _opened(plan: Plan, categories: Categories, furniture: Furniture, rng: np.random.Generator) -> ParseTree:
    """Draw doors and windows, place the unit rows between them, and draw the addresses.

    Raises:
        RejectedError: something does not fit.
    """
    contents, room = furniture.contents, furniture.room
    openings, opening_counts = draw_openings(plan.grammar, categories, room, rng, furniture.special, furniture.numbers, plan.bounds.keys())
    furnished, terminals = replace(room, openings=tuple(drawn.opening for drawn in openings)), contents.terminals
    _check_crowding(plan, categories, furnished, terminals)
    fixed = [(plan.fixed[terminals.fixed[k]], terminals.rules[k], terminals.sizes[k], place) for k, place in contents.pinned.items()]
    check_pinned(plan.grammar, categories, furnished, fixed)
    check_tall(plan.grammar, furnished, contents.things)
    drafts = _drafts(contents, len(openings) + 1)
    unit_rows = place_unit_rows(plan.grammar, furnished, drafts, rng)
    items, corners = draw_addresses(categories, furnished, drafts, rng)
    # write all choices down
    nodes = _shell_nodes(plan.grammar, (*furniture.attributes, *opening_counts), openings)
    return ParseTree(
        room=furnished,
        items=_append_items(contents.structure, items, nodes),
        nodes=tuple(nodes),
        corners=tuple((corner.x_m, corner.y_m, corner.yaw_rad) for corner in corners),
        unit_rows=unit_rows,
    )


def _check_crowding(plan: Plan, categories: Categories, room: Room, terminals: _Terminals) -> None:
    """Reject what takes too much of a room that no request gives the size of: of one without openings what is too much with any."""
    if is_given(plan.request):
        return
    grammar, things = plan.grammar, list(zip(terminals.rules, terminals.sizes, strict=True))
    if used_share(grammar, categories, room, things) > grammar.room.used_share_max:
        raise UnfitFurnitureError(f"furniture with the space to use it on at most {grammar.room.used_share_max:g} of the floor")
    if wall_share(categories, room, things) > grammar.room.wall_share_max:
        raise UnfitFurnitureError(f"furniture before at most {grammar.room.wall_share_max:g} of the walls")


def _draw_structure(plan: Plan, rng: np.random.Generator) -> list[Vertex]:
    """Draw a structure that meets the bounds, with the fixed objects of unknown categories as terminals at its end."""
    structure = draw_structure(plan.grammar, rng) if plan.conditional is None else plan.conditional.draw(rng)
    structure.extend(Vertex(f"fixed_{fixed.name}", "terminal", -1, fixed.name, 0.0) for fixed in _extras(plan))
    symbols = [vertex.symbol for vertex in structure if vertex.kind == "terminal"]
    least, most = plan.request.min_objects, plan.request.max_objects
    if not least <= len(symbols) <= most:
        raise RejectedError(f"number of objects within [{least}, {most}]")
    for name, bound in plan.bounds.items():
        if name not in plan.grammar.openings and not bound.least <= sum(symbol in bound.symbols for symbol in symbols) <= bound.most:
            raise RejectedError(bound.name)
    return structure


def _extras(plan: Plan) -> list[FixedObject]:
    """Return the fixed objects that the grammar has no object for."""
    return [fixed for fixed in plan.fixed if fixed.name not in plan.known]


def _draw_terminals(
    plan: Plan,
    categories: Categories,
    structure: Sequence[Vertex],
    asked_m2: float,
    extent: DrawnSize | None,
    rng: np.random.Generator,
) -> tuple[_Terminals, float]:
    """Match the terminals with the fixed objects, draw the sizes that no fixed object gives, and return the area that they cover too.

    What covers the floor comes first: ``asked_m2`` more than it covers must suit the size of the room.
    """
    vertices = [i for i, vertex in enumerate(structure) if vertex.kind == "terminal"]
    symbols = [structure[i].symbol for i in vertices]
    extras = _extras(plan)
    rules = [plan.grammar.objects[symbol] for symbol in symbols[: len(symbols) - len(extras)]] + [rule_of_fixed(fixed) for fixed in extras]
    taken = match_terminals(plan.fixed, symbols, rules)
    if taken is None:
        raise RejectedError("fixed: an object of the grammar for each fixed one")
    check_targets([pair for k, pair in enumerate(zip(symbols, rules, strict=True)) if k not in taken], symbols)
    bounds = draw_covered_m2(extent, rng)
    covering = [k for k, rule in enumerate(rules) if rule.mount == "floor" and not categories[rule.category].underlay]
    given = {k: size for k, number in taken.items() if (size := plan.fixed[number].size_m) is not None}
    sizes = {k: given.get(k) or draw_size(rng, rules[k]) for k in covering}
    covered = sum(size[0] * size[1] for size in sizes.values())
    check_covered(plan.grammar.room, bounds, covered + asked_m2)
    sizes |= {k: given.get(k) or draw_size(rng, rule) for k, rule in enumerate(rules) if k not in sizes}
    return _Terminals(vertices, symbols, rules, [sizes[k] for k in range(len(rules))], taken), covered


def _asked_m2(grammar: Grammar, structure: Sequence[Vertex]) -> float:
    """Return the area that the unit rows of a structure ask for beyond what their units cover."""
    above = {vertex.parent for vertex in structure}
    rules = (grammar.nodes[vertex.symbol].run for k, vertex in enumerate(structure) if k in above and vertex.symbol in grammar.nodes)
    return sum(rule.floor_m2 for rule in rules if rule is not None)


def _pin(plan: Plan, categories: Categories, room: Room, terminals: _Terminals, rng: np.random.Generator) -> dict[int, Pinned]:
    """Return for the terminals that fixed objects take where they stay; ``on`` is still a place in the list of fixed objects."""
    terminal_of = {fixed: k for k, fixed in terminals.fixed.items()}
    pinned: dict[int, Pinned] = {}
    for number, fixed in enumerate(plan.fixed):
        k = terminal_of[number]
        rule, size = terminals.rules[k], terminals.sizes[k]
        below = None
        if fixed.on is not None:
            supporter = terminal_of[fixed.on]
            below = (terminals.rules[supporter].category, terminals.sizes[supporter], pinned[supporter])
        bottom = room.height_m - size[2] if rule.mount == "ceiling" else 0.0
        if rule.centre_height_m is not None:
            bottom = draw_height(rng, rule)[0] - 0.5 * size[2]
        pinned[k] = pin(fixed, rule, size, bottom, room, below, categories)._replace(sized=fixed.size_m is not None)
    return pinned


def _drafts(contents: _Contents, first: int) -> list[Draft]:
    """Return a draft for each terminal; ids count on from ``first``."""
    terminals = contents.terminals
    drafts = [
        Draft(
            id=first + k,
            symbol=terminals.symbols[k],
            rule=terminals.rules[k],
            size_m=terminals.sizes[k],
            units=units_above(contents.structure, i),
            loaded_m=contents.loaded_m[k],
        )
        for k, i in enumerate(terminals.vertices)
    ]
    id_of = {fixed: first + k for k, fixed in terminals.fixed.items()}
    for k, place in contents.pinned.items():
        drafts[k].pinned = place if place.on is None else place._replace(on=id_of[place.on])
    return drafts


def _shell_nodes(grammar: Grammar, attributes: Sequence[Attribute], openings: Sequence[DrawnOpening]) -> list[ParseNode]:
    """Return the nodes of the scene, of the room and of its openings."""
    nodes = [ParseNode(symbol="scene", kind="or", choice=grammar.room_type), ParseNode(symbol="room", kind="terminal", parent=0)]
    nodes.extend(replace(attribute_node(attribute, None), parent=1) for attribute in attributes)
    for opening, opening_attributes in openings:
        parent = len(nodes)
        nodes.append(ParseNode(symbol=opening.category, kind="terminal", parent=1, choice=opening.category, object=opening.id))
        nodes.extend(replace(attribute_node(attribute, opening.id), parent=parent) for attribute in opening_attributes)
    return nodes


def _append_items(structure: Sequence[Vertex], items: Sequence[tuple[Item, list[ParseNode]]], nodes: list[ParseNode]) -> tuple[Item, ...]:
    """Append the structure's vertices, and the nodes below the terminals, to ``nodes``; return the items with their indices there."""
    index_of = {-1: 0}
    placed: list[Item] = []
    for i, vertex in enumerate(structure):
        parent, index = index_of[vertex.parent], len(nodes)
        index_of[i] = index
        if vertex.kind == "terminal":
            item, below = items[len(placed)]
            nodes.append(ParseNode(symbol=vertex.symbol, kind="terminal", parent=parent, choice=vertex.choice, object=item.id))
            nodes.extend(replace(node, parent=index) for node in below)
            last = len(nodes) - 1 if item.supporters else None
            placed.append(replace(item, node=index, supporter_node=last))
        else:
            nodes.append(
                ParseNode(
                    symbol=vertex.symbol, kind=vertex.kind, parent=parent, choice=vertex.choice, log_probability=vertex.log_probability
                )
            )
    return tuple(placed)
