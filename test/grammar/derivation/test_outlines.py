"""Floor outlines: drawn shapes, users' polygons, and whole rooms in them, checked by another geometry library."""

import math
from collections import Counter
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy import stats
from shapely import LineString, Polygon
from shapely.affinity import rotate, translate
from small_grammar import CATEGORIES

from grammar import RequestError, SceneRequest, object_solids, read_room_type, sample_room
from grammar.derivation.derive import derive
from grammar.derivation.outlines import check_outline, draw_arms, draw_outline
from grammar.geometry.walls import rectangle_outside, wall_lengths, wall_rows
from grammar.spec.room_rules import RoomShapes
from scene_description.polygons import signed_area_m2

VERTICES = {"rectangle": 4, "l_shape": 6, "t_shape": 8, "u_shape": 8, "chimney_breast": 8, "alcove": 8, "bay": 8}
U_ROOM = (0.0, 0.0, 6.0, 0.0, 6.0, 5.0, 4.0, 5.0, 4.0, 2.4, 2.2, 2.4, 2.2, 5.0, 0.0, 5.0)


@pytest.fixture(scope="module")
def grammar():
    return read_room_type("bedroom", CATEGORIES)


def shaped(grammar, **odds):
    return replace(grammar, room=replace(grammar.room, shapes=RoomShapes(rectangle=odds.pop("rectangle", 0.0), **odds)))


def rectangle(x, y, half_d, half_w, yaw):
    shape = Polygon([(half_d, half_w), (-half_d, half_w), (-half_d, -half_w), (half_d, -half_w)])
    return translate(rotate(shape, yaw, origin=(0, 0), use_radians=True), x, y)


def test_shapes_come_by_their_odds_and_fill_the_rectangle():
    shapes = RoomShapes(rectangle=0.3, l_shape=0.3, t_shape=0.1, u_shape=0.1, chimney_breast=0.1, alcove=0.05, bay=0.05, narrowest_m=0.5)
    rng, seen = np.random.default_rng(0), Counter()
    for _ in range(2000):
        points, attribute, bay, closed = draw_outline(rng, shapes, 6.0, 5.0)
        polygon, name = Polygon(points), attribute.value.split(",")[0]
        seen[name] += 1
        assert polygon.is_valid and polygon.exterior.is_ccw and len(points) == VERTICES[name]
        assert polygon.bounds == pytest.approx((-3.0, -2.5, 3.0, 2.5))
        assert signed_area_m2(points) == pytest.approx(polygon.area)
        reflex = {"rectangle": 0, "l_shape": 1}.get(name, 2)
        assert wall_rows(points)[:, 8].sum() == reflex
        assert (bay, closed) == ((3, 4, 5) if name == "bay" else (), (3, 4, 5) if name == "chimney_breast" else ())
    assert stats.chisquare([seen[name] for name in VERTICES], [600, 600, 200, 200, 200, 100, 100]).pvalue > 1e-4


@pytest.mark.parametrize(("width_m", "depth_m"), [(6.0, 4.0), (4.0, 6.0)])
def test_notches_that_were_seen_take_their_shares_of_the_long_and_the_short_side(width_m, depth_m):
    shapes = RoomShapes(rectangle=0.0, l_shape=1.0, notches=((0.2, 0.3),), notch_low=0.1, notch_high=0.6, notch_sd=0.001, narrowest_m=0.5)
    rng = np.random.default_rng(5)
    for _ in range(8):
        points, attribute, *_ = draw_outline(rng, shapes, width_m, depth_m)
        lengths = sorted(wall_lengths(points))
        assert lengths == pytest.approx([0.2 * 6.0, 0.3 * 4.0, 0.7 * 4.0, 4.0, 0.8 * 6.0, 6.0], abs=0.03)
        # at each share a normal density of deviation 0.001, no further than five of these from its mean
        assert 2.0 * math.log(400.0) - 25.0 < attribute.log_probability + math.log(4.0) < 2.0 * math.log(400.0)


