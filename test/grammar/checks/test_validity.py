"""Every exact check passes on a good room and trips, alone, on a room with one fault."""

import math
from dataclasses import replace

import pytest
from small_grammar import CATEGORIES

from grammar.checks.validity import check_room, door_start_m
from grammar.spec.grammar_file import read_room_type
from scene_description import ModelReference, Opening, Room, SceneObject, SceneSynthError, Slope, Support

GRAMMAR = read_room_type("bedroom", CATEGORIES)
HALF = math.pi / 2


def make_item(identifier, category, size, position, yaw=0.0, support=None, group=None):
    return SceneObject(
        id=identifier,
        category=category,
        label=CATEGORIES[category].label_id,
        size_m=size,
        position_m=position,
        yaw_rad=yaw,
        support=support or Support(kind="floor"),
        group=group,
        model=ModelReference(generator=category),
        parts=(),
    )


def opening(identifier, category, wall, offset, sill, width, height, swing="in"):
    model = ModelReference(generator=category)
    return Opening(
        id=identifier,
        category=category,
        label=1,
        wall=wall,
        offset_m=offset,
        sill_m=sill,
        width_m=width,
        height_m=height,
        swing=swing,
        model=model,
        parts=(),
    )


ROOM = Room(
    polygon_m=((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)),
    height_m=2.5,
    wall_thickness_m=0.15,
    openings=(opening(1, "door", 0, 0.1, 0.0, 0.9, 2.0), opening(2, "window", 1, 1.0, 0.9, 1.2, 1.2)),
    surfaces=(),
)
BED, WARDROBE, STAND, LAMP, PICTURE, CEILING = 3, 4, 5, 6, 7, 8
GOOD = {
    BED: make_item(BED, "bed", (2.0, 1.6, 1.0), (-1.0, 1.0, 0.0)),
    WARDROBE: make_item(WARDROBE, "wardrobe", (0.6, 1.2, 2.0), (1.3, 1.7, 0.0), -HALF),
    STAND: make_item(STAND, "nightstand", (0.4, 0.5, 0.5), (-1.8, -0.1, 0.0)),
    LAMP: make_item(LAMP, "table_lamp", (0.2, 0.2, 0.4), (-1.8, -0.1, 0.5), 0.7, Support(kind="object", id=STAND)),
    PICTURE: make_item(PICTURE, "picture", (0.02, 0.6, 0.5), (0.5, -1.99, 1.3), HALF, Support(kind="wall", wall=0)),
    CEILING: make_item(CEILING, "ceiling_lamp", (0.4, 0.4, 0.3), (0.0, 0.0, 2.2), 0.0, Support(kind="ceiling")),
}
RULES = {
    BED: GRAMMAR.objects["double_bed"],
    WARDROBE: GRAMMAR.objects["wardrobe"],
    STAND: GRAMMAR.objects["nightstand"],
    LAMP: GRAMMAR.objects["table_lamp"],
    PICTURE: GRAMMAR.objects["picture"],
    CEILING: GRAMMAR.objects["ceiling_lamp"],
}


def check(changes=None, room=ROOM, rules=None):
    objects = tuple((GOOD | (changes or {})).values())
    return check_room(GRAMMAR, CATEGORIES, room, objects, RULES | (rules or {}), 3)


def failures(report):
    assert report.valid == all(item.passed for item in report.checks)
    return {item.name: item for item in report.checks if not item.passed}


def moved(identifier, **fields):
    return {identifier: replace(GOOD[identifier], **fields)}


def test_a_good_room_passes_every_check():
    report = check()
    assert failures(report) == {}
    assert report.valid and report.attempts == 3
    names = [item.name for item in report.checks]
    assert names == [
        "collision",
        "out_of_bounds",
        "floating",
        "overhang",
        "door_clear",
        "window_clear",
        "wall_clear",
        "walkable_share",
        "reachable",
        "side_clear",
    ]


