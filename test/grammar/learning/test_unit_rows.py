"""What rooms say about runs, from rooms made by hand."""

import pytest
from small_grammar import CATEGORIES

from grammar import read_room_type
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
    learned = learn_unit_rows(BASE, rooms, counts)
    run, unit = learned.nodes["l_row"].run, learned.objects["counter"].in_run
    assert run is not None and run.wall_gap_m == 0.0 and counts["nodes.l_row"] == 10.0
    # what reaches 0.02 m into the wall stands as far off it; quantiles lie between two of the five
    assert unit is not None and unit.stretches and unit.gaps_m == pytest.approx((0.0, 0.004, 0.01, 0.012, 0.02), abs=3.1e-3)
    assert run.joints_m == pytest.approx((0.005,) * 5)
    # of a unit that no room shows nothing is known but the gaps of all of them; one in a corner has none of its own
    fridge, corner = learned.objects["refrigerator"].in_run, learned.objects["corner_unit"].in_run
    assert fridge is not None and len(fridge.gaps_m) == 10 and max(fridge.gaps_m) <= 0.02
    assert corner is not None and corner.gaps_m == ()


def test_worktops_that_no_room_shows_are_as_high_as_the_others() -> None:
    seen = [(0.6, 0.5 + 0.1 * k, 0.871) for k in range(5)]
    learned = with_even_heights(BASE.objects, {**BASE.objects, "counter": learn_size(BASE.objects["counter"], seen, 1.0)})
    for symbol in ("counter", "end_corner", "island_unit", "dishwasher"):
        assert [mode.mean_m[2] for mode in learned[symbol].sizes] == pytest.approx([0.871] * len(learned[symbol].sizes))
        assert learned[symbol].low_m[2] <= 0.871 <= learned[symbol].high_m[2]
    assert learned["sink"] == BASE.objects["sink"]