@pytest.mark.parametrize(("name", "area", "ends"), [("l_shape", 0.8 * 9.2, 2), ("t_shape", 0.8 * 9.2, 3), ("u_shape", 0.0, 2)])
def test_all_arms_of_a_hall_are_equally_wide(name, area, ends):
    # An L and a T of arms a in w by d have the area a (w + d - a); a U has another arm: a (d - a) more if it opens along y.
    rng = np.random.default_rng(3)
    for _ in range(8):
        points, attribute, *_ = draw_arms(rng, RoomShapes(rectangle=0.4, **{name: 0.6}), 6.0, 4.0, 0.8)
        polygon = Polygon(points)
        assert polygon.bounds == pytest.approx((-3.0, -2.0, 3.0, 2.0)) and polygon.exterior.is_ccw
        assert np.isclose(wall_rows(points)[:, 4], 0.8).sum() == ends
        deep = 4.0 if int(attribute.value.split()[-3]) % 2 == 0 else 6.0
        assert polygon.area == pytest.approx(area or 0.8 * (9.2 + deep - 0.8))
    assert draw_arms(rng, RoomShapes(rectangle=0.0, **{name: 1.0}), 0.9, 0.9, 0.8) is None


@pytest.mark.parametrize("name", ["chimney_breast", "alcove"])
def test_breasts_jut_out_and_alcoves_are_let_in_by_metres(name):
    size = {"breast_width_m": (1.2, 1.201), "breast_depth_m": (0.4, 0.401), "alcove_width_m": (1.2, 1.201), "alcove_depth_m": (0.4, 0.401)}
    points, attribute, *_ = draw_outline(np.random.default_rng(2), RoomShapes(rectangle=0.0, **{name: 1.0}, **size), 5.0, 5.0)
    whole = {"chimney_breast": 25.0 - 1.2 * 0.4, "alcove": 5.0 * 4.6 + 1.2 * 0.4}[name]
    assert Polygon(points).area == pytest.approx(whole, abs=0.01)
    assert math.exp(attribute.log_probability) == pytest.approx(0.25 / 0.001**2)
    assert draw_outline(np.random.default_rng(0), RoomShapes(rectangle=0.0, **{name: 1.0}, narrowest_m=4.9), 5.0, 5.0) is None


@pytest.mark.parametrize(("canted", "front", "side"), [(1.0, 1.0, 0.5 * math.sqrt(2.0)), (0.0, 2.0, 0.5)])
def test_a_bay_has_its_front_in_the_middle_and_canted_sides_at_45_degrees(canted, front, side):
    shapes = RoomShapes(rectangle=0.0, bay=1.0, bay_width_m=(2.0, 2.001), bay_depth_m=(0.5, 0.501), bay_canted=canted)
    points, _, bay, _ = draw_outline(np.random.default_rng(2), shapes, 5.0, 5.0)
    assert [wall_lengths(points)[wall] for wall in bay] == pytest.approx([side, front, side], abs=0.003)
    assert Polygon(points).area == pytest.approx(25.0 - 0.5 * 3.0 - canted * 0.25, abs=0.01)


def test_the_windows_of_a_room_with_a_bay_are_in_it_and_no_door_is(grammar):
    bay = replace(shaped(grammar, bay=1.0).room.shapes, bay_canted=1.0, bay_width_m=(2.4, 2.6), bay_depth_m=(0.5, 0.6))
    grammar = replace(grammar, room=replace(grammar.room, shapes=bay))
    for seed in range(4):
        openings = derive(grammar, CATEGORIES, SceneRequest(), np.random.default_rng(seed)).room.openings
        windows = [opening.wall for opening in openings if opening.category == "window"]
        assert windows[:3] == [4, 3, 5]
        assert not {2, 3, 4, 5, 6} & {opening.wall for opening in openings if opening.category == "door"}
        one = derive(grammar, CATEGORIES, SceneRequest(counts=("window:1:1",)), np.random.default_rng(seed)).room.openings
        assert [opening.wall for opening in one if opening.category == "window"] == [4]


def test_an_arm_that_is_too_narrow_is_refused():
    assert draw_outline(np.random.default_rng(0), RoomShapes(rectangle=0.0, u_shape=1.0, narrowest_m=3.0), 6.0, 5.0) is None


def test_a_rectangle_across_a_notch_is_outside_by_the_wall_in_it():
    wall = wall_rows(np.reshape(U_ROOM, (-1, 2)))
    # a plank over the notch with its ends in both arms: the notch's walls x = 2.2 and x = 4 cross all of its 0.5 m
    assert rectangle_outside(wall, 3.1, 4.0, 1.0, 0.0, 1.5, 0.25) == pytest.approx(0.5, abs=1e-3)
    assert rectangle_outside(wall, 3.0, 1.0, 1.0, 0.0, 2.5, 0.9) == 0.0
    # flush with two walls and a reflex corner
    assert rectangle_outside(wall, 5.0, 3.7, 1.0, 0.0, 1.0, 1.3) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("shape", ["l_shape", "t_shape", "u_shape", "given"])
