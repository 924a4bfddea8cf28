"""A request made ready for derivations: checked, folded into the grammar, and with the tables for conditional structures."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from grammar.derivation.constraints import CountBound, category_bounds, constrained, count_range, number_range
from grammar.derivation.fixed import FixedObject, check_fixed, read_fixed
from grammar.derivation.outlines import check_outline
from grammar.derivation.overrides import overridden
from grammar.derivation.structure import ConditionalStructures, conditional_structures
from grammar.geometry.arrays import Floats
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.room_rules import SHAPES, RoomShapes
from grammar.spec.rules import Branch, Grammar
from scene_description.polygons import signed_area_m2
from scene_description.strict import shorten
from scene_description.types import Point2

_RARE = 0.2
"""Structures are drawn given their numbers of objects where fewer than this share would meet the bounds."""

_LONGEST_TEXT = 200

_ROUNDING = 1e-9
_SIDES = ("width_m", "depth_m")

Interval = tuple[float, float]


class Plan(NamedTuple):
    """What derivations of a request share.

    grammar: given the request; bounds: by category or symbol; outline: the request's own or (); fixed: the request's objects; known: names
    of objects and categories of the grammar; conditional: draws structures where those drawn freely would seldom meet the bounds.
    """

    grammar: Grammar
    request: SceneRequest
    bounds: Mapping[str, CountBound]
    outline: tuple[Point2, ...]
    fixed: tuple[FixedObject, ...]
    known: frozenset[str]
    conditional: ConditionalStructures | None


def make_plan(grammar: Grammar, categories: Categories, request: SceneRequest) -> Plan:
    """Check a request as far as that can be done without drawing, and fold it into the grammar.

    Raises:
        RequestError: a constraint cannot be met; the line names it.
    """
    _check_fields(grammar, categories, request)
    # fold the request into the grammar
    fixed, changed = read_fixed(request), overridden(grammar, request)
    check_fixed(changed, categories, fixed)
    bounds, changed = category_bounds(changed, request), constrained(grammar, request)
    known = frozenset(name for symbol, rule in changed.objects.items() for name in (symbol, rule.category))
    # compare the number of objects asked for with what the grammar can give
    extras = sum(item.name not in known for item in fixed)
    least, most = (number + extras for number in count_range(changed))
    if request.max_objects < least:
        raise RequestError(
            f"max_objects: expected at least {least}, the fewest objects of a {grammar.room_type}, got {request.max_objects}"
        )
    if request.min_objects > most:
        raise RequestError(f"min_objects: expected at most {most}, the most objects of a {grammar.room_type}, got {request.min_objects}")
    outline = check_outline(request.room_polygon_m) if request.room_polygon_m else ()
    # gather the bounds that structures have to meet, that of the total number first
    counted = [bound for name, bound in bounds.items() if name not in changed.openings]
    if request.min_objects > least or request.max_objects < most:
        name = f"number of objects within [{request.min_objects}, {request.max_objects}]"
        limits = max(request.min_objects - extras, 0), request.max_objects - extras
        counted.insert(0, CountBound(*limits, name, frozenset(changed.objects)))
    conditional = conditional_structures(changed, counted, lambda bound: number_range(changed, lambda s: int(s in bound.symbols))[1], _RARE)
    return Plan(changed, request, bounds, outline, fixed, known, conditional)


def _check_fields(grammar: Grammar, categories: Categories, request: SceneRequest) -> None:
    """Check fields of a request that need no more than the names of the grammar."""
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


def check_room_size(plan: Plan, categories: Categories) -> None:
    """Refuse a request whose room cannot hold what it must, or cannot be as large or as small as that.

    Raises:
        RequestError: the line names the side or the outline, with the bounds that it must keep.
    """
    request, room, room_type = plan.request, plan.grammar.room, plan.grammar.room_type
    asked = [name for name in _SIDES if getattr(request, f"room_{name}") > 0.0]
    if not (asked or plan.outline):
        return
    # a fixed object may be smaller than those of the grammar
    needed = 0.0 if plan.fixed else _least_covered(plan, categories) / room.floor_share_max
    if plan.outline:
        area = signed_area_m2(plan.outline)
        if area < needed * (1.0 - _ROUNDING):
            raise RequestError(
                f"room_polygon_m: expected at least {_up(needed)} m2 of floor for the furniture of a {room_type}, got {area:.3g} m2; "
                "ask for a larger one or fewer objects"
            )
        return
    least, most = (needed, math.inf) if len(asked) == 2 else (max(needed, room.area_low_m2), room.area_high_m2)
    for name in asked:
        (other,) = set(_SIDES) - {name}
        value, span = getattr(request, f"room_{name}"), _span(plan, other)
        low, high = _bounds(room.shapes, span, (least, most))
        if low > high:
            raise RequestError(
                f"room_{other}: expected a side that a {room_type} of this shape can have, got {_words(span)} m; ask for another"
            )
        if not low * (1.0 - _ROUNDING) <= value <= high * (1.0 + _ROUNDING):
            wanted = f"at least {_up(low)}" if math.isinf(high) else f"{_up(low)} to {_down(high)}"
            raise RequestError(
                f"room_{name}: expected {wanted} m for a {room_type} with a {other.removesuffix('_m')} of {_words(span)} m, got {value:g}; "
                "0 lets the grammar draw it"
            )


def _span(plan: Plan, name: str) -> Interval:
    asked, drawn = getattr(plan.request, f"room_{name}"), getattr(plan.grammar.room, name)
    return (asked, asked) if asked > 0.0 else (drawn.low, drawn.high)


def _bounds(shapes: RoomShapes, other: Interval, area: Interval) -> Interval:
    """Return what a side must lie within, given the range of the other one and of the floor's area; empty if no shape can have it."""
    spans = [_bounds_of_shape(shapes, name, other, area) for name in SHAPES if getattr(shapes, name) > 0.0]
    possible = [span for span in spans if span[0] <= span[1]]
    return min((low for low, _ in possible), default=math.inf), max((high for _, high in possible), default=-math.inf)


