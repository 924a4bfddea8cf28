"""The choices of a derivation whose probabilities are corrected, and how often sampled rooms made them.

The size of the room and the numbers of doors and windows are choices like branches.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from grammar.derivation.crowding import used_share, wall_share
from grammar.derivation.openings import COUNT
from grammar.derivation.shell import ROOM_SIZE
from grammar.geometry.arrays import Bools, Floats, Ints
from grammar.learning.branching import certain_objects
from grammar.sampled_room import sample_room
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.room_rules import SHAPES
from grammar.spec.rules import Grammar, Node
from scene_description import ParseNode

ROOM_SIZES = "room.sizes"
"""Stands for a node where the choice is a component of the mixture of the room's size; no symbol has a dot."""

ROOM_SHAPES = "room.shapes"
"""The same where the choice is a shape of the outline."""

Branching = dict[tuple[str, int], Floats]
"""Probabilities of each Or node, (node, -1), and of the multiplicities of each Set branch, (node, branch)."""

LEAST = 1e-5
"""Probabilities below this count as this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledCounts:
    """One sampled room, or none (``failed``): the choices of its derivation, (node, branch, choice), and its objects by category.

    ``used_share``, ``wall_share``: of floor and walls that its furniture takes (:mod:`grammar.derivation.crowding`).
    """

    failed: bool
    branches: tuple[tuple[str, int, int], ...]
    categories: Mapping[str, int]
    used_share: float = 0.0
    wall_share: float = 0.0


def count_room(grammar: Grammar, categories: Categories, rng: np.random.Generator) -> SampledCounts:
    """Sample a room and count what is in it."""
    try:
        room = sample_room(grammar, categories, SceneRequest(room_type=grammar.room_type), rng)
    except RequestError:
        return SampledCounts(failed=True, branches=(), categories={})
    found = Counter(item.category for item in room.objects)
    rules = {vertex.object: grammar.objects[vertex.symbol] for vertex in room.parse_graph.nodes if vertex.symbol in grammar.objects}
    things = [(rules[item.id], item.size_m) for item in room.objects]
    return SampledCounts(
        failed=False,
        branches=tuple(_taken(grammar, room.parse_graph.nodes)),
        categories=dict(found),
        used_share=used_share(grammar, categories, room.room, things),
        wall_share=wall_share(categories, room.room, things),
    )


def _taken(grammar: Grammar, nodes: Sequence[ParseNode]) -> Iterable[tuple[str, int, int]]:
    """Yield the choices of a derivation: the room's size, numbers of openings, branches of Or nodes, copies of Set branches in order."""
    place: Counter[int] = Counter()
    for vertex in nodes:
        if vertex.kind == "attribute" and vertex.symbol == ROOM_SIZE:
            yield ROOM_SIZES, -1, int(vertex.choice.split(",")[0])
        elif vertex.kind == "attribute" and vertex.symbol == "shape" and (shape := vertex.choice.split(",")[0]) in SHAPES:
            yield ROOM_SHAPES, -1, SHAPES.index(shape)
        elif vertex.kind == "attribute" and vertex.symbol.removesuffix(COUNT) in grammar.openings:
            yield vertex.symbol, -1, int(vertex.choice)
        elif vertex.kind == "or" and vertex.symbol in grammar.nodes:
            names = [branch.symbol for branch in grammar.nodes[vertex.symbol].branches]
            yield vertex.symbol, -1, names.index(vertex.choice)
        elif vertex.kind == "set" and vertex.parent is not None and vertex.choice != "":
            owner = nodes[vertex.parent].symbol
            yield owner, place[vertex.parent], int(vertex.choice)
            place[vertex.parent] += 1


class Choices(NamedTuple):
    """The choices whose probabilities move, one after the other in one vector: keys, first entry of each, names of the categories.

    ``target``: (c,) log-probabilities by counting; ``pull``: (c, k) share of each category in the objects that a choice leads to in every
    derivation.
    """

    keys: tuple[tuple[str, int], ...]
    first: Ints
    names: tuple[str, ...]
    target: Floats
    pull: Floats

    @classmethod
    def of(cls, grammar: Grammar, branching: Branching, names: Sequence[str]) -> "Choices":
        """Return the choices with these probabilities; ``names``: the categories of the data."""
        keys = tuple(sorted(branching))
        first = np.cumsum([0, *(len(branching[key]) for key in keys)])
        target = np.log(np.maximum(np.concatenate([branching[key] for key in keys]), LEAST)) if keys else np.zeros(0)
        pull = np.concatenate([_pull(grammar, key, names) for key in keys]) if keys else np.zeros((0, len(names)))
        return cls(keys, first, tuple(names), target, pull)

    @property
    def owner(self) -> Ints:
        """Index of the key that each entry belongs to, (c,)."""
        return np.repeat(np.arange(len(self.keys)), np.diff(self.first))

    @property
    def sized(self) -> Bools:
        """Which entries are sizes of rooms, (c,)."""
        return self._of([key[0] == ROOM_SIZES for key in self.keys])

    @property
    def bounding(self) -> Bools:
        """Which entries are sizes of rooms or numbers of openings, which leave furniture its space, (c,)."""
        return self._of([key[0] == ROOM_SIZES or key[0].endswith(COUNT) for key in self.keys])

    def _of(self, chosen: Sequence[bool]) -> Bools:
        return np.repeat(np.array(chosen, np.bool_), np.diff(self.first))

    def taken(self, rooms: Sequence[SampledCounts]) -> Floats:
        """Return (n, c) how often each room made each choice."""
        ends = zip(self.keys, self.first, self.first[1:], strict=False)
        place = {(*key, choice): int(begin) + choice for key, begin, end in ends for choice in range(int(end - begin))}
        found = np.zeros((len(rooms), len(self.target)))
        for row, room in zip(found, rooms, strict=True):
            for branch in room.branches:
                if branch in place:
                    row[place[branch]] += 1.0
        return found

    def branching(self, logs: Floats) -> Branching:
        """Return a vector of log-probabilities as probabilities by key."""
        return {key: _normalized(np.exp(logs[begin:end])) for key, begin, end in zip(self.keys, self.first, self.first[1:], strict=False)}


