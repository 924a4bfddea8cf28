"""Branching probabilities of Or and Set nodes, by expectation maximisation over all derivations that explain each room's objects.

What is observed of a room is a bag: the number of objects of each symbol.  Its derivation is hidden (a floor lamp may stand for itself or
belong to an armchair), so each branch is counted by its expectation over all derivations, and the probabilities are re-estimated until they
converge.  With a single derivation per room this is plain counting (Jiang et al., IJCV 2018, section 3.1).  The expectations come from one
pass from the terminals up, in which a table holds for each bag its probability and the counts that it implies.

A Dirichlet prior of ``alpha`` pseudo-counts around the base grammar smooths the counts.  Symbols that the data does not cover are ignored:
branches that lead only to them keep their probabilities.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from operator import add, le, sub
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.kernels import entry
from grammar.spec.rules import Branch, Grammar, Node

Bag = tuple[int, ...]
Table = dict[Bag, tuple[float, Floats]]

_NEGLIGIBLE = 1e-12
"""Share of a part's likeliest bag below which a bag is left out."""

_FEW_PAIRS = 8
"""Pairs of bags that are combined one by one; of more the arrays are worth making."""

Bare = dict[str, tuple[float, Floats]]

_MISSED = 1e-3
"""Probability that an object of a covered symbol which a derivation has was not recorded."""

_EXTRA = 1e-4
"""Factor for each recorded object that a derivation lacks."""

_LEAST_PROBABILITY = 1e-250
"""A room that is less likely, which takes dozens of objects beyond all derivations, is not counted."""

_UNSEEN_SHARE = 0.02
"""Share of the prior of a covered Set branch that is spread evenly over all multiplicities, so that none is impossible."""

_MOST_COPIES = 64
"""Multiplicities of one branch, as many as a grammar may give."""

_ROUNDS, _CONVERGED = 30, 1e-3


def product(first: Table, second: Table, bag: Bag) -> Table:
    """Return the table of two independent parts, without bags that hold more than the room does or that are next to impossible."""
    if len(second) == 1:
        ((b, (q, w)),) = second.items()
        if not any(b):
            return {a: (p * q, p * w + q * v) for a, (p, v) in first.items()}
    table = _paired(first, second, bag) if len(first) * len(second) <= _FEW_PAIRS else _summed(first, second, bag)
    least = _NEGLIGIBLE * max((p for p, _ in table.values()), default=0.0)
    return {key: value for key, value in table.items() if value[0] >= least}


def _paired(first: Table, second: Table, bag: Bag) -> Table:
    table: Table = {}
    for a, (p, v) in first.items():
        free = tuple(map(sub, bag, a))
        for b, (q, w) in second.items():
            if all(map(le, b, free)):
                key = tuple(map(add, a, b))
                old = table.get(key)
                both = p * q
                counts = p * w + q * v
                table[key] = (both, counts) if old is None else (old[0] + both, old[1] + counts)
    return table


def _summed(first: Table, second: Table, bag: Bag) -> Table:
    """Return what :func:`_paired` does, to the bit, by a kernel over all pairs."""
    both = np.array(list(first))[:, None, :] + np.array(list(second))[None, :, :]
    i, j = np.nonzero((both <= np.array(bag)).all(2))
    places: dict[Bag, int] = {}
    k = np.array([places.setdefault(tuple(key), len(places)) for key in both[i, j].tolist()], np.int64)
    p, q = (np.array([value for value, _ in part.values()]) for part in (first, second))
    v, w = (np.array([counts for _, counts in part.values()]) for part in (first, second))
    chances, counts = np.zeros(len(places)), np.zeros((len(places), v.shape[1]))
    _add_pairs(p, v, q, w, np.stack([i, j, k], axis=1), chances, counts)
    return {key: (float(chances[place]), counts[place]) for key, place in places.items()}


