"""What sampled rooms hold: the choices of their derivations and their objects by category."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grammar.sample_room import sample_room
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar
from scene_description import ParseNode
from scene_description.polygons import signed_area_m2

RoomSampler = Callable[[Grammar, int, Sequence[int]], list["SampledCounts"]]
"""Grammar, stream of random numbers, indices of rooms -> what was in each of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledCounts:
    """One sampled room, or none (``failed``): the choices of its derivation, (node, branch, choice), and its objects by category.

    ``floor_share``: share of the floor that what stands on it covers; ``proportion``: long side over short one.
    """

    failed: bool
    branches: tuple[tuple[str, int, int], ...]
    categories: Mapping[str, int]
    floor_share: float = 0.0
    proportion: float = 1.0


def count_room(grammar: Grammar, categories: Categories, rng: np.random.Generator) -> SampledCounts:
    """Sample a room and count what is in it."""
    try:
        room = sample_room(grammar, categories, SceneRequest(room_type=grammar.room_type), rng)
    except RequestError:
        return SampledCounts(failed=True, branches=(), categories={})
    found = Counter(item.category for item in room.objects)
    standing = [item for item in room.objects if item.support.kind == "floor" and not categories[item.category].underlay]
    covered = sum(item.size_m[0] * item.size_m[1] for item in standing)
    sides = np.ptp(np.array(room.room.polygon_m), axis=0)
    return SampledCounts(
        failed=False,
        branches=tuple(_taken(grammar, room.parse_graph.nodes)),
        categories=dict(found),
        floor_share=covered / signed_area_m2(room.room.polygon_m),
        proportion=float(sides.max() / sides.min()),
    )


def _taken(grammar: Grammar, nodes: Sequence[ParseNode]) -> Iterable[tuple[str, int, int]]:
    """Yield the choices of a derivation: branches of Or nodes, and copies of Set branches, which come in order below their node."""
    place: Counter[int] = Counter()
    for vertex in nodes:
        if vertex.kind == "or" and vertex.symbol in grammar.nodes:
            names = [branch.symbol for branch in grammar.nodes[vertex.symbol].branches]
            yield vertex.symbol, -1, names.index(vertex.choice)
        elif vertex.kind == "set" and vertex.parent is not None and vertex.choice != "":
            owner = nodes[vertex.parent].symbol
            yield owner, place[vertex.parent], int(vertex.choice)
            place[vertex.parent] += 1