def branching_of(grammar: Grammar) -> Branching:
    """Return the probabilities of all choices of a grammar."""
    branching: Branching = {}
    for name, node in grammar.nodes.items():
        if node.kind == "or":
            branching[name, -1] = np.array([branch.probability or 0.0 for branch in node.branches])
        for i, branch in enumerate(node.branches):
            if branch.multiplicity is not None:
                branching[name, i] = np.array(branch.multiplicity)
    if grammar.room.sizes:
        branching[ROOM_SIZES, -1] = np.array([size.probability for size in grammar.room.sizes])
        if all(size.arm_m is None for size in grammar.room.sizes):
            branching[ROOM_SHAPES, -1] = np.array([getattr(grammar.room.shapes, name) for name in SHAPES])
    return branching | {(kind + COUNT, -1): np.array(rule.multiplicity) for kind, rule in grammar.openings.items()}


def _is_of_shell(key: tuple[str, int]) -> bool:
    return key[0] in (ROOM_SIZES, ROOM_SHAPES) or key[0].endswith(COUNT)


def counted(grammar: Grammar, key: tuple[str, int], covered: AbstractSet[str]) -> bool:
    """Return whether a choice is of the room's shell or leads, in every derivation, to an object that the data records."""
    if _is_of_shell(key):
        return key[0] in (ROOM_SIZES, ROOM_SHAPES) or key[0] in covered
    branches = grammar.nodes[key[0]].branches
    chosen = branches if key[1] < 0 else (branches[key[1]],)
    return any(symbol in covered for branch in chosen for symbol in certain_objects(grammar, branch.symbol))


def _pull(grammar: Grammar, key: tuple[str, int], names: Sequence[str]) -> Floats:
    """Return (choices, names): the share of each category in the objects that a choice leads to in every derivation, times the copies."""

    def of(symbol: str) -> Floats:
        row = np.zeros(len(names))
        for certain in certain_objects(grammar, symbol):
            if (category := grammar.objects[certain].category) in names:
                row[names.index(category)] += 1.0
        return np.asarray(row / max(row.sum(), 1.0))

    if _is_of_shell(key):
        return np.zeros((len(branching_of(grammar)[key]), len(names)))
    node: Node = grammar.nodes[key[0]]
    if key[1] < 0:
        return np.array([of(branch.symbol) for branch in node.branches])
    branch = node.branches[key[1]]
    return np.outer(np.arange(len(branch.multiplicity or ())), of(branch.symbol))


def _possible(before: Sequence[float], probabilities: Floats) -> tuple[float, ...]:
    """Return probabilities with those at 0 that were 0 before."""
    return tuple(_normalized(np.where(np.array(before) > 0.0, probabilities, 0.0)).tolist())


def _normalized(branching: Floats) -> Floats:
    return np.asarray(branching / branching.sum())


def with_branching(grammar: Grammar, branching: Mapping[tuple[str, int], Floats]) -> Grammar:
    """Return a grammar with these probabilities of choices; what had none keeps it."""
    nodes = {}
    for name, node in grammar.nodes.items():
        branches = []
        for i, branch in enumerate(node.branches):
            if (name, -1) in branching:
                branch = replace(branch, probability=float(branching[name, -1][i]))
            elif (name, i) in branching:
                branch = replace(branch, multiplicity=tuple(branching[name, i].tolist()))
            branches.append(branch)
        nodes[name] = replace(node, branches=tuple(branches))
    room = grammar.room
    if (ROOM_SIZES, -1) in branching:
        odds = branching[ROOM_SIZES, -1].tolist()
        room = replace(room, sizes=tuple(replace(size, probability=share) for size, share in zip(room.sizes, odds, strict=True)))
    if (ROOM_SHAPES, -1) in branching:
        before = [getattr(room.shapes, name) for name in SHAPES]
        odds = [round(share, 5) for share in _possible(before, branching[ROOM_SHAPES, -1])]
        room = replace(room, shapes=replace(room.shapes, **dict(zip(SHAPES, (1.0 - sum(odds[1:]), *odds[1:]), strict=True))))
    openings = {
        kind: replace(rule, multiplicity=_possible(rule.multiplicity, branching[key])) if (key := (kind + COUNT, -1)) in branching else rule
        for kind, rule in grammar.openings.items()
    }
    return replace(grammar, nodes=nodes, room=room, openings=openings)
