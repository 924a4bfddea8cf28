"""Branching probabilities of Or and Set nodes, by counting over all derivations that explain each room's objects.

What is seen of a room is a bag: how many objects of each symbol.  Which derivation made it is hidden (a floor lamp may stand for itself or
belong to an armchair), so each branch is counted by its expectation over all of them, and the probabilities are re-estimated until they
settle (expectation maximisation; with a single derivation per room this is plain counting, Jiang et al., IJCV 2018, section 3.1).  The
expectations come from one pass from the leaves up, in which a table holds for each bag its probability and the counts that it implies.

A Dirichlet prior of ``alpha`` pseudo-counts around the base grammar smooths the counts.  Symbols that the data does not cover are not
looked at: they explain nothing, so branches that lead only to them keep their probabilities.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Floats
from grammar.spec.rules import Branch, Grammar, Node

Bag = tuple[int, ...]
Table = dict[Bag, tuple[float, Floats]]

_MISSED = 1e-3
"""Probability that a covered object which a derivation has was not recorded."""

_EXTRA = 1e-4
"""Factor for each recorded object that the derivation has not."""

_LEAST_PROBABILITY = 1e-250
"""A room that is less likely, which takes dozens of objects beyond all derivations, is not counted."""

_UNSEEN_SHARE = 0.02
"""Share of the prior of a covered Set branch that is spread evenly over all multiplicities, so that none is impossible."""

_MOST_COPIES = 64
"""Multiplicities of one branch, as many as a grammar may give."""

_ROUNDS = 30


@dataclass(frozen=True, slots=True, kw_only=True)
class BranchingResult:
    """New nodes, and for each node that changed how often it was counted (expected number of its occurrences in the rooms)."""

    nodes: Mapping[str, Node]
    counts: Mapping[str, float]


class _Model(NamedTuple):
    """The graph with its parameters: slices of one vector for each Or node, (node, -1), and each Set branch, (node, branch)."""

    nodes: Mapping[str, Node]
    visible: Mapping[str, int]
    place: Mapping[tuple[str, int], slice]
    below: Mapping[str, Counter[str]]
    closes: Mapping[str, tuple[str, ...]]


def learn_branching(grammar: Grammar, rooms: Sequence[Iterable[str]], covered: AbstractSet[str], alpha: float) -> BranchingResult:
    """Estimate all branching probabilities.

    Args:
        grammar: the base; its probabilities are the prior's mean.
        rooms: for each room the symbols of its objects.
        covered: symbols that the data records.
        alpha: pseudo-counts of the prior for each Or node and each Set branch.
    """
    below: dict[str, Counter[str]] = {}
    visible = {symbol: i for i, symbol in enumerate(sorted(covered & _leaves(grammar, grammar.root, below).keys()))}
    bags: Counter[Bag] = Counter()
    for symbols in rooms:
        counted = Counter(symbols)
        bags[tuple(counted[symbol] for symbol in visible)] += 1
    model, prior = _model(grammar, visible, below, bags)
    parameters, expected = prior, np.zeros_like(prior)
    for _ in range(_ROUNDS):
        expected = np.zeros_like(prior)
        for bag, times in bags.items():
            probability, counts = _room_table(model, grammar.root, parameters, bag)
            if probability > _LEAST_PROBABILITY:
                expected += times * counts / probability
        parameters = _normalised(model, expected + alpha * prior)
    return _result(grammar, model, prior, parameters, expected)


def _model(grammar: Grammar, visible: Mapping[str, int], below: Mapping[str, Counter[str]], bags: Iterable[Bag]) -> tuple[_Model, Floats]:
    """Return the model and its prior, Set branches with one more multiplicity where a room holds more objects than they give."""
    most = {symbol: max((bag[i] for bag in bags), default=0) for symbol, i in visible.items()}
    place: dict[tuple[str, int], slice] = {}
    prior: list[float] = []
    for name, node in grammar.nodes.items():
        if node.kind == "or":
            place[name, -1] = slice(len(prior), len(prior) + len(node.branches))
            prior.extend(branch.probability or 0.0 for branch in node.branches)
        for i, branch in enumerate(node.branches):
            if branch.multiplicity is None:
                continue
            values = list(branch.multiplicity)
            heads = [thing for thing in certain_objects(grammar, branch.symbol) if thing in most]
            if heads:
                values.extend(0.0 for _ in range(min(most[heads[0]] + 1, _MOST_COPIES) - len(values)))
                values = [(1.0 - _UNSEEN_SHARE) * value + _UNSEEN_SHARE / len(values) for value in values]
            place[name, i] = slice(len(prior), len(prior) + len(values))
            prior.extend(values)
    closes = _owners(grammar, visible, below)
    return _Model(grammar.nodes, visible, place, below, closes), np.array(prior)


def _leaves(grammar: Grammar, symbol: str, below: dict[str, Counter[str]]) -> Counter[str]:
    """Return in how many places each object stands below a symbol, and note the same for all symbols under it."""
    if symbol not in below:
        node = grammar.nodes.get(symbol)
        found: Counter[str] = Counter([symbol]) if node is None else Counter()
        for branch in node.branches if node else ():
            found.update(_leaves(grammar, branch.symbol, below))
        below[symbol] = found
    return below[symbol]


def certain_objects(grammar: Grammar, symbol: str) -> tuple[str, ...]:
    """Return the objects that a symbol surely leads to: itself, or those of an And node's branches, in order."""
    node = grammar.nodes.get(symbol)
    if node is None:
        return (symbol,)
    if node.kind != "and":
        return ()
    return tuple(thing for branch in node.branches for thing in certain_objects(grammar, branch.symbol))


