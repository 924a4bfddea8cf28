"""Relations that are kept, counted in a room that is put together by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES, small_grammar

from grammar.checks.relations import satisfied_relations
from grammar.sampled_room import SampledRoom, sample_room
from grammar.spec.request import SceneRequest
from scene_description import SceneObject

TEXT = """
nodes:
  closet: {kind: and, branches: [{symbol: bed}, {symbol: stand}, {symbol: mug}, {symbol: art}]}
objects:
  bed:
    category: bed
    sizes: [{mean_m: [2, 1, 1], sd_m: [0.01, 0.01, 0.01]}]
    low_m: [1.9, 0.9, 0.9]
    high_m: [2.1, 1.1, 1.1]
    wall: [{distance_m: 0.05}]
  stand:
    category: nightstand
    sizes: [{mean_m: [0.4, 0.4, 0.5], sd_m: [0.01, 0.01, 0.01]}]
    low_m: [0.35, 0.35, 0.45]
    high_m: [0.45, 0.45, 0.55]
    cores: {bed: 1}
    around: [{side: left, gap_m: 0.1, align: -1}, {side: right, gap_m: 0.1, align: -1}]
  mug:
    category: mug
    mount: object
    sizes: [{mean_m: [0.1, 0.1, 0.1], sd_m: [0.005, 0.005, 0.005]}]
    low_m: [0.08, 0.08, 0.08]
    high_m: [0.12, 0.12, 0.12]
    supporters: {stand: 1}
    placements: [{depth_fraction: 0, width_fraction: 0, orientation_rad: null}]
  art:
    category: picture
    mount: wall
    sizes: [{mean_m: [0.03, 0.5, 0.4], sd_m: [0.002, 0.05, 0.05]}]
    low_m: [0.02, 0.4, 0.3]
    high_m: [0.04, 0.6, 0.5]
    centre_height_m: {mean: 1.7, sd: 0.02, low: 1.6, high: 1.8}
    cores: {bed: 1}
    around: [{side: centre, align: -1}]
"""
GRAMMAR = small_grammar(TEXT)


def exact() -> tuple[SampledRoom, dict[str, SceneObject]]:
    """Return a room of 4 x 4 m and its things exactly where they like to be: the bed's back at the wall at x = -2."""
    room = sample_room(GRAMMAR, CATEGORIES, SceneRequest(room_type="closet", room_shape="rectangle"), np.random.default_rng(1))
    by_category = {item.category: item for item in room.objects}
    bed, stand, mug, art = (by_category[name] for name in ("bed", "nightstand", "mug", "picture"))
    back = min(x for x, _ in room.room.polygon_m) + 0.05
    bed = replace(bed, position_m=(back + 0.5 * bed.size_m[0], 0.0, 0.0), yaw_rad=0.0)
    beside = 0.5 * (bed.size_m[1] + stand.size_m[1]) + 0.1
    stand = replace(stand, position_m=(back + 0.5 * stand.size_m[0], beside, 0.0), yaw_rad=0.0)
    mug = replace(mug, position_m=(*stand.position_m[:2], stand.size_m[2]), yaw_rad=2.0)
    art = replace(art, position_m=(back - 0.04, 0.0, art.position_m[2]), yaw_rad=0.0)
    return room, {"bed": bed, "stand": stand, "mug": mug, "art": art}


def counted(room: SampledRoom, items: dict[str, SceneObject]) -> dict[str, tuple[int, int]]:
    return dict(satisfied_relations(GRAMMAR, CATEGORIES, room.room, sorted(items.values(), key=lambda item: item.id), room.parse_graph))


def moved(item: SceneObject, x_m: float = 0.0, y_m: float = 0.0, turn_rad: float = 0.0) -> SceneObject:
    x, y, z = item.position_m
    return replace(item, position_m=(x + x_m, y + y_m, z), yaw_rad=item.yaw_rad + turn_rad)


def test_everything_in_its_place_keeps_all_relations() -> None:
    room, items = exact()
    assert counted(room, items) == {"wall": (1, 1), "group": (2, 2), "support": (1, 1)}


@pytest.mark.parametrize(
    ("name", "x_m", "y_m", "turn_rad", "lost"),
    [
        ("stand", 0.05, 0.05, 0.2, ()),  # within 0.1 m and 15 degrees
        ("stand", 0.5, 0.0, 0.0, ("group", "support")),  # the mug stays behind
        ("stand", 0.0, 0.0, 0.5, ("group",)),
        ("stand", 0.0, -1.0, 0.0, ("group", "support")),  # between its two places
        ("mug", 0.0, 0.0, 1.0, ()),  # any direction is right
        ("art", 0.5, 0.0, 0.0, ()),  # what hangs is judged along its wall
        ("art", 0.0, 0.5, 0.0, ("group",)),
        ("bed", 0.5, 0.0, 0.0, ("wall", "group")),
        ("bed", 0.0, 0.0, math.pi, ("wall", "group")),  # the nightstand is at its foot
    ],
)
def test_out_of_tolerance_is_not_kept(name: str, x_m: float, y_m: float, turn_rad: float, lost: tuple[str, ...]) -> None:
    room, items = exact()
    before = counted(room, items)
    after = counted(room, items | {name: moved(items[name], x_m, y_m, turn_rad)})
    assert {kind for kind in before if after[kind][0] < before[kind][0]} == set(lost)
    assert {kind: declared for kind, (_, declared) in after.items()} == {"wall": 1, "group": 2, "support": 1}


def test_spread_and_weight_widen_the_tolerance() -> None:
    room, items = exact()
    far = items | {"stand": moved(items["stand"], 0.5)}
    loose = replace(room.parse_graph, weights=dict(room.parse_graph.weights) | {"group_distance": 5.0})  # 3 / 5 m more
    objects = list(far.values())
    assert satisfied_relations(GRAMMAR, CATEGORIES, room.room, objects, room.parse_graph)["group"] == (1, 2)
    assert satisfied_relations(GRAMMAR, CATEGORIES, room.room, objects, loose)["group"] == (2, 2)
