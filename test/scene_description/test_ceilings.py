"""Heights of sloped ceilings by hand, and slopes that no room has."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from sample_scene import sample_scene

from scene_description import FieldError, Room, Slope, scene_from_json, scene_to_json
from scene_description.ceilings import (
    ceiling_height_m,
    ceiling_over_opening_m,
    ceiling_planes,
    distance_into_room_m,
    stretches_below_m,
)

SOUTH = Slope(wall=0, eaves_height_m=1.0, pitch_rad=0.25 * math.pi)
EAST = Slope(wall=1, eaves_height_m=1.4, pitch_rad=math.atan(0.5))


def room(*slopes: Slope) -> Room:
    return replace(sample_scene().room, openings=(), slopes=slopes or None)


def test_the_ceiling_is_the_lower_envelope() -> None:
    """The room is 4 x 3.5 m, 2.6 m high; from the south it rises by 1 m a metre, from the east by half of that."""
    assert ceiling_height_m(room(), 2.0, 0.1) == 2.6
    one = room(SOUTH)
    for y, height in ((0.0, 1.0), (0.5, 1.5), (1.6, 2.6), (3.0, 2.6)):
        assert ceiling_height_m(one, 2.0, y) == pytest.approx(height)
    both = room(SOUTH, EAST)
    for x, y, height in ((4.0, 0.0, 1.0), (4.0, 3.0, 1.4), (3.0, 3.0, 1.9), (1.0, 3.0, 2.6), (3.5, 0.2, 1.2)):
        assert ceiling_height_m(both, x, y) == pytest.approx(height)
    assert ceiling_planes(room()).shape == (0, 3)
    assert ceiling_planes(both)[1] == pytest.approx((-0.5, 0.0, 3.4))


def test_distances_into_the_room_are_signed() -> None:
    polygon = room().polygon_m
    assert distance_into_room_m(polygon, 0, 1.0, 0.7) == pytest.approx(0.7)
    assert distance_into_room_m(polygon, 1, 4.5, 0.7) == pytest.approx(-0.5)


def test_an_opening_is_as_high_as_the_ceiling_at_its_lower_end() -> None:
    window = replace(sample_scene().room.openings[1], wall=1, offset_m=1.2, width_m=1.0)
    assert ceiling_over_opening_m(room(), window) == 2.6
    assert ceiling_over_opening_m(room(SOUTH), window) == pytest.approx(2.2)
    north = replace(SOUTH, wall=2)
    assert ceiling_over_opening_m(room(north), window) == pytest.approx(2.3)


def test_a_ceiling_is_high_enough_along_a_stretch_of_each_wall() -> None:
    """From the south, the wall at y = 0, it is 1.5 m high at y = 0.5; the last wall runs back to the south."""
    assert stretches_below_m(room(SOUTH), 1.5) == [(0.0, 0.0), pytest.approx((0.5, 3.5)), (0.0, 4.0), pytest.approx((0.0, 3.0))]
    opposite = replace(SOUTH, wall=2)
    assert stretches_below_m(room(SOUTH, opposite), 2.0) == [(0.0, 0.0), pytest.approx((1.0, 2.5)), (0.0, 0.0), pytest.approx((1.0, 2.5))]
    assert stretches_below_m(room(), 2.6) == [(0.0, 4.0), (0.0, 3.5), (0.0, 4.0), (0.0, 3.5)]
    assert stretches_below_m(room(), 2.7) == [(0.0, 0.0)] * 4


def test_slopes_make_the_round_trip_and_flat_rooms_have_no_such_key() -> None:
    scene = replace(sample_scene(), room=replace(sample_scene().room, slopes=(replace(EAST, wall=3),)))
    assert scene_from_json(scene_to_json(scene)) == scene
    assert "slopes" not in json.loads(scene_to_json(sample_scene()))["room"]


@pytest.mark.parametrize(
    ("slopes", "message"),
    [
        ([{"wall": 4, "eaves_height_m": 1.0, "pitch_rad": 0.7}], "room.slopes[0].wall: expected an edge below 4, got 4"),
        (
            [{"wall": 1, "eaves_height_m": 1.0, "pitch_rad": 0.7}] * 2,
            "room.slopes[1].wall: expected one slope for a wall, got wall 1 twice",
        ),
        (
            [{"wall": 1, "eaves_height_m": 2.6, "pitch_rad": 0.7}],
            "room.slopes[0].eaves_height_m: expected a height below the ceiling at 2.600 m, got 2.600 m",
        ),
        (
            [{"wall": 1, "eaves_height_m": 0.1, "pitch_rad": 0.7}],
            "room.slopes[0].eaves_height_m: expected a number in [0.2, 20.0] m, got 0.1",
        ),
        ([{"wall": 1, "eaves_height_m": 1.0, "pitch_rad": 1.6}], "room.slopes[0].pitch_rad: expected a number in [0.02, 1.5] rad, got 1.6"),
        ([{"wall": 1, "eaves_height_m": 1.0}], "room.slopes[0].pitch_rad: expected a value, got nothing (the key is missing)"),
        ([], "room.slopes: expected at least 1 items, got 0"),
        (
            [{"wall": 2, "eaves_height_m": 1.5, "pitch_rad": 0.7}],
            "room.openings[1].height_m: expected an opening below the ceiling at 1.500 m, got top at 2.100 m",
        ),
    ],
)
def test_slopes_that_do_not_fit_are_refused_in_a_line(slopes: list[dict[str, float]], message: str) -> None:
    document = json.loads(scene_to_json(sample_scene()))
    document["room"]["slopes"] = slopes
    with pytest.raises(FieldError) as refused:
        scene_from_json(json.dumps(document))
    assert str(refused.value) == message


def test_a_wall_with_floor_behind_it_carries_no_slope() -> None:
    document = json.loads(scene_to_json(sample_scene()))
    document["room"] |= {"polygon_m": [[0, 0], [4, 0], [4, 2], [2, 2], [2, 3.5], [0, 3.5]], "openings": []}
    document["room"]["slopes"] = [{"wall": 2, "eaves_height_m": 1.0, "pitch_rad": 0.7}]
    with pytest.raises(
        FieldError, match=r"slopes\[0\].wall: expected a wall with the whole floor before it, got floor 1.500 m behind wall 2"
    ):
        scene_from_json(json.dumps(document))
