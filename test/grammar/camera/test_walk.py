"""Walks: allowed ground, shortest paths, smoothing that keeps its distance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from grammar.camera.walk import Walk, choose_ground, find_routes, position_at, sample_walk, slack_at

ROOM = np.array([(0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0)])
TABLE = [2.5, 2.0, 0.0, 0.75, 0.8, 0.5, 1.0, 0.0]
SHELF = [2.5, 2.0, 0.0, 2.2, 0.8, 0.5, 1.0, 0.0]


def test_ground_keeps_the_bodys_distance_from_walls_and_furniture() -> None:
    ground = choose_ground(ROOM, np.array([TABLE]), 1.5, 0.01, 0.3, 0.2, 0.05)
    x = ground.cells_m[:, 0]
    assert x.min() >= 0.3
    assert x.max() <= 4.7
    assert min(math.hypot(max(abs(a - 2.5) - 0.8, 0.0), max(abs(b - 2.0) - 0.5, 0.0)) for a, b in ground.cells_m) >= 0.3
    keep = 0.3 + ground.reserve_m
    free = (5.0 - 2 * keep) * (4.0 - 2 * keep) - (1.6 * 1.0 + 2 * keep * (1.6 + 1.0) + math.pi * keep**2)
    assert len(ground.cells_m) * 0.05**2 == pytest.approx(free, rel=0.03)


def test_largest_connected_part_is_taken() -> None:
    wall = [3.5, 2.0, 0.0, 2.5, 0.1, 2.0, 1.0, 0.0]
    ground = choose_ground(ROOM, np.array([wall]), 1.5, 0.01, 0.3, 0.2, 0.05)
    assert ground.cells_m[:, 0].max() < 3.4


def test_without_floor_the_lens_hovers_over_furniture_and_without_air_it_stands_where_most_room_is() -> None:
    bed = [2.5, 2.0, 0.0, 0.6, 2.5, 2.0, 1.0, 0.0]
    ground = choose_ground(ROOM, np.array([bed]), 1.5, 0.01, 0.3, 0.2, 0.05)
    assert len(ground.cells_m) > 4000
    left, right = [1.0, 2.0, 0.0, 2.5, 1.0, 2.0, 1.0, 0.0], [3.6, 2.0, 0.0, 2.5, 1.4, 2.0, 1.0, 0.0]
    crack = choose_ground(ROOM, np.array([left, right]), 1.5, 0.01, 0.3, 0.2, 0.05)
    assert crack.cells_m.shape == (1, 2)
    assert 2.05 <= crack.cells_m[0, 0] <= 2.15


def test_walk_is_long_enough_keeps_its_distance_and_never_hurries() -> None:
    ground = choose_ground(ROOM, np.array([SHELF]), 1.5, 0.01, 0.3, 0.2, 0.05)
    rng = np.random.default_rng(1)
    routes = find_routes(ground, rng.permutation(len(ground.cells_m))[:6])
    for length in (0.5, 3.0, 20.0):
        walk = sample_walk(rng, ground, routes, length, 0.2)
        assert walk.at_m[-1] >= length
        assert (np.diff(walk.at_m) > 0.0).all()
        points = position_at(walk, np.linspace(0.0, length, 400))
        for x, y in points:
            assert slack_at(ground.polygon, ground.boxes, ground.keep_m, ground.wall_keep_m, x, y) >= 0.0
        assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= length / 399 + 1e-9


def test_routes_go_round_obstacles_by_the_shortest_way() -> None:
    ground = choose_ground(ROOM, np.array([SHELF]), 1.5, 0.01, 0.3, 0.2, 0.05)
    ends = [int(np.argmin(np.linalg.norm(ground.cells_m - end, axis=1))) for end in ((1.2, 2.1), (3.8, 2.1))]
    routes = find_routes(ground, np.array(ends))
    walk = sample_walk(np.random.default_rng(0), ground, routes, 1.0, 0.0)
    way = np.linalg.norm(np.diff(walk.points_m, axis=0), axis=1).sum()
    assert 3.0 < way < 4.3
    assert walk.points_m[:, 1].max() > 2.75, "round the side that is nearer"


def test_smoothing_rounds_corners() -> None:
    ground = choose_ground(ROOM, np.array([SHELF]), 1.5, 0.01, 0.3, 0.2, 0.05)
    ends = [int(np.argmin(np.linalg.norm(ground.cells_m - end, axis=1))) for end in ((1.0, 2.0), (4.0, 2.4))]
    routes = find_routes(ground, np.array(ends))

    def sharpest_turn(smoothing_m: float) -> float:
        walk = sample_walk(np.random.default_rng(0), ground, routes, 1.0, smoothing_m)
        steps = np.diff(walk.points_m, axis=0)
        heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        return float(np.abs(np.diff(heading)).max())

    assert sharpest_turn(0.0) > 0.7
    assert sharpest_turn(0.2) < 0.3


def test_a_single_viewpoint_is_a_standing_walk() -> None:
    ground = choose_ground(ROOM, np.zeros((0, 8)), 1.5, 0.01, 0.3, 0.2, 0.05)
    walk = sample_walk(np.random.default_rng(0), ground, find_routes(ground, np.array([7])), 5.0, 0.2)
    np.testing.assert_array_equal(position_at(walk, np.array([0.0, 3.0])), ground.cells_m[[7, 7]])


def test_positions_are_interpolated_along_the_polyline() -> None:
    walk = Walk(np.array([0.0, 1.0, 3.0]), np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]))
    np.testing.assert_allclose(position_at(walk, np.array([0.5, 2.0])), [(0.5, 0.0), (1.0, 0.5)])