def _bounds_of_shape(shapes: RoomShapes, name: str, other: Interval, area: Interval) -> Interval:
    """Return the bounds of a side for one shape: what its notch takes of the bounding rectangle, and how wide its arms stay at most."""
    if name == "rectangle":
        return area[0] / other[1], area[1] / other[0]
    if name in ("chimney_breast", "alcove", "bay"):
        return _bounds_with_jut(shapes, name, other, area)
    low, high = area[0] / (other[1] * (1.0 - shapes.notch_low**2)), area[1] / (other[0] * (1.0 - shapes.notch_high**2))
    arm = shapes.narrowest_m / (1.0 - shapes.notch_low)
    beside = 2.0 * arm if name == "u_shape" and other[1] < 2.0 * arm else arm  # a U has two arms beside each other along one side
    return max(low, beside), high if other[1] >= arm else -math.inf


def _bounds_with_jut(shapes: RoomShapes, name: str, other: Interval, area: Interval) -> Interval:
    """Return the bounds of a side for a shape with a chimney breast, an alcove or a bay, as wide and deep as it may be."""
    if name == "chimney_breast":
        return area[0] / other[1], (area[1] + shapes.breast_width_m[1] * shapes.breast_depth_m[1]) / other[0]
    shallow = other[0] - (shapes.alcove_depth_m if name == "alcove" else shapes.bay_depth_m)[1]
    return area[0] / other[1], area[1] / shallow if shallow > 0.0 else math.inf


def _least_covered(plan: Plan, categories: Categories) -> float:
    """Return the least area (m2) that the furniture of a structure covers, as far as numbers of objects bound it."""
    footprint = {
        symbol: rule.low_m[0] * rule.low_m[1] if rule.mount == "floor" and not categories[rule.category].underlay else 0.0
        for symbol, rule in plan.grammar.objects.items()
    }
    by_number = _least_by_number(plan.grammar, footprint.__getitem__)[plan.request.min_objects : plan.request.max_objects + 1]
    # what must be there of categories that share no object
    demanded, seen = 0.0, set[str]()
    for bound in plan.bounds.values():
        if bound.least and bound.symbols and not bound.symbols & seen:
            seen |= bound.symbols
            demanded += bound.least * min(footprint[symbol] for symbol in bound.symbols)
    return max(float(by_number.min(initial=math.inf)), demanded)


def _least_by_number(grammar: Grammar, weight: Callable[[str], float]) -> Floats:
    """Return for every number of objects the least sum of their weights over the structures that have so many; infinite without any."""

    @cache
    def table(symbol: str) -> Floats:
        node = grammar.nodes.get(symbol)
        if node is None:
            return np.array([math.inf, weight(symbol)])
        if node.kind == "or":
            return _least([table(branch.symbol) for branch in node.branches if branch.probability])
        total = np.zeros(1)
        for branch in node.branches:
            total = _together(total, copies(branch))
        return total

    def copies(branch: Branch) -> Floats:
        one, sums = table(branch.symbol), [np.zeros(1)]
        odds = branch.multiplicity or (0.0, 1.0)
        while len(sums) < len(odds):
            sums.append(_together(sums[-1], one))
        return _least([total for total, probability in zip(sums, odds, strict=True) if probability > 0.0])

    return table(grammar.root)


def _least(tables: Sequence[Floats]) -> Floats:
    length = max(len(table) for table in tables)
    padded = [np.concatenate([table, np.full(length - len(table), math.inf)]) for table in tables]
    return np.asarray(np.minimum.reduce(padded))


def _together(first: Floats, second: Floats) -> Floats:
    """Return the table of two parts that stand side by side: the least sum over all ways to share the number between them."""
    total = np.full(len(first) + len(second) - 1, math.inf)
    for number, least in enumerate(first):
        part = total[number : number + len(second)]
        np.minimum(part, least + second, out=part)
    return total


def _words(span: Interval) -> str:
    return f"{span[0]:.3g}" if span[0] == span[1] else f"{span[0]:.3g} to {span[1]:.3g}"


def _up(value: float) -> str:
    return f"{math.ceil(value * 100.0) / 100.0:g}"


def _down(value: float) -> str:
    return f"{math.floor(value * 100.0) / 100.0:g}"
