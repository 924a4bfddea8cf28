"""Openings: where doors, overhead doors and windows may lie, clear of each other and of where the leaves of doors get to."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import RequestError, SceneRequest, read_room_type
from grammar.derivation.derive import derive
from grammar.derivation.openings import FreeWalls, SpecialWalls, draw_numbers, draw_opening, draw_openings
from grammar.geometry.zones import SWING, opening_zones
from scene_description import ModelReference, Opening, Room
from scene_description.types import Point2

RECTANGLE: tuple[Point2, ...] = ((0.0, 0.0), (4.0, 0.0), (4.0, 6.0), (0.0, 6.0))
L_SHAPE: tuple[Point2, ...] = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (3.0, 3.0), (3.0, 6.0), (0.0, 6.0))
SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
RULES = read_room_type("bedroom", CATEGORIES).openings


@pytest.fixture(scope="module")
def garage():
    return read_room_type("garage", CATEGORIES)


@pytest.mark.parametrize(("outline", "walls"), [(RECTANGLE, {0, 2}), (L_SHAPE, {0, 4})], ids=["rectangle", "l_shape"])
def test_a_vehicle_enters_where_the_floor_is_deep_enough(garage, outline, walls):
    rng, rule = np.random.default_rng(1), replace(garage.openings["garage_door"], floor_depth_m=5.0)
    drawn = [draw_opening("garage_door", rule, 8, FreeWalls(outline, 2.6), rng) for _ in range(60)]
    assert {one.opening.wall for one in drawn if one is not None} == walls


def test_the_wall_of_a_vehicle_door_is_as_likely_as_its_attribute_says(garage):
    rule = replace(garage.openings["garage_door"], floor_depth_m=5.0)
    one = draw_opening("garage_door", rule, 8, FreeWalls(RECTANGLE, 2.6), np.random.default_rng(1))
    assert one is not None
    assert next(a for a in one.attributes if a.name == "wall").log_probability == pytest.approx(math.log(0.5))


def test_every_garage_has_a_vehicle_door_that_stays_clear(garage):
    for seed in range(5):
        room = derive(garage, CATEGORIES, SceneRequest(room_type="garage"), np.random.default_rng(seed)).room
        doors = [opening for opening in room.openings if opening.category == "garage_door"]
        assert len(doors) == 1 and doors[0].width_m >= 2.25
        clear = opening_zones(doors[0], garage.openings["garage_door"])[0]
        assert (clear.kind, clear.depth) == (SWING, 0.3)


def test_grammars_without_vehicle_doors_refuse_a_request_for_one():
    bedroom = read_room_type("bedroom", CATEGORIES)
    with pytest.raises(RequestError, match="garage_door"):
        derive(bedroom, CATEGORIES, SceneRequest(room_type="bedroom", must_have=("garage_door",)), np.random.default_rng(0))


def door(swing: str) -> Opening:
    """Return a door of 0.9 m in the wall y = 0, its hinge 0.1 m from the corner (0, 0)."""
    model = ModelReference(generator="door")
    return Opening(
        id=1, category="door", label=0, wall=0, offset_m=0.1, sill_m=0.0, width_m=0.9, height_m=2.0, swing=swing, model=model, parts=()
    )


@pytest.mark.parametrize(("kind", "beside"), [("window", 0.3), ("door", 0.0)])
def test_nothing_opens_where_the_leaf_of_a_door_gets_to(kind: str, beside: float) -> None:
    def nearest(swing: str) -> float:
        """Return the least distance from the corner (0, 0) of many openings in the wall x = 0, which ends there."""
        rng, gaps = np.random.default_rng(3), []
        for _ in range(1500):
            drawn = draw_opening(kind, RULES[kind], CATEGORIES[kind].label_id, FreeWalls(SQUARE, 2.6, [door(swing)]), rng)
            if drawn is not None and drawn.opening.wall == 3:
                gaps.append(4.0 - drawn.opening.offset_m - drawn.opening.width_m)
        return min(gaps)

    assert nearest("out") < 0.5
    assert nearest("in") >= 0.9 + beside - 1e-6


def test_no_door_leads_from_one_arm_of_a_room_into_the_other():
    # the arms of this U are 0.6 m apart: walls 3 and 5 lie between them, wall 4 ends the slit
    outline = ((0.0, 0.0), (4.6, 0.0), (4.6, 4.0), (2.6, 4.0), (2.6, 1.0), (2.0, 1.0), (2.0, 4.0), (0.0, 4.0))
    rng = np.random.default_rng(0)
    drawn = [draw_opening("door", RULES["door"], 8, FreeWalls(outline, 2.6), rng) for _ in range(200)]
    walls = {one.opening.wall for one in drawn if one is not None}
    assert {0, 1, 7} <= walls and not {3, 4, 5} & walls


def test_walls_are_drawn_by_a_power_of_their_lengths():
    # Sides of 4 and 6 m: by their lengths the long ones have 0.6 of the doors, by the power 0 half; four standard errors of 400 draws.
    for power, share in ((1.0, 0.6), (0.0, 0.5)):
        rng, rule = np.random.default_rng(2), replace(RULES["door"], length_power=power, near_corner=0.0)
        walls = [one.opening.wall for _ in range(400) if (one := draw_opening("door", rule, 8, FreeWalls(RECTANGLE, 2.6), rng)) is not None]
        assert np.mean([wall in (1, 3) for wall in walls]) == pytest.approx(share, abs=0.1)


def test_a_casing_stays_on_its_wall_at_a_corner_that_juts_into_the_room():
    # The wall of 1 m from (4, 3) to (3, 3) ends at the corner that juts in: a door of 0.86 m has 0.05 m there, less than its casing.
    rule = replace(RULES["door"], end_gap_m=0.02, near_corner=0.0, length_power=0.0)
    drawn = (draw_opening("door", rule, 8, FreeWalls(L_SHAPE, 2.6), np.random.default_rng(seed)) for seed in range(200))
    gaps = [1.0 - one.opening.offset_m - one.opening.width_m for one in drawn if one is not None and one.opening.wall == 2]
    assert gaps and min(gaps) >= rule.casing_m


def test_a_room_has_no_more_doors_than_its_walls_have_space_for(garage):
    # A square of 4 m has 16 m of wall: at 6 m a door there are two at the most, and a number that must be stays.
    room = Room(polygon_m=SQUARE, height_m=2.6, wall_thickness_m=0.1, openings=(), surfaces=())
    for odds, numbers in (((0.0, 0.25, 0.25, 0.5), {1, 2}), ((0.0, 0.0, 0.0, 1.0), {3})):
        rules = {"door": replace(RULES["door"], multiplicity=odds, wall_m=6.0), "window": replace(RULES["window"], multiplicity=(1.0,))}
        grammar, found = replace(garage, openings=rules), set()
        for seed in range(12):
            rng = np.random.default_rng(seed)
            drawn, (count, _) = draw_openings(grammar, CATEGORIES, room, rng, SpecialWalls(), draw_numbers(grammar, room, rng))
            assert len(drawn) == int(count.value)
            found.add(len(drawn))
            assert math.exp(count.log_probability) == pytest.approx(1.0 / len(numbers))
        assert found == numbers
