"""Modes of relations from poses made by hand."""

import math

import pytest

from grammar.learning.geometry import InFrame
from grammar.learning.modes import GroupPose, TopPose, around_modes, place_modes, wall_modes
from grammar.rules import WallMode

BED = (2.0, 1.6, 0.5)
STAND = (0.4, 0.5, 0.5)


def test_wall_modes_are_medians_by_quarter_turn() -> None:
    seen = [(0.01, 0.0), (0.02, 0.02), (0.9, -0.01), *[(0.1, math.pi / 2 + 0.3)] * 3, (0.5, math.pi)]
    back, side = wall_modes(seen, turned=True)
    assert back == WallMode(distance_m=0.02, orientation_rad=0.0)
    assert (side.distance_m, side.orientation_rad) == (pytest.approx(0.1), pytest.approx(math.pi / 2 + 0.3))


def test_wall_modes_without_direction() -> None:
    assert wall_modes([(-0.01, 1.0), (-0.02, 2.0), (0.3, 0.0)], turned=False) == (WallMode(distance_m=0.0, orientation_rad=None),)


def test_group_flush_with_the_back() -> None:
    # Backs flush: the stand's origin is 0.2 m before the bed's back plane at x = -1; its gap to the bed's side at y = 0.8 is 0.05.
    seen = [GroupPose(InFrame(-1.0 + 0.5 * depth, 0.8 + 0.05 + 0.25, 0.0), (depth, 0.5, 0.5), BED) for depth in (0.3, 0.4, 0.5)]
    (mode,) = around_modes(seen, turned=True)
    assert (mode.side, mode.align, mode.orientation_rad) == ("left", -1.0, 0.0)
    assert mode.gap_m == pytest.approx(0.05)
    assert mode.along_m == pytest.approx(0.0)


def test_group_opposite_its_core() -> None:
    # A chair pushed 0.3 m under the front edge, turned towards the desk.
    seen = [GroupPose(InFrame(0.35 - 0.3 + 0.25, along, math.pi), (0.5, 0.5, 0.9), (0.7, 1.4, 0.75)) for along in (-0.1, 0.0, 0.1)]
    (mode,) = around_modes(seen, turned=True)
    assert (mode.side, mode.align) == ("front", 0.0)
    assert mode.gap_m == pytest.approx(-0.3)
    assert abs(mode.orientation_rad or 0.0) == pytest.approx(math.pi)


def test_placements_at_both_ends() -> None:
    # A top of 0.6 x 1.4 m, a lamp of 0.2 x 0.2 m: fraction 0.5 of the free half depth 0.2 is 0.1, +-1 of the free half width is +-0.6.
    seen = [TopPose(InFrame(0.1, side * 0.6, 0.0), (0.2, 0.2, 0.4), (0.3, 0.7)) for side in (-1.0, 1.0, -1.0, 1.0)]
    right, left = place_modes(seen, turned=False)
    assert (right.depth_fraction, right.width_fraction, right.orientation_rad) == (pytest.approx(0.5), pytest.approx(-1.0), None)
    assert left.width_fraction == pytest.approx(1.0)
