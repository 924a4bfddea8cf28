"""Openings: where doors, overhead doors and windows may lie."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import RequestError, SceneRequest, read_room_type
from grammar.derivation.derive import derive
from grammar.derivation.openings import draw_opening
from grammar.geometry.zones import SWING, opening_zones
from scene_description.types import Point2

RECTANGLE: tuple[Point2, ...] = ((0.0, 0.0), (4.0, 0.0), (4.0, 6.0), (0.0, 6.0))
L_SHAPE: tuple[Point2, ...] = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (3.0, 3.0), (3.0, 6.0), (0.0, 6.0))


@pytest.fixture(scope="module")
def garage():
    return read_room_type("garage", CATEGORIES)


@pytest.mark.parametrize(("outline", "walls"), [(RECTANGLE, {0, 2}), (L_SHAPE, {0, 4})], ids=["rectangle", "l_shape"])
def test_a_vehicle_enters_where_the_floor_is_deep_enough(garage, outline, walls):
    rng, rule = np.random.default_rng(1), replace(garage.openings["garage_door"], floor_depth_m=5.0)
    drawn = [draw_opening("garage_door", rule, 1, 8, outline, 2.6, (), rng) for _ in range(60)]
    assert {one.opening.wall for one in drawn if one is not None} == walls


def test_the_wall_of_a_vehicle_door_is_as_likely_as_its_attribute_says(garage):
    rule = replace(garage.openings["garage_door"], floor_depth_m=5.0)
    one = draw_opening("garage_door", rule, 1, 8, RECTANGLE, 2.6, (), np.random.default_rng(1))
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
