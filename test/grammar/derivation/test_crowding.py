"""Floor and walls that furniture takes: known answers, and rooms that keep to their grammar's limits."""

from dataclasses import replace

import numpy as np
import pytest

from grammar import SceneRequest
from grammar.derivation.crowding import used_share, wall_share
from grammar.derivation.derive import derive
from grammar.spec.categories import read_categories
from grammar.spec.grammar_file import read_room_type
from scene_description import ModelReference, Opening, Room
from scene_description.share import config_path

CATEGORIES = read_categories(config_path("categories.yaml"))
LIVING = read_room_type("living_room", CATEGORIES)
DOOR = Opening(
    id=1, category="door", label=0, wall=0, offset_m=0.5, sill_m=0.0, width_m=0.9, height_m=2.0, swing="in", hinge="start",
    model=ModelReference(generator="door"), parts=(),
)  # fmt: skip
ROOM = Room(polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)), height_m=2.5, wall_thickness_m=0.1, openings=(DOOR,), surfaces=())
SIZES = {"sofa": (0.9, 2.0, 0.8), "dining_table": (0.9, 1.5, 0.75), "rug": (2.0, 3.0, 0.01), "picture": (0.02, 0.5, 0.5)}
THINGS = [(LIVING.objects[name], size) for name, size in SIZES.items()]


def test_furniture_its_access_and_doors_take_floor_and_rugs_do_not() -> None:
    sofa, table, door = 0.9 * 2.0 + 0.8 * 2.0, 0.9 * 1.5, 0.9 * 0.9
    assert used_share(LIVING, CATEGORIES, ROOM, THINGS) == pytest.approx((sofa + table + door) / 12.0)


def test_what_stands_with_its_back_to_a_wall_takes_it_and_doors_do() -> None:
    assert wall_share(CATEGORIES, ROOM, THINGS) == pytest.approx(2.0 / (14.0 - 0.9))


@pytest.mark.parametrize(("field", "limit"), [("used_share_max", 0.5), ("wall_share_max", 0.2)])
def test_derived_rooms_keep_to_the_limits_unless_a_request_gives_their_size(field: str, limit: float) -> None:
    grammar = replace(LIVING, room=replace(LIVING.room, **{field: limit}))

    def share(request: SceneRequest, seed: int) -> float:
        tree = derive(grammar, CATEGORIES, request, np.random.default_rng(seed))
        things = [(item.rule, item.size_m) for item in tree.items]
        return used_share(grammar, CATEGORIES, tree.room, things) if field.startswith("used") else wall_share(CATEGORIES, tree.room, things)

    request = SceneRequest(room_type="living_room")
    assert max(share(request, seed) for seed in range(12)) <= limit + 1e-9
    given = replace(request, room_width_m=4.5, room_depth_m=4.0)
    assert max(share(given, seed) for seed in range(12)) > limit
