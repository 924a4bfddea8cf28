"""Sloped ceilings as boxes and planes, against heights worked out by hand."""

import math

import numpy as np
import pytest

from grammar.geometry.slopes import above_slopes, low_ceiling, roof_boxes, slope_rows
from scene_description import Room, Slope
from scene_description.ceilings import ceiling_height_m

SOUTH = Slope(wall=0, eaves_height_m=1.0, pitch_rad=0.25 * math.pi)
EAST = Slope(wall=1, eaves_height_m=1.4, pitch_rad=math.atan(0.5))


def room(*slopes: Slope) -> Room:
    """4 x 3.5 m, 2.6 m high."""
    outline = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.5), (0.0, 3.5))
    return Room(polygon_m=outline, height_m=2.6, wall_thickness_m=0.1, openings=(), surfaces=(), slopes=slopes or None)


def box(x: float, y: float, high: float, half_depth: float, half_width: float, yaw: float = 0.0) -> np.ndarray:
    return np.array([[x, y, 0.0, high, half_depth, half_width, math.cos(yaw), math.sin(yaw)]])


def test_a_flat_room_has_neither_planes_nor_boxes():
    assert slope_rows(room()).shape == (0, 4)
    assert low_ceiling(room(), 2.0).shape == roof_boxes(room()).shape == (0, 8)


@pytest.mark.parametrize(
    ("slopes", "solid", "depth"),
    [
        ((SOUTH,), box(2.0, 1.0, 1.5, 0.5, 0.3), 0.0),  # its lowest edge is at y = 0.7, where the ceiling is 1.7 m high
        ((SOUTH,), box(2.0, 1.0, 2.0, 0.5, 0.3), 0.3 * math.sqrt(0.5)),
        ((SOUTH,), box(2.0, 1.0, 2.0, 0.5, 0.3, 0.5 * math.pi), 0.5 * math.sqrt(0.5)),
        ((SOUTH, EAST), box(3.5, 3.0, 2.0, 0.5, 0.3), 0.6 * 2.0 / math.sqrt(5.0)),
    ],
)
def test_depth_above_slopes_is_measured_square_to_them(slopes, solid, depth):
    assert above_slopes(slope_rows(room(*slopes)), solid, 0) == pytest.approx(depth)


def test_low_ceilings_cover_exactly_the_floor_below_a_height():
    (strip,) = low_ceiling(room(SOUTH), 1.5)
    assert strip[:6] == pytest.approx((2.0, 0.25, 1.0, 2.6, 0.25, 2.0))
    south, east = low_ceiling(room(SOUTH, EAST), 1.9)
    assert south[[1, 4]] == pytest.approx((0.45, 0.45))
    assert east[[0, 1, 4, 5]] == pytest.approx((3.5, 1.75, 0.5, 1.75))
    assert low_ceiling(room(EAST), 1.3).shape == (0, 8)


def test_roof_boxes_fill_what_slopes_cut_off_and_a_step_more():
    sloped, rng = room(SOUTH, EAST), np.random.default_rng(0)
    boxes = roof_boxes(sloped)
    for x, y, z in rng.uniform((0.0, 0.0, 0.0), (4.0, 3.5, 2.6), (3000, 3)).tolist():
        dx, dy = x - boxes[:, 0], y - boxes[:, 1]
        inside = (np.abs(dx * boxes[:, 6] + dy * boxes[:, 7]) <= boxes[:, 4]) & (np.abs(dy * boxes[:, 6] - dx * boxes[:, 7]) <= boxes[:, 5])
        filled = bool((inside & (z > boxes[:, 2])).any())
        ceiling = ceiling_height_m(sloped, x, y)
        assert filled if z > ceiling else not filled or z > ceiling - 0.1 - 1e-9
