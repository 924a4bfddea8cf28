"""Constraints of a request on the contents of a room, folded into the grammar where that can be done exactly.

Given that some categories do not appear, the probability of an Or branch is proportional to its own times that of no such object below
it, and the probability of k copies to its own times the k-th power of that.  Bounds on numbers by category stay: structures are drawn until
they meet them, or by :mod:`grammar.derivation.structure`.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from grammar.derivation.fixed import read_fixed
from grammar.derivation.overrides import overridden
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.room_rules import OPENINGS, OpeningRule
from grammar.spec.rules import Grammar, Node

_COUNT = re.compile(r"([a-z][a-z0-9_]*):(\d{1,4}):(\d{1,4})")
_MANY = 10_000


class CountBound(NamedTuple):
    """Bounds on the number of objects with certain symbols: it lies in [least, most]; ``name`` is the constraint that says so."""

    least: int
    most: int
    name: str
    symbols: frozenset[str]


def category_bounds(grammar: Grammar, request: SceneRequest) -> dict[str, CountBound]:
    """Return the bounds by category (or symbol of the grammar) that a request sets.

    ``grammar`` is as the request's own numbers make it, see :func:`grammar.derivation.overrides.overridden`.

    Raises:
        RequestError: a constraint does not parse, names a category that the grammar does not have, or contradicts another one.
    """
    symbols_of = _symbols_by_name(grammar)
    bounds: dict[str, CountBound] = {}
    # intersect all that the request says about one name
    for category, least, most, name in numbers_asked(request, symbols_of):
        if category not in symbols_of and category not in OPENINGS and least > 0:
            known = ", ".join(sorted({rule.category for rule in grammar.objects.values()}))
            raise RequestError(f"{name}: expected a category of the {grammar.room_type} grammar ({known}), got '{category}'")
        before = bounds.get(category, CountBound(0, _MANY, name, frozenset()))
        bound = CountBound(max(before.least, least), min(before.most, most), name, frozenset(symbols_of.get(category, ())))
        if bound.least > bound.most:
            also = f" together with {before.name}" if before.name != name else ""
            raise RequestError(f"{name}: expected a least number up to the greatest one, got {bound.least} and {bound.most}{also}")
        bounds[category] = bound
    # compare the bounds with what the grammar can give
    for category, bound in bounds.items():
        if category in OPENINGS and category not in grammar.openings:
            least = most = 0
        elif category in OPENINGS:
            drawn = [k for k, p in enumerate(grammar.openings[category].multiplicity) if p > 0.0]
            least, most = min(drawn), max(drawn)
        else:
            least, most = number_range(grammar, lambda symbol, wanted=bound.symbols: int(symbol in wanted))  # type: ignore[misc]
        if bound.least > most or bound.most < least:
            raise RequestError(
                f"{bound.name}: expected a range that meets the {least} to {most} of the {grammar.room_type} grammar, "
                f"got {bound.least} to {bound.most}"
            )
    return bounds


def _symbols_by_name(grammar: Grammar) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for symbol, rule in grammar.objects.items():
        for name in (symbol, rule.category):
            found.setdefault(name, set()).add(symbol)
    return found


def numbers_asked(request: SceneRequest, known: Collection[str]) -> list[tuple[str, int, int, str]]:
    """Return name, least and greatest number, and the constraint's text, for all that a request says about numbers by category."""
    asked = [(category, 1, _MANY, f"must_have: {category}") for category in request.must_have]
    asked += [(category, 0, 0, f"must_not: {category}") for category in request.must_not]
    for text in request.counts:
        match = _COUNT.fullmatch(text)
        if match is None:
            raise RequestError(f"counts: expected texts 'category:least:most', got '{text}'")
        asked.append((match[1], int(match[2]), int(match[3]), f"counts: {text}"))
    for name, number in Counter(fixed.name for fixed in read_fixed(request) if fixed.name in known).items():
        asked.append((name, number, _MANY, f"fixed: {number} of {name}"))
    return asked


