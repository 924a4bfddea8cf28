"""Small things in rooms: what clutter leaves as it is, what it adds, and where things lie."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from grammar.checks.faults import find_faults
from grammar.checks.furnished import furnished
from grammar.sampled_room import SampledRoom
from grammar.small_things import strew
from grammar.small_things.place import draw_turn, kept_free, tops_of, world_box
from grammar.small_things.rules import Stock, Thing, read_small_things
from grammar.small_things.strew import small_things
from grammar.spec.categories import Category, Rest, SupportSurface
from grammar.spec.request import SceneRequest
from grammar.spec.rules import GrammarError
from grammar.synthesize import SceneSynthesizer
from scene_description import ModelReference, SceneObject, Support

LEVELS = (0.0, 0.5, 1.0, 2.0, 3.0)


@cache
def rules() -> SceneSynthesizer:
    return SceneSynthesizer.from_config()


UNTIDY = rules().small_things.untidy
MOVED = {*UNTIDY.reach_m, *UNTIDY.posed, *UNTIDY.turned, *UNTIDY.shifted}


@cache
def study(clutter: float, **fields: object) -> tuple[SceneObject, ...]:
    room = rules().layout(SceneRequest(room_type="study", clutter=clutter, **fields), 19, 0)  # type: ignore[arg-type]
    assert room.validity.valid
    return room.objects


def thing(number: int, category: str, support: Support, x: float = 0.0) -> SceneObject:
    return SceneObject(
        id=number,
        category=category,
        label=40,
        size_m=(0.2, 0.4, 0.3),
        position_m=(x, 0.0, 0.7 if support.kind == "object" else 0.0),
        yaw_rad=0.0,
        support=support,
        model=ModelReference(generator=category),
        parts=(),
    )


def test_furniture_and_lamps_are_the_same_at_any_clutter() -> None:
    small = small_things(study(1.0), rules().categories, rules().lighting.lamps)
    first = max(item.id for item in study(0.0))
    furniture = [item for item in study(1.0) if item.id <= first and item.id not in small]
    assert len(furniture) >= 5
    assert {item.id for item in study(0.0)} == {item.id for item in furniture}
    for clutter in LEVELS[1:]:
        there = [item for item in study(clutter) if item.id in {one.id for one in furniture}]
        assert [item.category for item in there] == [item.category for item in furniture]
        moved = [now for now, then in zip(there, study(0.0), strict=True) if now != then]
        assert all(item.category in MOVED for item in moved) and (clutter > 0.5 or not moved) and (clutter < 2.0 or moved)


def test_every_clutter_holds_what_smaller_ones_hold() -> None:
    for few, more in itertools.pairwise(LEVELS):
        kept = {item.id: item for item in study(more)}
        assert len(kept) > len(study(few))
        assert all(kept[item.id] == item for item in study(few) if item.category not in MOVED)


def test_things_lie_about_on_the_floor_beyond_clutter_1() -> None:
    floor = [sum(item.support.kind == "floor" for item in study(clutter)) for clutter in LEVELS]
    tidy = rules().small_things.tidy_floor("study").count
    assert floor[0] <= floor[2] <= floor[0] + 2.5 * tidy and floor[2] + 2.5 * tidy < floor[4], "a few beside walls, then a mess"


def test_what_is_built_into_walls_is_there_at_clutter_1_and_no_more_of_it_beyond() -> None:
    built = rules().small_things.fittings["study"].things
    at_1, at_3 = ([(item.category, item.position_m) for item in study(level) if item.category in built] for level in (1.0, 3.0))
    assert at_1 == at_3 and len(at_1) >= 2
    for item in study(1.0):
        if item.category in built:
            low, high = rules().small_things.things[item.category].hangs_m or (0.0, 0.0)
            middle = item.position_m[2] + 0.5 * item.size_m[2]
            over = rules().small_things.things[item.category].above
            assert item.support.kind == "wall" and low - 1e-6 <= middle <= (1.4 if over else high + 1e-6), item.category


def test_things_lie_along_the_edges_until_they_are_a_mess() -> None:
    rng, book = np.random.default_rng(3), Thing(size_m=(0.2, 0.15, 0.05), sd_m=(0.01, 0.01, 0.01), turns=(0.0, math.pi / 2))
    askew = []
    for mess in (0.0, 0.5, 1.0):
        turns = np.array([draw_turn(rng, book, mess) for _ in range(2000)])
        off = np.abs((turns + math.pi / 4) % (math.pi / 2) - math.pi / 4)
        askew.append(float((off > math.radians(8.0)).mean()))
    # 6 % and 85 % are turned at all; up to half a radian, and any way round, some of them end up along an edge again
    assert askew == pytest.approx([0.06 * 0.7, 0.46 * 0.83, 0.85 * (1.0 - 8.0 / 45.0)], abs=0.04)


def test_a_request_bounds_small_things_too() -> None:
    assert not [item for item in study(3.0, must_not=("papers",)) if item.category == "papers"]
    assert len(study(3.0, max_objects=40)) == 40
    assert [item.category for item in study(0.0, must_have=("mug",))].count("mug") >= 1


def test_small_things_are_what_stands_on_others_without_lamps_screens_and_what_carries_these() -> None:
    on = Support(kind="object", id=1)
    objects = [thing(1, "desk", Support(kind="floor")), thing(2, "mug", on), thing(3, "table_lamp", on), thing(4, "television", on)]
    objects += [thing(5, "cardboard_box", on), thing(6, "table_lamp", Support(kind="object", id=5))]
    assert small_things(objects, rules().categories, ("table_lamp",)) == {2}
    assert small_things(objects, rules().categories, ("table_lamp",), ("mug",)) == set()


def test_tops_and_rests_and_what_stays_free() -> None:
    category = Category(
        label="bed", surfaces=(SupportSurface(inset_m=0.1),), rests=(Rest(depth=(0.5, 1.0), width=(0.25, 0.75), height=0.5),)
    )
    owner = thing(1, "bed", Support(kind="floor"))
    (top, inner), (rest,) = tops_of(category, owner, seat=False), tops_of(category, owner, seat=True)
    assert inner == rest
    ajar = replace(owner, size_m=(0.25, 0.4, 0.3), model=ModelReference(generator="bed", ajar=0.2))
    assert tops_of(category, ajar, seat=False)[0] == pytest.approx((0.3, -0.025, 0.0, 0.0, 0.1))
    assert top == pytest.approx((0.3, 0.0, 0.0, 0.0, 0.1)) and rest == pytest.approx((0.15, 0.05, 0.0, 0.05, 0.1))
    assert rest.area_m2 == pytest.approx(0.02)
    # a strip from the middle of a screen to the front edge, 5 cm wider at each side, above flat things
    box = kept_free(owner, top._replace(half_depth=0.1), thing(2, "monitor", Support(kind="object", id=1), x=-0.05))
    assert box[:6].tolist() == pytest.approx([0.025, 0.0, 0.33, 0.93, 0.075, 0.25])
    assert world_box(owner, 0.1, 0.2, 0.3, (0.2, 0.4, 0.1), math.pi / 2)[6:].tolist() == pytest.approx([0.0, 1.0])


def test_rooms_that_are_like_others_have_small_things_of_their_own_where_the_table_names_them() -> None:
    things, laundry = rules().small_things, rules().grammars["laundry_room"]
    assert laundry.looks_like == "bathroom" and things.rows_of(laundry) == "laundry_room"
    assert things.rows_of(replace(laundry, room_type="den")) == "bathroom"


def test_rules_that_do_not_fit_are_refused_with_the_field(tmp_path) -> None:
    text = "things: {mug: {size_m: [1, 1, 1], sd_m: [1, 1, 1]}}\nsupports: {desk: {area_m2: 1, stock: {count: 1, things: {%s: 1}}}}\n"
    text += "floor: {per_m2: 0, things: {}}\n"
    file = tmp_path / "small_things.yaml"
    file.write_text(text % "mug")
    stock = read_small_things(file, rules().categories).stock("desk", "study")
    assert stock is not None and stock.count == 1.0
    file.write_text(text % "unicorn")
    with pytest.raises(GrammarError, match=r"supports.desk: expected one of mug, got 'unicorn'"):
        read_small_things(file, rules().categories)


def office_of_shelves(index: int, most: int) -> SampledRoom:
    """Return an office on whose walls as many deep shelves as there is space for, but no more than ``most``, hang as low as tables are."""
    shelf = rules().small_things.things["wall_shelf"]
    shelf = replace(shelf, size_m=(0.4, *shelf.size_m[1:]), hangs_m=(0.4, 1.2), most=most)
    things, walls = {**rules().small_things.things, "wall_shelf": shelf}, {"office": Stock(count=60.0, things={"wall_shelf": 1.0})}
    crowded = replace(rules(), small_things=replace(rules().small_things, things=things, walls=walls))
    return crowded.layout(SceneRequest(room_type="office"), 5, index)


def faults(room: SampledRoom) -> dict[str, list[int]]:
    return find_faults(furnished("office", room.room, room.objects, rules().categories), of_layout=True)


def test_small_things_make_no_room_odd(monkeypatch: pytest.MonkeyPatch) -> None:
    rooms = [office_of_shelves(index, 1000) for index in range(3)]
    assert all(room.validity.valid and not faults(room) for room in rooms)
    assert sum(item.category == "wall_shelf" for room in rooms for item in room.objects) > 12
    monkeypatch.setattr(strew, "_faults", lambda *_: [])
    assert any(faults(office_of_shelves(index, 1000)) for index in range(12))


def test_a_room_has_no_more_of_a_thing_than_it_may() -> None:
    hung = [sum(item.category == "wall_shelf" for item in office_of_shelves(1, most).objects) for most in (3, 1000)]
    assert hung[0] == 3 < hung[1]


def test_what_hangs_lies_on_no_floor(tmp_path) -> None:
    file = tmp_path / "small_things.yaml"
    file.write_text(
        "things: {shelf: {size_m: [1, 1, 1], sd_m: [1, 1, 1], hangs_m: [1, 2]}}\nsupports: {}\n".replace("shelf", "wall_shelf")
        + "groups: {books: {core: wall_shelf, members: []}}\nfloor: {per_m2: 0, things: {books: 1}}\n"
    )
    with pytest.raises(GrammarError, match=r"floor: expected one of .*, got 'books'"):
        read_small_things(file, rules().categories)
