"""Odds of the structure such that the rooms that pass have the counts of the data.

Ancestral sampling throws away what finds no valid layout, and bulky furniture is thrown away more often, so the rooms that come out are
thinner than the branching probabilities. The likelihood of the data under the grammar cut to valid rooms has its greatest value where each
branch is as frequent among the rooms that pass as in the data (the gradient in the log-odds is the difference of both). Rooms are sampled,
and since whether a structure passes does not depend on the odds, their frequencies under any other odds follow from weights, the ratio of
the structures' probabilities (Monte Carlo maximum likelihood: Geyer and Thompson, J. Royal Statistical Society B 1992). Under these
weights the odds move by the ratio of what a branch should be and what it is, as iterative scaling does, until both agree; then rooms are
sampled with the new odds, and again. What a branch should be is first what counting gave, then shifted until each category is as frequent
as in the data.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grammar.geometry.arrays import Floats
from grammar.learning.branching import certain_objects
from grammar.sample_room import sample_room
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar, Node
from scene_description import ParseNode

Odds = dict[tuple[str, int], Floats]
"""Probabilities of each Or node, (node, -1), and of the multiplicities of each Set branch, (node, branch)."""

RoomSampler = Callable[[Grammar, int, Sequence[int]], list["SampledCounts"]]
"""Grammar, stream of random numbers, indices of rooms -> what was in each of them."""

_LEAST = 1e-5
_STEPS = 300
_CONSTANT_STEPS = 30
_RATE = 0.3
_FARTHEST = 0.8
"""How far the logarithm of any odds may move in one round, since the weights tell less and less."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TruncationOptions:
    """``iterations`` of ``rooms`` each."""

    iterations: int = 0
    rooms: int = 300


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledCounts:
    """One sampled room, or none (``failed``): branches that were taken, (node, branch, choice), and objects by category."""

    failed: bool
    branches: tuple[tuple[str, int, int], ...]
    categories: Mapping[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class TruncationRow:
    """One iteration: divergence of the sampled categories from the data's in nats, mean objects of the covered kinds, rooms that failed."""

    iteration: int
    category_kl: float
    objects: float
    failed: int


def category_kl(p: Mapping[str, float], q: Mapping[str, float]) -> float:
    """Return ``sum p (log(p + 1e-6) - log(q + 1e-6))`` (ATISS, Paschalidou et al., NeurIPS 2021)."""
    return sum(value * (math.log(value + 1e-6) - math.log(q.get(name, 0.0) + 1e-6)) for name, value in p.items())


def frequencies(counts: Mapping[str, float], names: Iterable[str]) -> dict[str, float]:
    """Return the shares of the named categories among themselves."""
    chosen = {name: float(counts.get(name, 0.0)) for name in sorted(names)}
    total = sum(chosen.values())
    return {name: value / max(total, 1e-12) for name, value in chosen.items()}


def correct_truncation(
    grammar: Grammar, wanted: Mapping[str, float], covered: AbstractSet[str], options: TruncationOptions, sampler: RoomSampler
) -> tuple[Grammar, tuple[TruncationRow, ...]]:
    """Return the grammar whose valid rooms have the branch frequencies of ``grammar`` and the category counts ``wanted``.

    Args:
        grammar: learned, with the branching probabilities that counting gave.
        wanted: category -> mean number in a room of the data, of the covered categories.
        covered: symbols that the data records; only branches that surely lead to one of them move.
        options: of the approximation.
        sampler: of rooms.
    """
    layout = _Layout.of(grammar, {key: odds for key, odds in _odds(grammar).items() if _counted(grammar, key, covered)}, sorted(wanted))
    logs, rows, pool = layout.target, [], _Pool([], [], [])
    for iteration in range(options.iterations):
        rooms = sampler(_with_odds(grammar, layout.odds(logs)), iteration, range(options.rooms))
        passed = [room for room in rooms if not room.failed]
        if not passed:
            raise RequestError(f"{grammar.room_type}: expected some valid rooms of {len(rooms)}, got none; widen the room or its budget")
        seen = {name: sum(room.categories.get(name, 0) for room in passed) / len(passed) for name in wanted}
        rows.append(
            TruncationRow(
                iteration=iteration,
                category_kl=category_kl(frequencies(wanted, wanted), frequencies(seen, wanted)),
                objects=sum(seen.values()),
                failed=len(rooms) - len(passed),
            )
        )
        pool.logs.append(logs)
        pool.taken.append(layout.taken(passed))
        pool.has.append(np.array([[room.categories.get(name, 0) for name in layout.names] for room in passed], np.float64))
        logs = _scaled(layout, pool, np.array([wanted[name] for name in layout.names]), logs)
    return _with_odds(grammar, layout.odds(logs)), tuple(rows)


class _Pool(NamedTuple):
    """Of each round the log-odds that its rooms were sampled with, (c,), what they took, (n, c), and their categories' counts, (n, k)."""

    logs: list[Floats]
    taken: list[Floats]
    has: list[Floats]


class _Layout(NamedTuple):
    """The choices that move, one after the other in one vector: keys, first place of each, names of the categories.

    ``target``: (c,) log-odds by counting; ``pull``: (c, k) what a choice surely brings of each category.
    """

    keys: tuple[tuple[str, int], ...]
    first: NDArray[np.int64]
    names: tuple[str, ...]
    target: Floats
    pull: Floats

    @classmethod
    def of(cls, grammar: Grammar, odds: Odds, names: Sequence[str]) -> _Layout:
        keys = tuple(sorted(odds))
        first = np.cumsum([0, *(len(odds[key]) for key in keys)])
        target = np.log(np.maximum(np.concatenate([odds[key] for key in keys]), _LEAST)) if keys else np.zeros(0)
        pull = np.concatenate([_pull(grammar, key, names) for key in keys]) if keys else np.zeros((0, len(names)))
        return cls(keys, first, tuple(names), target, pull)

    @property
    def owner(self) -> NDArray[np.int64]:
        """To which key each entry belongs, (c,)."""
        return np.repeat(np.arange(len(self.keys)), np.diff(self.first))

    def taken(self, rooms: Sequence[SampledCounts]) -> Floats:
        """Return (n, c) how often each room took each choice."""
        ends = zip(self.keys, self.first, self.first[1:], strict=False)
        place = {(*key, choice): int(begin) + choice for key, begin, end in ends for choice in range(int(end - begin))}
        found = np.zeros((len(rooms), len(self.target)))
        for row, room in zip(found, rooms, strict=True):
            for branch in room.branches:
                if branch in place:
                    row[place[branch]] += 1.0
        return found

    def odds(self, logs: Floats) -> Odds:
        """Return a vector of log-odds as probabilities of each choice."""
        return {key: _normal(np.exp(logs[begin:end])) for key, begin, end in zip(self.keys, self.first, self.first[1:], strict=False)}


def _scaled(layout: _Layout, pool: _Pool, mean: Floats, start: Floats) -> Floats:
    """Return the log-odds under which all rooms sampled so far, weighted, have the frequencies wanted."""
    taken, has, owner = np.concatenate(pool.taken), np.concatenate(pool.has), layout.owner
    mixture = _log_mixture(pool, taken)
    logs, should = start.copy(), layout.target.copy()
    for _ in range(_STEPS):
        weight = taken @ logs - mixture
        weight = np.exp(weight - weight.max())
        weight /= weight.sum()
        should = _log_normal(should + _RATE * layout.pull @ np.log((mean + 0.02) / (weight @ has + 0.02)), owner)
        counts = weight @ taken * len(taken)
        total = np.bincount(owner, counts)[owner]
        now = np.log(np.maximum((counts + np.exp(should)) / (total + 1.0), _LEAST))
        moved = logs + _RATE * total / (total + 20.0) * (should - now)
        logs = _log_normal(start + np.clip(moved - start, -_FARTHEST, _FARTHEST), owner)
    return logs


def _log_mixture(pool: _Pool, taken: Floats) -> Floats:
    """Return for each room the logarithm of the density of all rounds together.

    The rounds' normalising constants, the shares of their structures that pass, are unknown; they follow from each other (Shirts and
    Chodera, J. Chemical Physics 2008).
    """
    each = np.array([taken @ logs + math.log(len(part)) for logs, part in zip(pool.logs, pool.taken, strict=True)])
    constants = np.zeros(len(each))
    for _ in range(_CONSTANT_STEPS):
        mixture = np.logaddexp.reduce(each - constants[:, None], axis=0)
        sizes = np.array([math.log(len(part)) for part in pool.taken])
        constants = np.logaddexp.reduce(each - sizes[:, None] - mixture, axis=1)
        constants -= constants[0]
    return np.asarray(np.logaddexp.reduce(each - constants[:, None], axis=0))


def _log_normal(logs: Floats, owner: NDArray[np.int64]) -> Floats:
    """Return log-odds normalised for each choice; ``owner`` says to which choice an entry belongs."""
    return np.asarray(logs - np.log(np.bincount(owner, np.exp(logs)))[owner])


def count_room(grammar: Grammar, categories: Categories, rng: np.random.Generator) -> SampledCounts:
    """Sample a room and count what is in it."""
    try:
        room = sample_room(grammar, categories, SceneRequest(room_type=grammar.room_type), rng)
    except RequestError:
        return SampledCounts(failed=True, branches=(), categories={})
    found = Counter(thing.category for thing in room.objects)
    return SampledCounts(failed=False, branches=tuple(_taken(grammar, room.parse_graph.nodes)), categories=dict(found))


def truncation_csv(rows: Sequence[TruncationRow]) -> str:
    """Return the curve as CSV."""
    lines = ["iteration,category_kl,objects,failed"]
    lines.extend(f"{row.iteration},{row.category_kl:.6g},{row.objects:.6g},{row.failed}" for row in rows)
    return "\n".join(lines) + "\n"


def _taken(grammar: Grammar, nodes: Sequence[ParseNode]) -> Iterable[tuple[str, int, int]]:
    """Yield the choices of a derivation: an Or node's branch, and the copies of each Set branch, which come in order below their node."""
    place: Counter[int] = Counter()
    for vertex in nodes:
        if vertex.kind == "or" and vertex.symbol in grammar.nodes:
            names = [branch.symbol for branch in grammar.nodes[vertex.symbol].branches]
            yield vertex.symbol, -1, names.index(vertex.choice)
        elif vertex.kind == "set" and vertex.parent is not None and vertex.choice != "":
            owner = nodes[vertex.parent].symbol
            yield owner, place[vertex.parent], int(vertex.choice)
            place[vertex.parent] += 1


def _odds(grammar: Grammar) -> Odds:
    odds: Odds = {}
    for name, node in grammar.nodes.items():
        if node.kind == "or":
            odds[name, -1] = np.array([branch.probability or 0.0 for branch in node.branches])
        for i, branch in enumerate(node.branches):
            if branch.multiplicity is not None:
                odds[name, i] = np.array(branch.multiplicity)
    return odds


def _counted(grammar: Grammar, key: tuple[str, int], covered: AbstractSet[str]) -> bool:
    """Return whether a choice surely decides about an object that the data records."""
    branches = grammar.nodes[key[0]].branches
    chosen = branches if key[1] < 0 else (branches[key[1]],)
    return any(symbol in covered for branch in chosen for symbol in certain_objects(grammar, branch.symbol))


def _pull(grammar: Grammar, key: tuple[str, int], names: Sequence[str]) -> Floats:
    """Return (choices, names): the share of each category in the objects that a choice surely brings, times their copies."""

    def of(symbol: str) -> Floats:
        row = np.zeros(len(names))
        for thing in certain_objects(grammar, symbol):
            if (category := grammar.objects[thing].category) in names:
                row[names.index(category)] += 1.0
        return np.asarray(row / max(row.sum(), 1.0))

    node: Node = grammar.nodes[key[0]]
    if key[1] < 0:
        return np.array([of(branch.symbol) for branch in node.branches])
    branch = node.branches[key[1]]
    return np.outer(np.arange(len(branch.multiplicity or ())), of(branch.symbol))


def _normal(odds: Floats) -> Floats:
    return np.asarray(odds / odds.sum())


def _with_odds(grammar: Grammar, odds: Mapping[tuple[str, int], Floats]) -> Grammar:
    nodes = {}
    for name, node in grammar.nodes.items():
        branches = []
        for i, branch in enumerate(node.branches):
            if (name, -1) in odds:
                branch = replace(branch, probability=float(odds[name, -1][i]))
            elif (name, i) in odds:
                branch = replace(branch, multiplicity=tuple(odds[name, i].tolist()))
            branches.append(branch)
        nodes[name] = replace(node, branches=tuple(branches))
    return replace(grammar, nodes=nodes)