@entry
def _add_pairs(p: Floats, v: Floats, q: Floats, w: Floats, pairs: Ints, chances: Floats, counts: Floats) -> None:
    """Add the probability of each pair of bags, (n, 3) both bags and the one that they make, and its counts to ``chances``, ``counts``."""
    for k in range(len(pairs)):
        a, b, to = pairs[k, 0], pairs[k, 1], pairs[k, 2]
        chances[to] += p[a] * q[b]
        for c in range(v.shape[1]):
            counts[to, c] += p[a] * w[b, c] + q[b] * v[a, c]


@dataclass(frozen=True, slots=True, kw_only=True)
class BranchingResult:
    """New nodes, and for each node that changed how often it was counted (expected number of its occurrences in the rooms)."""

    nodes: Mapping[str, Node]
    counts: Mapping[str, float]


class _Model(NamedTuple):
    """The graph and where its parameters are.

    nodes: of the grammar; covered: symbols that the data records; visible: those that a room holds -> their index in its bag; place: slice
    of the vector of parameters for each Or node, (node, -1), and each Set branch, (node, branch); below: symbol -> how often each terminal
    occurs below it; closes: node -> terminals whose counts are final at it.
    """

    nodes: Mapping[str, Node]
    covered: AbstractSet[str]
    visible: Mapping[str, int]
    place: Mapping[tuple[str, int], slice]
    below: Mapping[str, Counter[str]]
    closes: Mapping[str, tuple[str, ...]]


def learn_branching(grammar: Grammar, rooms: Sequence[Iterable[str]], covered: AbstractSet[str], alpha: float) -> BranchingResult:
    """Estimate all branching probabilities.

    ``alpha``: pseudo-counts of the prior, the base's probabilities, for each Or node and each Set branch; ``covered``: symbols that
    the data records.
    """
    below: dict[str, Counter[str]] = {}
    visible = {symbol: i for i, symbol in enumerate(sorted(covered & _terminals_below(grammar, grammar.root, below).keys()))}
    bags: Counter[Bag] = Counter()
    for symbols in rooms:
        counted = Counter(symbols)
        bags[tuple(counted[symbol] for symbol in visible)] += 1
    model, prior = _model(grammar, visible, below, bags)
    parameters, expected = prior, np.zeros_like(prior)
    held = [(_held(model, bag), times) for bag, times in bags.items()]
    # alternate expected counts and probabilities
    for _ in range(_ROUNDS):
        expected = np.zeros_like(prior)
        bare: Bare = {}
        for (room, bag), times in held:
            probability, counts = _room_table(room, grammar.root, parameters, bag, bare)
            if probability > _LEAST_PROBABILITY:
                expected += times * counts / probability
        before, parameters = parameters, _normalised(model, expected + alpha * prior)
        if float(np.abs(parameters - before).max()) < _CONVERGED:
            break
    return _result(grammar, model, prior, parameters, expected)


def _model(grammar: Grammar, visible: Mapping[str, int], below: Mapping[str, Counter[str]], bags: Iterable[Bag]) -> tuple[_Model, Floats]:
    """Return the model and its prior; a Set branch gets more multiplicities where a room holds more objects than it gives."""
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
            certain = [symbol for symbol in certain_objects(grammar, branch.symbol) if symbol in most]
            if certain:
                values.extend(0.0 for _ in range(min(most[certain[0]] + 1, _MOST_COPIES) - len(values)))
                values = [(1.0 - _UNSEEN_SHARE) * value + _UNSEEN_SHARE / len(values) for value in values]
            place[name, i] = slice(len(prior), len(prior) + len(values))
            prior.extend(values)
    closes = _owners(grammar, visible, below)
    return _Model(grammar.nodes, visible.keys(), visible, place, below, closes), np.array(prior)


def _held(model: _Model, bag: Bag) -> tuple[_Model, Bag]:
    """Return the model and the bag of a room over those symbols only that the room holds."""
    symbols = [symbol for symbol, i in model.visible.items() if bag[i]]
    visible = {symbol: k for k, symbol in enumerate(symbols)}
    closes = {node: tuple(symbol for symbol in closed if symbol in visible) for node, closed in model.closes.items()}
    return model._replace(visible=visible, closes=closes), tuple(bag[model.visible[symbol]] for symbol in symbols)


