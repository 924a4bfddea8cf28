"""Doors and windows learned back from openings that were drawn."""

from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, item, small_grammar

from grammar import SceneRequest, read_room_type
from grammar.derivation.derive import derive
from grammar.learning import ObservedObject, ObservedRoom
from grammar.learning.door_space import free_depth_m, learn_door_space
from grammar.learning.observed import ObservedOpening
from grammar.learning.openings import fitted_to_openings, learn_openings
from grammar.learning.write_layouts import layout_from_objects
from grammar.spec.values import TruncatedNormal

BASE = small_grammar(closet("stool") + item("stool", "pouf", (0.4, 0.4, 0.4)))


def rooms(count: int) -> list[ObservedRoom]:
    truth = {
        "door": replace(BASE.openings["door"], width_m=TruncatedNormal(mean=0.8, sd=0.03, low=0.7, high=0.9), near_corner=0.5),
        "window": replace(
            BASE.openings["window"],
            multiplicity=(0.2, 0.5, 0.3),
            sill_m=TruncatedNormal(mean=1.1, sd=0.05, low=1.0, high=1.2),
            height_m=TruncatedNormal(mean=1.0, sd=0.05, low=0.9, high=1.1),
        ),
    }
    grammar = replace(BASE, openings=truth)
    trees = (derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng([3, index])) for index in range(count))
    return [layout_from_objects(f"r{index}", "closet", tree.room, ()) for index, tree in enumerate(trees)]


def test_numbers_sizes_and_places_come_back() -> None:
    rules, counts = learn_openings(BASE.openings, rooms(400), 2.0, 5)
    door, window = rules["door"], rules["window"]
    # rooms whose windows found no wall are drawn again, which costs a few of the second ones
    assert window.multiplicity == pytest.approx((0.2, 0.5, 0.3), abs=0.08)
    assert counts["window.multiplicity"] == 400
    assert (door.width_m.mean, window.sill_m.mean, window.height_m.mean) == pytest.approx((0.8, 1.1, 1.0), abs=0.01)
    assert door.near_corner == pytest.approx(0.5, abs=0.12)
    assert window.near_corner < 0.12
    assert "door.multiplicity" not in counts
    assert door.multiplicity == BASE.openings["door"].multiplicity


def test_one_size_throughout_and_unknown_openings_are_not_learned() -> None:
    seen = [replace(room, openings={"door": tuple(replace(o, width_m=0.75) for o in room.openings["door"])}) for room in rooms(10)]
    rules, counts = learn_openings(BASE.openings, seen, 2.0, 5)
    assert rules["door"].width_m == BASE.openings["door"].width_m
    assert rules["window"] == BASE.openings["window"]
    assert not any(name.startswith("window") for name in counts)


def test_doors_before_which_something_stands_open_the_other_way() -> None:
    polygon = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (1.4, 3.0), (1.4, 3.1), (0.6, 3.1), (0.6, 3.0), (0.0, 3.0))  # with the door's niche
    door = ObservedOpening(wall=4, offset_m=0.0, width_m=0.8, height_m=2.0, sill_m=0.0)

    def seen(gap_m: float) -> ObservedRoom:
        store = ObservedObject(category="dresser", size_m=(0.5, 1.0, 0.8), position_m=(1.0, 3.0 - gap_m - 0.25, 0.0), yaw_rad=0.5 * np.pi)
        openings = {"door": (door,)}
        return ObservedRoom(id="r", house="r", room_type="closet", polygon_m=polygon, height_m=2.5, objects=(store,), openings=openings)

    gaps = (0.5, 0.6, 0.7, 1.5, 2.0)
    assert [free_depth_m(seen(gap), door) for gap in gaps] == pytest.approx(gaps)
    learned = learn_door_space(BASE.openings["door"], [(seen(gap), door) for gap in gaps])
    assert learned["swing_in"] == pytest.approx(0.4)  # two of five have 0.8 m
    assert learned["clear_depth_m"] == pytest.approx(0.54)  # the tenth part of the way from the first to the last, of four steps
    assert learn_door_space(BASE.openings["door"], [(seen(gap), door) for gap in (0.1, 0.2)])["clear_depth_m"] == 0.4


def test_curtains_are_as_wide_as_the_windows_that_were_learned() -> None:
    living = read_room_type("living_room", CATEGORIES)
    window = replace(living.openings["window"], width_m=TruncatedNormal(mean=1.1, sd=0.2, low=0.8, high=2.4))
    curtain = fitted_to_openings(living.objects, {**living.openings, "window": window})["curtain"]
    # 1.05 of the window's width and 0.58 m more
    assert (curtain.low_m[1], curtain.high_m[1]) == pytest.approx((1.42, 3.1))
    assert curtain.low_m[0] == living.objects["curtain"].low_m[0]
    assert fitted_to_openings(living.objects, living.openings)["sofa"] == living.objects["sofa"]


def test_many_doors_are_learned_with_the_walls_that_they_need_and_lie_in() -> None:
    # Halls of 6 x 1 m, walls of 14 m, with a door at each end and three in a long wall: 2.8 m of wall each.
    hall = replace(rooms(1)[0], polygon_m=((0.0, 0.0), (6.0, 0.0), (6.0, 1.0), (0.0, 1.0)))
    places = ((1, 0.1), (3, 0.1), (0, 0.1), (0, 2.5), (0, 5.0))
    doors = tuple(ObservedOpening(wall=wall, offset_m=offset, width_m=0.8, height_m=2.0, sill_m=0.0) for wall, offset in places)
    seen = [replace(hall, openings={"door": doors[: 5 - k % 2]}) for k in range(10)]
    door = learn_openings(BASE.openings, seen, 0.0, 5)[0]["door"]
    assert door.multiplicity == (0.0, 0.0, 0.0, 0.0, 0.5, 0.5)
    assert door.wall_m == pytest.approx(2.8)
    # three of five doors are in the long walls, or half of those of the others: likeliest at a power of nearly 0
    assert door.length_power <= 0.2