def test_rooms_with_corners_that_stick_in_are_valid_by_brute_force(grammar, shape):
    request = SceneRequest(max_objects=22, counts=("window:2:2",), room_polygon_m=U_ROOM if shape == "given" else ())
    shape_grammar = grammar if shape == "given" else shaped(grammar, **{shape: 1.0})
    door_walls = set()
    for seed in range(8):
        room = sample_room(shape_grammar, CATEGORIES, request, np.random.default_rng(seed))
        floor = Polygon(room.room.polygon_m)
        assert len(room.room.polygon_m) == VERTICES.get(shape, 8) and floor.is_valid and floor.exterior.is_ccw
        boxes, owner = object_solids(CATEGORIES, room.objects)
        placed = [
            (key, rectangle(b[0], b[1], b[4], b[5], math.atan2(b[7], b[6])), b[2], b[3])
            for key, b in zip(owner.tolist(), boxes, strict=True)
        ]
        for (a, first, low_a, high_a), (b, second, low_b, high_b) in combinations(placed, 2):
            if a != b and min(high_a, high_b) - max(low_a, low_b) > 0.001:
                assert first.buffer(-0.0005, join_style="mitre").intersection(second.buffer(-0.0005, join_style="mitre")).area < 1e-9
        for _, body, low, high in placed:
            assert floor.buffer(0.0011, join_style="mitre").contains(body)
            assert low >= -1e-9 and high <= room.room.height_m + 0.001
        for opening in room.room.openings:
            start, end = (np.array(room.room.polygon_m[(opening.wall + k) % len(room.room.polygon_m)]) for k in (0, 1))
            along = (end - start) / np.linalg.norm(end - start)
            span = LineString([start + along * opening.offset_m, start + along * (opening.offset_m + opening.width_m)])
            assert floor.exterior.buffer(1e-9).contains(span)
            door_walls.add(opening.wall)
    assert len(door_walls) > 3


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        ((0, 0, 4, 0, 4), "x and y of at least 3 vertices, got 5 numbers"),
        ((0, 0, 4, 4, 4, 0, 0, 4), "an outline that does not meet itself, got walls 0 and 2"),
        ((0, 0, 4, 0, 4, 4, 4, 2, 4, 6, 0, 6), "an outline that does not meet itself, got walls"),
        # a wall that folds back on the slanted one before it, and a corner on a slanted wall, both but for rounding
        (
            (2.6, 0.5, 3.7, 0.6, 5.5, 2.9, 3.7 + 1.8 * 0.3, 0.6 + 2.3 * 0.3, 1.1, 5.2),
            "an outline that does not meet itself, got walls 1 and 2",
        ),
        ((0, 0, 4.7, 1.3, 5, 5, 4.7 * 0.3, 1.3 * 0.3), "an outline that does not meet itself, got walls"),
        ((0, 0, 0.9, 0, 0.9, 0.9, 0, 0.9), "a floor of at least 1 m2, got 0.81 m2"),
        ((0, 0, 4, 0, 4, 0.01, 4, 4, 0, 4), "walls of at least 0.1 m, got one of 0.01 m"),
        ((0, 0, 4000, 0, 4000, 4000), "sides of at most 60 m, got 4000 m"),
        ((0, 0, float("nan"), 0, 4, 4), "finite numbers, got nan"),
    ],
)
def test_outlines_that_no_room_can_have_are_refused(numbers, expected):
    with pytest.raises(RequestError, match=f"^room_polygon_m: expected {expected}"):
        check_outline(numbers)


def test_an_outline_may_run_either_way():
    points = check_outline((0, 0, 0, 3, 4, 3, 4, 0))
    assert signed_area_m2(points) == 12.0


def test_an_outline_that_is_too_small_for_the_furniture_ends_in_a_named_error(grammar):
    small = replace(grammar, budget=replace(grammar.budget, derivations=200))
    with pytest.raises(RequestError, match=r"failed at: furniture on at most 0\.42 of the floor"):
        derive(small, CATEGORIES, SceneRequest(room_polygon_m=(0, 0, 2, 0, 2, 2, 0, 2)), np.random.default_rng(0))
    with pytest.raises(RequestError, match="room_polygon_m: expected no room_width_m"):
        derive(grammar, CATEGORIES, SceneRequest(room_polygon_m=U_ROOM, room_width_m=4.0), np.random.default_rng(0))
