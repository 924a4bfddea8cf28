"""What a request says about the contents of a room, folded into the grammar where that can be done exactly.

Categories that must not appear are conditioned away: an Or branch counts with its probability times that of a branch without them, a Set
multiplicity k with that probability to the power of k, which is the grammar given their absence.  Clutter tilts the multiplicities of what
stands on things, ``p_k t^k`` with t so that the mean number is scaled as asked.  Least and greatest numbers by category are left to bounded
drawing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from grammar.request import RequestError, SceneRequest
from grammar.rules import Branch, Grammar, Node

_COUNT = re.compile(r"([a-z][a-z0-9_]*):(\d{1,4}):(\d{1,4})")
_LARGEST_TILT = 1e6


class Bound(NamedTuple):
    """Least and greatest number of objects of one category, and the constraint that says so."""

    least: int
    most: int
    name: str


def category_bounds(grammar: Grammar, request: SceneRequest) -> dict[str, Bound]:
    """Return the bounds by category that a request sets.

    Raises:
        RequestError: a constraint does not parse, names a category that the grammar does not have, or contradicts another one.
    """
    known = sorted({rule.category for rule in grammar.objects.values()})
    asked = [(category, 1, 10_000, f"must_have: {category}") for category in request.must_have]
    asked += [(category, 0, 0, f"must_not: {category}") for category in request.must_not]
    for text in request.counts:
        match = _COUNT.fullmatch(text)
        if match is None:
            raise RequestError(f"counts: expected texts 'category:least:most', got '{text}'")
        asked.append((match[1], int(match[2]), int(match[3]), f"counts: {text}"))
    bounds: dict[str, Bound] = {}
    for category, least, most, name in asked:
        if category not in known and least > 0:
            raise RequestError(f"{name}: expected a category of the {grammar.room_type} grammar ({', '.join(known)}), got '{category}'")
        before = bounds.get(category, Bound(0, 10_000, name))
        bound = Bound(max(before.least, least), min(before.most, most), name)
        if bound.least > bound.most:
            also = f" together with {before.name}" if before.name != name else ""
            raise RequestError(f"{name}: expected a least number up to the greatest one, got {bound.least} and {bound.most}{also}")
        bounds[category] = bound
    for category, bound in bounds.items():
        least, most = number_range(grammar, lambda symbol, wanted=category: int(grammar.objects[symbol].category == wanted))  # type: ignore[misc]
        if bound.least > most or bound.most < least:
            raise RequestError(
                f"{bound.name}: expected a range that meets the {least} to {most} of the {grammar.room_type} grammar, "
                f"got {bound.least} to {bound.most}"
            )
    return bounds


def number_range(grammar: Grammar, weight: Callable[[str], int]) -> tuple[int, int]:
    """Return the least and the greatest sum of ``weight`` over the objects of a structure that has positive probability."""

    @cache
    def bounds(symbol: str) -> tuple[int, int]:
        node = grammar.nodes.get(symbol)
        if node is None:
            return weight(symbol), weight(symbol)
        inner = [bounds(branch.symbol) for branch in node.branches]
        if node.kind == "or":
            taken = [item for item, branch in zip(inner, node.branches, strict=True) if branch.probability]
            return min(low for low, _ in taken), max(high for _, high in taken)
        least, most = 0, 0
        for (low, high), branch in zip(inner, node.branches, strict=True):
            copies = [k for k, p in enumerate(branch.multiplicity) if p > 0.0] if branch.multiplicity else [1]
            least, most = least + low * min(copies), most + high * max(copies)
        return least, most

    return bounds(grammar.root)


def constrained(grammar: Grammar, request: SceneRequest) -> Grammar:
    """Return the grammar with a request's clutter and without the categories that must not appear.

    Raises:
        RequestError: no structure is without them.
    """
    nodes: Mapping[str, Node] = grammar.nodes
    if request.clutter != 1.0:
        nodes = {symbol: _cluttered(grammar, node, request.clutter) for symbol, node in nodes.items()}
    barred = {category for category, bound in category_bounds(grammar, request).items() if bound.most == 0}
    if barred:
        free = _probability_without(grammar, nodes, barred)
        if free[grammar.root] <= 0.0:
            names = ", ".join(sorted(barred))
            raise RequestError(f"must_not: {names}: expected a {grammar.room_type} that can do without, got a grammar in which none can")
        nodes = {symbol: _without(node, free) for symbol, node in nodes.items() if free[symbol] > 0.0}
    return replace(grammar, nodes=nodes) if nodes is not grammar.nodes else grammar


def _probability_without(grammar: Grammar, nodes: Mapping[str, Node], barred: set[str]) -> dict[str, float]:
    """Return for every symbol the probability that nothing below it is of a barred category."""
    found = {symbol: float(rule.category not in barred) for symbol, rule in grammar.objects.items()}

    def visit(symbol: str) -> float:
        if symbol not in found:
            node, product = nodes[symbol], 1.0
            if node.kind == "or":
                product = sum((branch.probability or 0.0) * visit(branch.symbol) for branch in node.branches)
            else:
                for branch in node.branches:
                    inner = visit(branch.symbol)
                    product *= inner if branch.multiplicity is None else sum(p * inner**k for k, p in enumerate(branch.multiplicity))
            found[symbol] = product
        return found[symbol]

    for symbol in nodes:
        visit(symbol)
    return found


def _without(node: Node, free: Mapping[str, float]) -> Node:
    """Return a node whose choices are those given that nothing barred comes below it."""
    if node.kind == "or":
        odds = _normal([(branch.probability or 0.0) * free[branch.symbol] for branch in node.branches])
        taken = [replace(branch, probability=p) for branch, p in zip(node.branches, odds, strict=True) if free[branch.symbol] > 0.0]
        return replace(node, branches=tuple(taken))
    branches = []
    for branch in node.branches:
        if branch.multiplicity is not None:
            odds = _normal([p * free[branch.symbol] ** k for k, p in enumerate(branch.multiplicity)])
            if free[branch.symbol] <= 0.0:
                continue
            branch = replace(branch, multiplicity=odds)
        branches.append(branch)
    return replace(node, branches=tuple(branches))


def _cluttered(grammar: Grammar, node: Node, clutter: float) -> Node:
    def tilted(branch: Branch) -> Branch:
        rule = grammar.objects.get(branch.symbol)
        if branch.multiplicity is None or rule is None or rule.mount != "object":
            return branch
        return replace(branch, multiplicity=tilt(branch.multiplicity, clutter))

    return replace(node, branches=tuple(tilted(branch) for branch in node.branches))


def tilt(odds: Sequence[float], scale: float) -> tuple[float, ...]:
    """Return the odds ``p_k t^k`` whose mean is ``scale`` times that of ``odds``, as far as the numbers that ``odds`` allows let it."""
    taken = [k for k, p in enumerate(odds) if p > 0.0]
    wanted = scale * sum(k * p for k, p in enumerate(odds))
    if len(taken) == 1:
        return tuple(odds)
    if wanted <= taken[0] or wanted >= taken[-1]:
        end = taken[0] if wanted <= taken[0] else taken[-1]
        return tuple(float(k == end) for k in range(len(odds)))
    low, high = 1.0 / _LARGEST_TILT, _LARGEST_TILT
    for _ in range(100):
        middle = (low * high) ** 0.5
        mean = sum(k * p for k, p in enumerate(_normal([p * middle**k for k, p in enumerate(odds)])))
        low, high = (middle, high) if mean < wanted else (low, middle)
    return _normal([p * low**k for k, p in enumerate(odds)])


def _normal(odds: Sequence[float]) -> tuple[float, ...]:
    total = sum(odds)
    return tuple(p / total for p in odds) if total > 0.0 else tuple(odds)