def test_solids_stay_below_slopes_and_so_do_windows():
    """From 1.1 m at the bed's head by 1 m a metre: the bed is 1 m high, the 2 m door begins 0.1 m from that wall."""
    room = replace(ROOM, slopes=(Slope(wall=3, eaves_height_m=1.1, pitch_rad=0.25 * math.pi),))
    found = failures(check(room=room))["out_of_bounds"]
    assert found.objects == (1,) and found.value == pytest.approx(2.0 - 1.2)
    steep = replace(room, slopes=(replace(room.slopes[0], wall=2, eaves_height_m=1.98),))
    found = failures(check(room=steep))["out_of_bounds"]
    assert found.objects == (WARDROBE,) and found.value == pytest.approx((2.0 - 1.98) * math.sqrt(0.5))
    low = replace(room, slopes=(Slope(wall=1, eaves_height_m=2.05, pitch_rad=0.25 * math.pi),))
    assert failures(check(room=low))["out_of_bounds"].objects == (2,)


EXTRA = 9
FAULTS = {
    "collision": (
        moved(STAND, position_m=(-1.8, -0.05 + 0.003, 0.0)) | moved(LAMP, position_m=(-1.8, -0.047, 0.5)),
        "collision",
        0.003,
        {BED, STAND},
    ),
    "through the wall": (moved(BED, position_m=(-1.0 - 0.002, 1.0, 0.0)), "out_of_bounds", 0.002, {BED}),
    "through the ceiling": (moved(WARDROBE, size_m=(0.6, 1.2, 2.504)), "out_of_bounds", 0.004, {WARDROBE}),
    "above the floor": (moved(BED, position_m=(-1.0, 1.0, 0.02)), "floating", 0.02, {BED}),
    "above its top": (moved(LAMP, position_m=(-1.8, -0.1, 0.515)), "floating", 0.015, {LAMP}),
    "off its wall": (moved(PICTURE, position_m=(0.5, -1.97, 1.3)), "floating", 0.02, {PICTURE}),
    "below the ceiling": (moved(CEILING, position_m=(0.0, 0.0, 2.1)), "floating", 0.1, {CEILING}),
    # the lamp's half side turned by 0.7 rad reaches 0.1 (cos + sin) = 0.1409 to the side, the top ends 0.24 beside its middle
    "over the edge": (moved(LAMP, position_m=(-1.8, -0.25, 0.5)), "overhang", 0.15 + 0.1 * (math.cos(0.7) + math.sin(0.7)) - 0.24, {LAMP}),
    "before the door": (
        {EXTRA: make_item(EXTRA, "waste_bin", (0.3, 0.3, 0.3), (-1.75, -0.96, 0.0))},
        "door_clear",
        0.01,
        {EXTRA},
    ),
    "before the window": (
        {EXTRA: make_item(EXTRA, "bookshelf", (0.3, 0.8, 1.8), (1.84, 0.0, 0.0), math.pi)},
        "window_clear",
        0.31,
        {EXTRA},
    ),
    "over the window": (
        moved(PICTURE, position_m=(1.99, 0.0, 1.3), yaw_rad=math.pi, support=Support(kind="wall", wall=1)),
        "wall_clear",
        0.02,
        {PICTURE},
    ),
    "behind a shelf": (
        {EXTRA: make_item(EXTRA, "bookshelf", (0.3, 0.8, 1.8), (0.5, -1.8, 0.0), HALF)},
        "wall_clear",
        0.33,
        {EXTRA},
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_trips_its_check_and_names_the_objects(name):
    changes, check_name, value, at_fault = FAULTS[name]
    rules = {EXTRA: GRAMMAR.objects["waste_bin"]} if EXTRA in changes else {}
    failed = failures(check(changes, rules=rules))
    assert set(failed) == {check_name}
    assert failed[check_name].value == pytest.approx(value, abs=1e-9)
    assert set(failed[check_name].objects) == at_fault


def test_the_freest_functional_side_must_be_free_enough():
    """The wardrobe's front runs from x = 0.7 to 1.9; a bin before it takes nine of twelve points of each row of the strip."""
    limits = replace(GRAMMAR.validity, side_share=0.5)
    objects = GOOD | {EXTRA: make_item(EXTRA, "waste_bin", (0.9, 0.22, 0.3), (1.15, 1.25, 0.0))}
    rules = RULES | {EXTRA: GRAMMAR.objects["waste_bin"], WARDROBE: replace(RULES[WARDROBE], reach_any=("front",))}
    report = check_room(replace(GRAMMAR, validity=limits), CATEGORIES, ROOM, tuple(objects.values()), rules, 1)
    (side,) = (item for item in report.checks if item.name == "side_clear")
    assert side.value == pytest.approx(0.25) and side.limit == 0.5 and side.objects == (WARDROBE,) and not report.valid
    # of two sides the freer one counts; nothing stands to the right, at x below 0.7
    rules[WARDROBE] = replace(RULES[WARDROBE], reach_any=("front", "right"))
    report = check_room(replace(GRAMMAR, validity=limits), CATEGORIES, ROOM, tuple(objects.values()), rules, 1)
    assert next(item for item in report.checks if item.name == "side_clear").passed


def test_a_chair_may_be_tucked_under_a_desk_but_not_into_its_legs():
    desk = {EXTRA: make_item(EXTRA, "desk", (0.7, 1.4, 0.75), (-1.0, -0.75, 0.0), -HALF)}
    rules = {EXTRA: GRAMMAR.objects["desk"], EXTRA + 1: GRAMMAR.objects["desk_chair"]}
    base = {BED: replace(GOOD[BED], position_m=(-1.0, 1.2, 0.0))}
    tucked = {EXTRA + 1: make_item(EXTRA + 1, "desk_chair", (0.5, 0.5, 0.9), (-1.0, -1.0, 0.0), HALF)}
    aside = {EXTRA + 1: make_item(EXTRA + 1, "desk_chair", (0.5, 0.5, 0.9), (-0.5, -1.0, 0.0), HALF)}
    room = replace(ROOM, openings=(replace(ROOM.openings[0], swing="out"), ROOM.openings[1]))
    stand = {STAND: replace(GOOD[STAND], position_m=(1.8, -1.0, 0.0)), LAMP: replace(GOOD[LAMP], position_m=(1.8, -1.0, 0.5))}
    assert "collision" not in failures(check(base | desk | tucked | stand, room, rules))
    assert "collision" in failures(check(base | desk | aside | stand, room, rules))


def test_a_wall_that_cuts_between_corners_is_out_of_bounds():
    # a slit of 0.02 m from the right side to the room's middle; no corner of the bed is outside and no vertex inside it
    polygon = ((-2.0, -2.0), (2.0, -2.0), (2.0, -0.01), (-1.99, -0.01), (-1.99, 0.01), (2.0, 0.01), (2.0, 2.0), (-2.0, 2.0))
    room = replace(ROOM, polygon_m=polygon, openings=(ROOM.openings[0],))
    report = check_room(GRAMMAR, CATEGORIES, room, (make_item(BED, "bed", (1.0, 1.0, 1.0), (0.5, 0.0, 0.0)),), RULES, 1)
    assert failures(report)["out_of_bounds"].objects == (BED,)
    assert failures(report)["out_of_bounds"].value == pytest.approx(0.998)


def test_a_barrier_cuts_off_floor_and_furniture():
    barrier = {EXTRA: make_item(EXTRA, "dresser", (0.1, 4.0, 0.8), (0.0, -0.9, 0.0), HALF)}
    objects = {BED: replace(GOOD[BED], position_m=(-1.0, 1.2, 0.0)), WARDROBE: GOOD[WARDROBE]}
    report = check_room(GRAMMAR, CATEGORIES, ROOM, (*objects.values(), *barrier.values()), RULES | {EXTRA: GRAMMAR.objects["dresser"]}, 1)
    failed = failures(report)
    assert set(failed) == {"walkable_share", "reachable"}
    assert failed["reachable"].objects == (BED, WARDROBE, EXTRA)
    assert 0.1 < failed["walkable_share"].value < 0.5


def test_a_robot_enters_before_the_middle_of_the_door():
    assert door_start_m(ROOM, 0.2) == pytest.approx((-2.0 + 0.1 + 0.45, -1.8))
    with pytest.raises(SceneSynthError, match="expected a door to enter by"):
        door_start_m(replace(ROOM, openings=ROOM.openings[1:]), 0.2)
