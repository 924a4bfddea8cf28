"""The floor's raster: local changes against flooding from nothing, and the cells of a box against the distance to it."""

import math

import numpy as np
import pytest
from numba import njit
from scipy import ndimage

from grammar.geometry.boxes import point_distance
from grammar.layout.circulation import empty_floor
from grammar.layout.floor_raster import (
    DONE,
    FLOODED,
    FREE,
    OPEN,
    REACHED_CELL,
    SIDE,
    STRIDE,
    _is_simple,
    move_box,
    settle,
    start_over,
    update,
)
from grammar.spec.rules import Thresholds

LIMITS = Thresholds(
    penetration_m=0.001,
    outside_m=0.001,
    gap_m=0.01,
    walkable_share=0.95,
    robot_radius_m=0.2,
    robot_height_m=1.5,
    reach_depth_m=0.6,
    grid_resolution_m=0.05,
)
ROOM = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.5, 3.0), (2.5, 2.2), (0.0, 2.2))
START = (0.2, 0.6)


@njit
def shift(old, new, k, had, has, floor):
    move_box(old, new, k, had, has, floor)


@njit
def flood(floor):
    start_over(floor)


@njit
def follow(floor):
    return update(floor)


@njit
def conclude(floor, stays):
    settle(floor, stays)


def box(x, y, depth, width, yaw):
    return np.array([[x, y, 0.0, 1.0, 0.5 * depth, 0.5 * width, math.cos(yaw), math.sin(yaw)]])


def raster(floor):
    return floor.covered.reshape(-1, floor.tally[STRIDE])


def test_a_box_covers_the_cells_that_are_nearer_than_the_radius():
    rng, floor = np.random.default_rng(0), empty_floor(ROOM, START, LIMITS)
    empty = floor.covered.copy()
    stride = floor.tally[STRIDE]
    x, y = (np.arange(stride) - 0.5) * 0.05, (np.arange(len(empty) // stride) - 0.5) * 0.05
    for trial in range(200):
        yaw = rng.choice([0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi]) if trial % 3 == 0 else rng.uniform(-4, 4)
        thing = box(rng.uniform(-0.5, 4.5), rng.uniform(-0.5, 3.5), rng.uniform(0.01, 2), rng.uniform(0.01, 2), yaw)
        shift(thing, thing, 0, False, True, floor)
        near = np.array([[point_distance(thing[0], a, b) < 0.2 - 1e-9 for a in x] for b in y])
        near[0] = near[-1] = near[:, 0] = near[:, -1] = False
        assert np.array_equal(raster(floor) - empty.reshape(-1, stride), near)
        assert floor.tally[FREE] == np.count_nonzero(floor.covered == 0)
        shift(thing, thing, 0, True, False, floor)
        assert np.array_equal(floor.covered, empty)


def expected_reach(floor):
    stands = raster(floor) == 0
    parts, _ = ndimage.label(stands)
    start = next((cell for cell in floor.entry if floor.covered[cell] == 0), None)
    return parts.ravel() == parts.ravel()[start] if start is not None else np.zeros(parts.size, bool)


def test_marks_after_random_moves_are_those_of_a_flood():
    rng, floor = np.random.default_rng(1), empty_floor(ROOM, START, LIMITS)
    placed = np.concatenate([box(rng.uniform(0, 4), rng.uniform(0, 3), *rng.uniform(0.1, 0.9, 2), rng.uniform(-3, 3)) for _ in range(9)])
    for k in range(len(placed)):
        shift(placed, placed, k, False, True, floor)
    flood(floor)
    kinds, shares = np.zeros(4, int), []
    for _ in range(6000):
        k, wide = rng.integers(len(placed)), rng.random() < 0.15
        new = placed.copy()
        new[k, :2] += rng.normal(size=2) * (1.0 if wide else 0.04)
        new[k, :2] = np.clip(new[k, :2], 0, (4, 3))
        turn = math.atan2(new[k, 7], new[k, 6]) + rng.normal() * 0.03
        new[k, 6:] = math.cos(turn), math.sin(turn)
        shift(placed, new, k, True, True, floor)
        mark = floor.mark[follow(floor)]
        reached, stands = expected_reach(floor), floor.covered == 0
        assert np.array_equal(mark == REACHED_CELL, reached) and np.array_equal(mark == OPEN, stands & ~reached)
        assert floor.tally[DONE] == reached.sum() and floor.tally[FREE] == stands.sum()
        stays = rng.random() < 0.6
        kinds[2 * floor.tally[FLOODED] + stays] += 1
        if stays:
            placed = new
        else:
            shift(new, placed, k, True, True, floor)
        conclude(floor, stays)
        reached = expected_reach(floor)
        assert np.array_equal(floor.mark[floor.tally[SIDE]] == REACHED_CELL, reached) and floor.tally[DONE] == reached.sum()
        shares.append(reached.sum() / max(floor.tally[FREE], 1))
    # all ways were taken, and both open and parted floors were met
    assert kinds.min() > 100 and min(shares) < 0.5 and max(shares) == pytest.approx(1.0)


def test_simple_rings_are_those_whose_middle_can_be_missed():
    for ring in range(256):
        around = np.zeros((3, 3), int)
        for bit, at in enumerate(((1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0), (0, 1), (0, 2))):
            around[at] = ring >> bit & 1
        parts, _ = ndimage.label(around)
        beside = {parts[at] for at in ((1, 2), (2, 1), (1, 0), (0, 1))} - {0}
        assert _is_simple(ring) == (len(beside) <= 1)