def _terminals_below(grammar: Grammar, symbol: str, below: dict[str, Counter[str]]) -> Counter[str]:
    """Return how often each terminal occurs below a symbol, and note the same for all symbols below it."""
    if symbol not in below:
        node = grammar.nodes.get(symbol)
        found: Counter[str] = Counter([symbol]) if node is None else Counter()
        for branch in node.branches if node else ():
            found.update(_terminals_below(grammar, branch.symbol, below))
        below[symbol] = found
    return below[symbol]


def certain_objects(grammar: Grammar, symbol: str) -> tuple[str, ...]:
    """Return the objects that a symbol leads to in every derivation: itself, or those of an And node's branches, in order."""
    node = grammar.nodes.get(symbol)
    if node is None:
        return (symbol,)
    if node.kind != "and":
        return ()
    return tuple(certain for branch in node.branches for certain in certain_objects(grammar, branch.symbol))


def _owners(grammar: Grammar, visible: Iterable[str], below: Mapping[str, Counter[str]]) -> dict[str, tuple[str, ...]]:
    """Return for each node that occurs at most once the terminals that it closes: all their occurrences are below it."""
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


def _room_table(model: _Model, root: str, parameters: Floats, bag: Bag, bare: Bare) -> tuple[float, Floats]:
    """Return the probability of a room's bag and its expected counts times that probability."""
    table = _table(model, parameters, bag, root, ({}, bare))
    probability, counts = next(iter(table.values()))
    return probability, counts


def _table(model: _Model, parameters: Floats, bag: Bag, symbol: str, known: tuple[dict[str, Table], Bare]) -> Table:
    """Return the table of a symbol; ``known`` are those of this room, and those of what holds nothing of a room, which all rooms share."""
    done, bare = known
    if symbol in done:
        return done[symbol]
    empty = (0,) * len(bag)
    nothing = model.visible.keys().isdisjoint(model.below[symbol])
    if nothing and symbol in bare:
        return {empty: bare[symbol]}
    node, zero = model.nodes.get(symbol), np.zeros(len(parameters))
    table: Table = {}
    if node is None:
        if symbol not in model.visible:
            table = {empty: (_MISSED if symbol in model.covered else 1.0, zero)}
        else:
            i = model.visible[symbol]
            table = {empty: (_MISSED, zero)}
            if bag[i]:
                table[(*empty[:i], 1, *empty[i + 1 :])] = (1.0 - _MISSED, zero)
    elif node.kind == "or":
        where = model.place[symbol, -1]
        for k, branch in enumerate(node.branches, where.start):
            _add(table, _table(model, parameters, bag, branch.symbol, known), parameters[k], k)
        table = _close(model, table, bag, model.closes.get(symbol, ()))
    else:
        table = {empty: (1.0, zero)}
        own = model.closes.get(symbol, ())
        last = {s: max(i for i, branch in enumerate(node.branches) if model.below[branch.symbol][s]) for s in own}
        for i, branch in enumerate(node.branches):
            inner = _table(model, parameters, bag, branch.symbol, known)
            if branch.multiplicity is not None:
                inner = _copies(inner, parameters, model.place[symbol, i], bag)
            table = _close(model, product(table, inner, bag), bag, [s for s in own if last[s] == i])
    done[symbol] = table
    if nothing:
        bare[symbol] = table[empty]
    return table


def _add(table: Table, other: Table, factor: float, parameter: int) -> None:
    """Add a table times a parameter; the counts note that this parameter is used once more."""
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
            power = product(power, inner, bag)
        _add(table, power, parameters[k], k)
    return table


def _close(model: _Model, table: Table, bag: Bag, symbols: Sequence[str]) -> Table:
    """Compare the final counts of symbols with the room's, and sum over them."""
    if not symbols:
        return table
    places = [model.visible[symbol] for symbol in symbols]
    closed: Table = {}
    for key, (p, v) in table.items():
        factor, short_ = 1.0, list(key)
        for i in places:
            factor *= _EXTRA ** (bag[i] - key[i])
            short_[i] = 0
        short = tuple(short_)
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
