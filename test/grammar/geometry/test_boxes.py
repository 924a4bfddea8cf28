"""Boxes against hand-made cases and shapely."""

import math

import numpy as np
import pytest
from shapely import LineString, Point, Polygon

from grammar.geometry.boxes import (
    deepest_penetrations,
    footprint_corners,
    footprint_penetration,
    penetration,
    point_distance,
    segment_inside_length,
)


def box(x, y, z_low, z_high, half_depth, half_width, yaw=0.0):
    return np.array([x, y, z_low, z_high, half_depth, half_width, math.cos(yaw), math.sin(yaw)])


def random_boxes(rng, count):
    yaw = rng.uniform(-4, 4, count)
    return np.column_stack(
        [rng.uniform(-1, 1, (count, 2)), np.zeros(count), np.ones(count), rng.uniform(0.1, 0.8, (count, 2)), np.cos(yaw), np.sin(yaw)]
    )


def test_two_squares_overlap_by_known_depths():
    square = box(0, 0, 0, 1, 1, 1)
    assert footprint_penetration(square, box(1.7, 0.2, 0, 1, 1, 1)) == pytest.approx(0.3)
    # a square turned by 45 degrees reaches sqrt 2 to its side
    assert footprint_penetration(square, box(2, 0, 0, 1, 1, 1, math.pi / 4)) == pytest.approx(math.sqrt(2) - 1)
    assert footprint_penetration(square, box(3.5, 0, 0, 1, 1, 1)) == pytest.approx(-1.5)


def test_depth_of_stacked_boxes_is_the_least_of_three_axes():
    rows = np.stack([box(0, 0, 0, 1, 1, 1), box(0.5, 0, 0.9, 2, 1, 1), box(0, 0, 1, 2, 1, 1)])
    assert penetration(rows, 0, rows, 1) == pytest.approx(0.1)
    assert penetration(rows, 0, rows, 2) == 0.0
    owner = np.array([1, 2, 2])
    assert deepest_penetrations(rows, owner, rows, owner) == pytest.approx([0.1, 0.1, 0.0])


def test_signs_and_depths_agree_with_shapely():
    rng = np.random.default_rng(1)
    rows = random_boxes(rng, 400)
    for a, b in zip(rows[:200], rows[200:], strict=True):
        first, second = Polygon(footprint_corners(a)), Polygon(footprint_corners(b))
        depth = footprint_penetration(a, b)
        assert (depth > 0) == (first.intersection(second).area > 1e-12)
        if depth <= 0:
            assert -depth <= first.distance(second) + 1e-12
        else:
            # moved apart by the depth along some edge normal they only touch; by 1 % less they still overlap along all of them
            normals = [(a[6], a[7]), (-a[7], a[6]), (b[6], b[7]), (-b[7], b[6])]
            ways = [sign * np.array(n) for n in normals for sign in (1, -1)]

            def area(step, first=first, b=b):
                return first.intersection(Polygon(footprint_corners(b) + step)).area

            assert min(area(way * (depth + 1e-9)) for way in ways) < 1e-9
            assert min(area(way * depth * 0.99) for way in ways) > 0.0


def test_distances_and_clipped_segments_agree_with_shapely():
    rng = np.random.default_rng(2)
    for row in random_boxes(rng, 100):
        shape = Polygon(footprint_corners(row))
        assert shape.exterior.is_ccw
        a, b = rng.uniform(-2, 2, (2, 2))
        assert point_distance(row, *a) == pytest.approx(shape.distance(Point(a)), abs=1e-12)
        assert segment_inside_length(row, *a, *b) == pytest.approx(shape.intersection(LineString([a, b])).length, abs=1e-9)
