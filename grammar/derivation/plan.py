"""A request made ready for derivations: checked, folded into the grammar, and with the tables for conditional structures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from grammar.derivation.constraints import CountBound, category_bounds, constrained, count_range, number_range
from grammar.derivation.counting import ConditionalStructures, conditional_structures
from grammar.derivation.fixed import FixedObject, read_fixed
from grammar.derivation.outlines import check_outline
from grammar.derivation.overrides import overridden
from grammar.derivation.pinning import check_fixed
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar
from scene_description.strict import shorten
from scene_description.types import Point2

_RARE = 0.2
"""Structures are drawn given their numbers of objects where fewer than this share would meet the bounds."""

_LONGEST_TEXT = 200


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
