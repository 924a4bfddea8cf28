"""What sampled rooms hold: the choices of their derivations and their objects by category."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grammar.derivation.shell import COUNT, ROOM_SIZE
from grammar.sampled_room import sample_room
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar
from scene_description import ParseNode

ROOM_SIZES = "room.sizes"
"""Stands for a node where the choice is a component of the mixture of the room's size; no symbol has a dot."""


RoomSampler = Callable[[Grammar, int, Sequence[int]], list["SampledCounts"]]
"""Grammar, stream of random numbers, indices of rooms -> what was in each of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledCounts:
    """One sampled room, or none (``failed``): the choices of its derivation, (node, branch, choice), and its objects by category."""

    failed: bool
    branches: tuple[tuple[str, int, int], ...]
    categories: Mapping[str, int]


def count_room(grammar: Grammar, categories: Categories, rng: np.random.Generator) -> SampledCounts:
    """Sample a room and count what is in it."""
    try:
        room = sample_room(grammar, categories, SceneRequest(room_type=grammar.room_type), rng)
    except RequestError:
        return SampledCounts(failed=True, branches=(), categories={})
    found = Counter(item.category for item in room.objects)
    return SampledCounts(failed=False, branches=tuple(_taken(grammar, room.parse_graph.nodes)), categories=dict(found))


def _taken(grammar: Grammar, nodes: Sequence[ParseNode]) -> Iterable[tuple[str, int, int]]:
    """Yield the choices of a derivation: the room's size, numbers of openings, branches of Or nodes, copies of Set branches in order."""
    place: Counter[int] = Counter()
    for vertex in nodes:
        if vertex.kind == "attribute" and vertex.symbol == ROOM_SIZE:
            yield ROOM_SIZES, -1, int(vertex.choice.split(",")[0])
        elif vertex.kind == "attribute" and vertex.symbol.removesuffix(COUNT) in grammar.openings:
            yield vertex.symbol, -1, int(vertex.choice)
        elif vertex.kind == "or" and vertex.symbol in grammar.nodes:
            names = [branch.symbol for branch in grammar.nodes[vertex.symbol].branches]
            yield vertex.symbol, -1, names.index(vertex.choice)
        elif vertex.kind == "set" and vertex.parent is not None and vertex.choice != "":
            owner = nodes[vertex.parent].symbol
            yield owner, place[vertex.parent], int(vertex.choice)
            place[vertex.parent] += 1