def number_range(grammar: Grammar, weight: Callable[[str], int]) -> tuple[int, int]:
    """Return the least and the greatest sum of ``weight`` over the objects of a structure that has positive probability."""

    @cache
    def bounds(symbol: str) -> tuple[int, int]:
        node = grammar.nodes.get(symbol)
        if node is None:
            return weight(symbol), weight(symbol)
        inner = [bounds(branch.symbol) for branch in node.branches]
        if node.kind == "or":
            taken = [span for span, branch in zip(inner, node.branches, strict=True) if branch.probability]
            return min(low for low, _ in taken), max(high for _, high in taken)
        least, most = 0, 0
        for (low, high), branch in zip(inner, node.branches, strict=True):
            copies = [k for k, p in enumerate(branch.multiplicity) if p > 0.0] if branch.multiplicity else [1]
            least, most = least + low * min(copies), most + high * max(copies)
        return least, most

    return bounds(grammar.root)


def count_range(grammar: Grammar) -> tuple[int, int]:
    """Return the least and the greatest number of objects that the grammar gives with positive probability."""
    return number_range(grammar, lambda _: 1)


def constrained(grammar: Grammar, request: SceneRequest) -> Grammar:
    """Return the grammar given a request: its own numbers, its excluded categories, its bounds on doors and windows.

    Raises:
        RequestError: every structure holds something that is excluded.
    """
    grammar = overridden(grammar, request)
    bounds = category_bounds(grammar, request)
    nodes: Mapping[str, Node] = grammar.nodes
    excluded = {symbol for bound in bounds.values() if bound.most == 0 for symbol in bound.symbols}
    sizeless = {symbol for symbol, rule in grammar.objects.items() if not rule.sizes}
    if excluded or sizeless:
        free = _probability_without(grammar, nodes, excluded | sizeless)
        if free[grammar.root] <= 0.0:
            field, names = ("must_not", excluded) if excluded else ("sizes", sizeless)
            raise RequestError(
                f"{field}: {', '.join(sorted(names))}: expected a {grammar.room_type} that can do without, got a grammar in which none can"
            )
        nodes = {symbol: _without(node, free) for symbol, node in nodes.items() if free[symbol] > 0.0}
    openings = {kind: _bounded(rule, bounds.get(kind)) for kind, rule in grammar.openings.items()}
    return replace(grammar, nodes=nodes, openings=openings)


def _bounded(rule: OpeningRule, bound: CountBound | None) -> OpeningRule:
    """Return an opening's rule given that there are as many as a bound allows."""
    if bound is None:
        return rule
    probabilities = [p if bound.least <= k <= bound.most else 0.0 for k, p in enumerate(rule.multiplicity)]
    return replace(rule, multiplicity=_normalized(probabilities))


def _probability_without(grammar: Grammar, nodes: Mapping[str, Node], excluded: set[str]) -> dict[str, float]:
    """Return for every symbol the probability that it leads to no excluded object."""
    found = {symbol: float(symbol not in excluded) for symbol in grammar.objects}

    def visit(symbol: str) -> float:
        if symbol not in found:
            node, product = nodes[symbol], 1.0
            if node.kind == "or":
                product = sum((branch.probability or 0.0) * visit(branch.symbol) for branch in node.branches)
            else:
                for branch in node.branches:
                    inner = visit(branch.symbol)
                    product *= (
                        inner if branch.multiplicity is None else sum(p * math.pow(inner, k) for k, p in enumerate(branch.multiplicity))
                    )
            found[symbol] = product
        return found[symbol]

    for symbol in nodes:
        visit(symbol)
    return found


def _without(node: Node, free: Mapping[str, float]) -> Node:
    """Return a node with its probabilities given that it leads to no excluded object; ``free`` are those of the symbols."""
    if node.kind == "or":
        probabilities = _normalized([(branch.probability or 0.0) * free[branch.symbol] for branch in node.branches])
        taken = [
            replace(branch, probability=p) for branch, p in zip(node.branches, probabilities, strict=True) if free[branch.symbol] > 0.0
        ]
        return replace(node, branches=tuple(taken))
    branches = []
    for branch in node.branches:
        if branch.multiplicity is not None:
            probabilities = _normalized([p * math.pow(free[branch.symbol], k) for k, p in enumerate(branch.multiplicity)])
            if free[branch.symbol] <= 0.0:
                continue
            branch = replace(branch, multiplicity=probabilities)
        branches.append(branch)
    return replace(node, branches=tuple(branches))


def _normalized(probabilities: Sequence[float]) -> tuple[float, ...]:
    """Return numbers scaled to sum to 1; zeros stay as they are."""
    total = sum(probabilities)
    return tuple(p / total for p in probabilities) if total > 0.0 else tuple(probabilities)
