"""What rooms say about runs, from rooms made by hand."""

import math
from dataclasses import replace

import pytest
from small_grammar import CATEGORIES

from grammar import Grammar, read_room_type
from grammar.learning import ObservedObject, ObservedRoom
from grammar.learning.assign import assign
from grammar.learning.sizes import learn_size
from grammar.learning.unit_rows import learn_unit_rows, with_even_heights

BASE = read_room_type("kitchen", CATEGORIES, "by_hand")


def kitchen(gap_m: float) -> ObservedRoom:
    """Return a room with a counter whose back is ``gap_m`` off the wall x = 0, in it where that is below zero, and a stove 5 mm beside."""
    counter = ObservedObject(category="kitchen_counter", size_m=(0.6, 0.8, 0.87), position_m=(gap_m + 0.3, 1.0, 0.0), yaw_rad=0.0)
    stove = ObservedObject(category="stove", size_m=(0.6, 0.6, 0.9), position_m=(0.3, 1.705, 0.0), yaw_rad=0.0)
    polygon = ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0))
    return ObservedRoom(id="r", house="r", room_type="kitchen", polygon_m=polygon, height_m=2.5, objects=(counter, stove))


def test_units_stand_as_far_off_the_wall_as_those_of_the_rooms() -> None:
    rooms = [assign(BASE, kitchen(gap), False) for gap in (-0.02, 0.0, 0.004, 0.01, 0.012)]
    counts: dict[str, float] = {}
    learned = learn_unit_rows(BASE, rooms, counts, 2.0)
    run, unit = learned.nodes["l_row"].run, learned.objects["counter"].in_run
    assert run is not None and run.wall_gap_m == 0.0 and run.wall_gaps_m == (0.0,) * 5 and counts["nodes.l_row"] == 10.0
    # what reaches 0.02 m into the wall stands as far off it; quantiles lie between two of the five
    assert unit is not None and unit.stretches and unit.gaps_m == pytest.approx((0.0, 0.004, 0.01, 0.012, 0.02), abs=3.1e-3)
    assert run.joints_m == pytest.approx((0.005,) * 5)
    # of a unit that no room shows nothing is known but the gaps of all of them; one in a corner has none of its own
    fridge, corner = learned.objects["refrigerator"].in_run, learned.objects["corner_unit"].in_run
    assert fridge is not None and len(fridge.gaps_m) == 10 and max(fridge.gaps_m) <= 0.02
    assert corner is not None and corner.gaps_m == ()


def row_of(*names: str, apart_m: float = 0.0, off_m: float = 0.0) -> ObservedRoom:
    """Return a room with a row of units 0.6 m wide at the wall x = 0, all as far off it; what hangs is above the unit before it."""
    things, along = [], 0.3
    for name in names:
        if name == "wall_cabinet":
            size, place = (0.37, 0.6, 0.63), (0.185, along - 0.6 - apart_m, 1.45)
        else:
            size, place = (0.6, 0.6, 1.9 if name == "refrigerator" else 0.87), (0.3 + off_m, along, 0.0)
            along += 0.6 + apart_m
        things.append(ObservedObject(category=name, size_m=size, position_m=place, yaw_rad=0.0))
    polygon = ((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0))
    return ObservedRoom(id="r", house="r", room_type="kitchen", polygon_m=polygon, height_m=2.5, objects=tuple(things))


def learned_from(*rooms: ObservedRoom) -> Grammar:
    return learn_unit_rows(BASE, [assign(BASE, room, True) for room in rooms], {}, 2.0)


def test_what_all_units_of_a_wall_stand_off_it_is_the_gap_of_the_run() -> None:
    learned = learned_from(*[row_of("sink_counter", "stove", off_m=0.006)] * 5)
    run, unit = learned.nodes["l_row"].run, learned.objects["sink"].in_run
    assert run is not None and run.wall_gaps_m == pytest.approx((0.006,) * 5)
    assert unit is not None and unit.gaps_m == pytest.approx((0.0,) * 5)


def test_units_like_to_be_beside_what_they_are_seen_beside() -> None:
    learned = learned_from(*[row_of("dishwasher", "sink_counter", "kitchen_counter", "stove")] * 8)
    sink, stove = learned.objects["sink"].in_run, learned.objects["stove"].in_run
    assert sink is not None and stove is not None and sink.near is not None and sink.apart is not None and stove.apart is not None
    # always beside the dishwasher, never beside the stove, where 6 of 12 ordered pairs are neighbours; nothing is known of a refrigerator
    odds = (8 + 2 * 0.5) / 10
    assert sink.near["dishwasher"] == pytest.approx(0.5 * math.log(odds / (1 - odds)), abs=0.006)
    assert stove.apart["dishwasher"] == pytest.approx(0.5 * math.log(odds / (1 - odds)), abs=0.006)
    assert "stove" in sink.apart and sink.near["window"] == 10.0
    assert sink.apart["refrigerator"] == BASE.objects["sink"].in_run.apart["refrigerator"]  # type: ignore[union-attr, index]


def test_rows_of_cabinets_begin_beside_tall_units_as_often_as_seen() -> None:
    beside, away = ("refrigerator", "sink_counter", "wall_cabinet"), ("refrigerator", "stove", "sink_counter", "wall_cabinet")
    base = replace(BASE, objects={**BASE.objects, "wall_cabinet": replace(BASE.objects["wall_cabinet"], tied=())})
    rooms = [assign(base, row_of(*names), True) for names in (beside, beside, beside, away, away)]
    assert learn_unit_rows(base, rooms, {}, 2.0).objects["wall_cabinet"].beside_tall == pytest.approx(0.6)


def test_worktops_that_no_room_shows_are_as_high_as_the_others() -> None:
    seen = [(0.6, 0.5 + 0.1 * k, 0.871) for k in range(5)]
    learned = with_even_heights(BASE.objects, {**BASE.objects, "counter": learn_size(BASE.objects["counter"], seen, 1.0)})
    for symbol in ("counter", "end_corner", "island_unit", "dishwasher"):
        assert [mode.mean_m[2] for mode in learned[symbol].sizes] == pytest.approx([0.871] * len(learned[symbol].sizes))
        assert learned[symbol].low_m[2] <= 0.871 <= learned[symbol].high_m[2]
    assert learned["sink"] == BASE.objects["sink"]
