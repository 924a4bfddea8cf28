"""Groups on surfaces and in boxes on each other, things on walls and below hooks, and furniture that has moved."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar.geometry.solids import local_solids
from grammar.small_things.groups import members
from grammar.small_things.place import Newcomer, Obstacles, tops_of
from grammar.small_things.rules import Group, Member, SmallThings, Strewn, Thing, Untidy
from grammar.small_things.sites import Carrier, Surroundings
from grammar.small_things.untidy import moves
from grammar.small_things.walls import backed, below_hooks, on_wall
from scene_description import ModelReference, Part, Room, SceneObject, Support

ROOM = Room(
    polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)), height_m=2.5, wall_thickness_m=0.1, openings=(),
    surfaces=tuple(Part(name=name, material="paper") for name in ("floor", "wall", "ceiling")),
)  # fmt: skip
NOTHING = Obstacles(np.empty((0, 8)), np.empty(0, np.int64))


def thing(number: int, category: str, x: float, y: float, z: float, size_m: tuple[float, float, float], kind: str = "floor") -> SceneObject:
    support = Support(kind=kind, wall=0 if kind == "wall" else None)  # type: ignore[arg-type]
    return SceneObject(
        id=number, category=category, label=0, size_m=size_m, position_m=(x, y, z), yaw_rad=0.5 * math.pi, support=support,
        model=ModelReference(generator=category), parts=(),
    )  # fmt: skip


def newcomer(number: int, category: str, size_m: tuple[float, float, float], **rule: object) -> Newcomer:
    item = thing(number, category, 0.0, 0.0, 0.0, size_m)
    plain = Thing(size_m=size_m, sd_m=(0.001, 0.001, 0.001), turns=(0.0,), **rule)  # type: ignore[arg-type]
    return Newcomer(plain, item, local_solids(CATEGORIES[category], size_m))


def test_members_lie_beside_the_core_on_its_surface_or_upon_each_other() -> None:
    table, tray = thing(1, "dining_table", 2.0, 1.5, 0.0, (0.9, 1.6, 0.75)), thing(2, "tray", 2.0, 1.5, 0.75, (0.32, 0.44, 0.045))
    around = Surroundings(CATEGORIES, ROOM, [table, tray])
    sizes = {"plate": (0.26, 0.26, 0.02), "bread": (0.08, 0.08, 0.05), "jar": (0.08, 0.08, 0.12)}
    group = Group(core="tray", members=(
        Member(thing="plate", upon="tray"), Member(thing="bread", upon="plate"), Member(thing="jar", at_m=(0.0, 0.4), sd_m=0.01),
        Member(thing="jar", multiplicity=(1.0, 0.0)),
    ))  # fmt: skip
    number = iter(range(3, 9))
    found = []
    carrier = Carrier(table, tops_of(CATEGORIES["dining_table"], table, seat=False), np.empty((0, 8)))
    for joined in members(
        np.random.default_rng(4), group, tray, carrier, 0.0, around, lambda name: newcomer(next(number), name, sizes[name])
    ):
        around.add(joined.item)
        found.append(joined)
    plate, bread, jar = (joined.item for joined in found)
    assert [item.category for item in (plate, bread, jar)] == ["plate", "bread", "jar"]
    assert plate.support.id == 2 and plate.position_m[2] == pytest.approx(0.75 + 0.2 * 0.045)
    assert bread.support.id == plate.id and bread.position_m[2] == pytest.approx(plate.position_m[2] + 0.17 * 0.02)
    assert jar.support == tray.support and jar.position_m[2] == 0.75
    # at (0, 0.4) in the frame of the tray, which looks along +y
    assert jar.position_m[:2] == pytest.approx((1.6, 1.5), abs=0.1)
    assert [joined.log_address for joined in found] == [0.0, 0.0, None] and all(joined.log_count == 0.0 for joined in found)


def test_a_board_hangs_above_the_workbench_and_a_poster_where_the_wall_is_free() -> None:
    bench = thing(1, "workbench", 1.2, 0.36, 0.0, (0.7, 1.4, 0.9))
    around = Surroundings(CATEGORIES, ROOM, [bench])
    assert backed(around.wall, bench) == pytest.approx((0, 1.2))
    assert backed(around.wall, thing(1, "workbench", 1.2, 1.5, 0.0, (0.7, 1.4, 0.9))) is None
    for seed in range(6):
        board = newcomer(2, "tool_board", (0.06, 1.0, 0.6), hangs_m=(1.4, 1.5))
        above = on_wall(np.random.default_rng(seed), board, around.wall, [bench], around.fits, around.taken)
        assert above is not None and above.support.wall == 0 and above.position_m[1] == pytest.approx(0.03)
        assert abs(above.position_m[0] - 1.2) < 0.25 and above.position_m[2] > 0.9 + 0.1
        free = on_wall(np.random.default_rng(seed), board, around.wall, [], around.fits, around.taken)
        assert free is not None and free.position_m[2] + 0.3 == pytest.approx(1.45, abs=0.051)


def test_a_coat_hangs_below_its_hooks_at_the_wall() -> None:
    hooks = thing(1, "wall_hooks", 2.0, 0.045, 1.6, (0.09, 0.8, 0.16), "wall")
    around = Surroundings(CATEGORIES, ROOM, [hooks])
    coat = below_hooks(np.random.default_rng(2), newcomer(2, "coat", (0.2, 0.4, 1.0)), hooks, around.fits, around.taken)
    assert coat is not None and coat.support == hooks.support
    assert coat.position_m[1] == pytest.approx(0.1) and abs(coat.position_m[0] - 2.0) <= 0.31
    assert coat.position_m[2] + 1.0 == pytest.approx(1.6, abs=0.002)
    assert below_hooks(np.random.default_rng(2), newcomer(2, "coat", (0.2, 0.4, 1.55)), hooks, around.fits, around.taken) is None


def test_chairs_are_pushed_back_and_turned_and_stores_open_before_their_body() -> None:
    rules = SmallThings(
        things={}, supports={}, floor=Strewn(per_m2=0.0, things={}),
        untidy=Untidy(turned={"dining_chair": (0.3, 0.5)}, reach_m={"dresser": 0.2}),
    )  # fmt: skip
    chair, dresser = thing(1, "dining_chair", 2.0, 2.0, 0.0, (0.5, 0.45, 0.9)), thing(2, "dresser", 1.0, 0.25, 0.0, (0.45, 1.0, 0.8))
    around = Surroundings(CATEGORIES, ROOM, [chair, dresser])
    for root in range(8):
        found = {move.item.id: move for move in moves(rules, around, [chair, dresser], root, (), NOTHING)}
        assert found == {move.item.id: move for move in moves(rules, around, [chair, dresser], root, (), NOTHING)}
        back, opened = found[1].item, found[2].item
        assert 0.0 < 2.0 - back.position_m[1] <= 0.3 and abs(back.yaw_rad - 0.5 * math.pi) <= 0.5
        reach = opened.size_m[0] - 0.45
        assert 0.0 < reach <= 0.2 and opened.model.ajar == pytest.approx(reach / opened.size_m[0])
        assert opened.position_m[1] - 0.5 * opened.size_m[0] == pytest.approx(0.025)
    # nothing opens where a file may be its model, nor into what stands before it
    assert {move.item.id for move in moves(rules, around, [chair, dresser], 1, ("dresser",), NOTHING)} == {1}
    before = thing(3, "cardboard_box", 1.0, 0.65, 0.0, (0.3, 0.9, 0.3))
    crowded = Surroundings(CATEGORIES, ROOM, [chair, dresser, before])
    assert {move.item.id for move in moves(rules, crowded, [chair, dresser, before], 1, (), NOTHING)} == {1}