def _owners(grammar: Grammar, visible: Iterable[str], below: Mapping[str, Counter[str]]) -> dict[str, tuple[str, ...]]:
    """Return for each And, Or or Set node that occurs at most once the objects that it closes: all their places are under it."""
    closes: dict[str, list[str]] = {}
    for symbol in visible:
        owner = grammar.root
        while grammar.nodes[owner].kind == "and":
            inside = [branch.symbol for branch in grammar.nodes[owner].branches if below[branch.symbol][symbol]]
            if len(inside) != 1 or inside[0] not in grammar.nodes:
                break
            owner = inside[0]
        closes.setdefault(owner, []).append(symbol)
    return {owner: tuple(symbols) for owner, symbols in closes.items()}


def _room_table(model: _Model, root: str, parameters: Floats, bag: Bag) -> tuple[float, Floats]:
    """Return the probability of a room's bag and its expected counts times that probability."""
    table = _table(model, parameters, bag, root, {})
    probability, counts = next(iter(table.values()))
    return probability, counts


def _table(model: _Model, parameters: Floats, bag: Bag, symbol: str, done: dict[str, Table]) -> Table:
    if symbol in done:
        return done[symbol]
    node, zero = model.nodes.get(symbol), np.zeros(len(parameters))
    empty = (0,) * len(bag)
    table: Table = {}
    if node is None:
        if symbol not in model.visible:
            table = {empty: (1.0, zero)}
        else:
            i = model.visible[symbol]
            table = {empty: (_MISSED, zero)}
            if bag[i]:
                table[(*empty[:i], 1, *empty[i + 1 :])] = (1.0 - _MISSED, zero)
    elif node.kind == "or":
        where = model.place[symbol, -1]
        for k, branch in enumerate(node.branches, where.start):
            _add(table, _table(model, parameters, bag, branch.symbol, done), parameters[k], k)
        table = _close(model, table, bag, model.closes.get(symbol, ()))
    else:
        table = {empty: (1.0, zero)}
        own = model.closes.get(symbol, ())
        last = {s: max(i for i, branch in enumerate(node.branches) if model.below[branch.symbol][s]) for s in own}
        for i, branch in enumerate(node.branches):
            inner = _table(model, parameters, bag, branch.symbol, done)
            if branch.multiplicity is not None:
                inner = _copies(inner, parameters, model.place[symbol, i], bag)
            table = _close(model, _product(table, inner, bag), bag, [s for s in own if last[s] == i])
    done[symbol] = table
    return table


def _add(table: Table, other: Table, factor: float, parameter: int) -> None:
    """Add a table times a parameter, which it thereby uses once."""
    for bag, (p, v) in other.items():
        counts = factor * v
        counts[parameter] += factor * p
        if bag in table:
            table[bag] = (table[bag][0] + factor * p, table[bag][1] + counts)
        else:
            table[bag] = (factor * p, counts)


def _copies(inner: Table, parameters: Floats, where: slice, bag: Bag) -> Table:
    """Return the table of 0, 1, 2, ... copies with the branch's probabilities."""
    power: Table = {(0,) * len(bag): (1.0, np.zeros(len(parameters)))}
    table: Table = {}
    for k in range(where.start, where.stop):
        if k > where.start:
            power = _product(power, inner, bag)
        _add(table, power, parameters[k], k)
    return table


def _product(first: Table, second: Table, bag: Bag) -> Table:
    """Return the table of two independent parts, without bags that hold more than the room does."""
    table: Table = {}
    for a, (p, v) in first.items():
        for b, (q, w) in second.items():
            key = tuple(x + y for x, y in zip(a, b, strict=True))
            if all(x <= y for x, y in zip(key, bag, strict=True)):
                counts = p * w + q * v
                if key in table:
                    table[key] = (table[key][0] + p * q, table[key][1] + counts)
                else:
                    table[key] = (p * q, counts)
    return table


def _close(model: _Model, table: Table, bag: Bag, symbols: Sequence[str]) -> Table:
    """Compare the counts of symbols that can come no more with the room's, and forget them."""
    if not symbols:
        return table
    places = [model.visible[symbol] for symbol in symbols]
    closed: Table = {}
    for key, (p, v) in table.items():
        factor = _EXTRA ** sum(bag[i] - key[i] for i in places)
        short = tuple(0 if i in places else count for i, count in enumerate(key))
        old = closed.get(short)
        closed[short] = (factor * p, factor * v) if old is None else (old[0] + factor * p, old[1] + factor * v)
    return closed


def _normalised(model: _Model, values: Floats) -> Floats:
    out = values.copy()
    for where in model.place.values():
        out[where] /= values[where].sum()
    return out


def _result(grammar: Grammar, model: _Model, prior: Floats, parameters: Floats, expected: Floats) -> BranchingResult:
    nodes: dict[str, Node] = {}
    counts: dict[str, float] = {}
    for name, node in grammar.nodes.items():
        branches: list[Branch] = []
        for i, branch in enumerate(node.branches):
            if node.kind == "or":
                where, index = model.place[name, -1], model.place[name, -1].start + i
                branches.append(replace(branch, probability=float(parameters[index])))
            elif node.kind == "set":
                where = model.place[name, i]
                branches.append(replace(branch, multiplicity=tuple(parameters[where].tolist())))
            else:
                branches.append(branch)
                continue
            seen = any(symbol in model.visible for symbol in model.below[branch.symbol])
            if seen:
                counts[name] = max(counts.get(name, 0.0), float(expected[where].sum()))
            elif node.kind == "set":
                branches[-1] = branch
        nodes[name] = replace(node, branches=tuple(branches))
    return BranchingResult(nodes=nodes, counts=counts)
