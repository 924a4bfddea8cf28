"""Modes of relations from poses made by hand."""

import math

import numpy as np
import pytest

from grammar.learning.modes import GroupPose, Scale, SupportPose, around_modes, place_modes, wall_modes
from grammar.learning.observed import RelativePose

BED = (2.0, 1.6, 0.5)
SCALE = Scale(0.01, 0.005)


def test_wall_modes_by_quarter_turn_with_odds_and_spreads() -> None:
    seen = [(gap, 0.0) for gap in (0.01, 0.02, 0.02, 0.02, 0.03, 0.02, 0.02)] + [(0.5, math.pi / 2 + 0.3)] * 3
    back, side = wall_modes(seen, True, SCALE)
    assert (back.probability, back.distance_m, back.orientation_rad) == (pytest.approx(0.7), pytest.approx(0.02, abs=0.003), 0.0)
    # Deviations below what records tell count as that: 4 mm by an allowed 10 mm, 0.2 mrad by 5 mrad.
    assert (back.spread, back.orientation_spread) == (pytest.approx(0.4), pytest.approx(0.04))
    assert (side.probability, side.distance_m) == (pytest.approx(0.3), pytest.approx(0.5))
    assert side.orientation_rad == pytest.approx(math.pi / 2 + 0.3)


def test_rare_modes_stay_with_their_odds_but_single_oddities_go() -> None:
    many = [(0.1, 0.0)] * 90 + [(0.1, math.pi)] * 9 + [(0.1, 1.6)]
    modes = wall_modes(many, True, SCALE)
    assert [mode.probability for mode in modes] == pytest.approx([90 / 99, 9 / 99])
    assert abs(modes[1].orientation_rad or 0.0) == pytest.approx(math.pi)


def test_wall_modes_without_direction() -> None:
    (mode,) = wall_modes([(-0.01, 1.0), (-0.02, 2.0), (0.0, 0.0)], False, SCALE)
    assert (mode.probability, mode.distance_m, mode.orientation_rad) == (1.0, 0.0, None)


def test_turns_that_are_not_straight_make_a_mode_of_their_own() -> None:
    turns = [0.0] * 8 + [0.3, 0.5]
    straight, crooked = sorted(wall_modes([(0.1, turn) for turn in turns], True, SCALE), key=lambda mode: -(mode.probability or 0.0))
    assert (straight.probability, straight.orientation_rad) == (pytest.approx(0.8), 0.0)
    assert crooked.orientation_rad == pytest.approx(0.4)
    assert crooked.orientation_spread == pytest.approx(0.1 / 0.005)


def test_group_flush_with_the_back() -> None:
    # Backs flush: the stand's origin is 0.2 m before the bed's back plane at x = -1; its gap to the bed's side at y = 0.8 is 0.05.
    seen = [GroupPose(RelativePose(-1.0 + 0.5 * depth, 0.8 + 0.05 + 0.25, 0.0), (depth, 0.5, 0.5), BED) for depth in (0.3, 0.4, 0.5)]
    (mode,) = around_modes(seen, True, SCALE)
    assert (mode.side, mode.align, mode.orientation_rad) == ("left", -1.0, 0.0)
    assert (mode.gap_m, mode.along_m) == (pytest.approx(0.05), pytest.approx(0.0, abs=1e-9))
    assert mode.probability == 1.0


def test_a_pose_around_a_core_that_was_seen_once_is_no_mode() -> None:
    beside = [GroupPose(RelativePose(-0.8, 1.1, 0.0), (0.4, 0.5, 0.5), BED)] * 9
    before = [GroupPose(RelativePose(1.4, 0.0, 0.0), (0.4, 0.5, 0.5), BED)]
    assert [mode.side for mode in around_modes(beside + before, True, SCALE)] == ["left"]
    assert [mode.probability for mode in around_modes(beside + before + before, True, SCALE)] == pytest.approx([2 / 11, 9 / 11])
    behind = [GroupPose(RelativePose(-1.4, 0.0, 0.0), (0.4, 0.5, 0.5), BED)]
    assert around_modes(before + behind, True, SCALE) == ()


def test_group_opposite_its_core() -> None:
    # A chair pushed 0.3 m under the front edge, turned towards the desk; the mean distance from the middle place is 0.2 / 3.
    seen = [GroupPose(RelativePose(0.35 - 0.3 + 0.25, along, math.pi), (0.5, 0.5, 0.9), (0.7, 1.4, 0.75)) for along in (-0.1, 0.0, 0.1)]
    (mode,) = around_modes(seen, True, SCALE)
    assert (mode.side, mode.align) == ("front", 0.0)
    assert (mode.gap_m, mode.along_m) == (pytest.approx(-0.3), pytest.approx(0.0))
    assert abs(mode.orientation_rad or 0.0) == pytest.approx(math.pi)
    assert mode.spread == pytest.approx(0.5 * 0.2 / 3 / 0.01)


def test_placements_at_both_ends_by_their_odds() -> None:
    # A top of 0.6 x 1.4 m, a lamp of 0.2 x 0.2 m: fraction 0.5 of the free half depth 0.2 is 0.1, +-1 of the free half width is +-0.6.
    sides = np.array([-1.0] * 6 + [1.0] * 3)
    seen = [SupportPose(RelativePose(0.1, side * 0.6, 0.0), (0.2, 0.2, 0.4), (0.3, 0.7)) for side in sides]
    right, left = sorted(place_modes(seen, False, SCALE), key=lambda mode: mode.width_fraction or 0.0)
    assert (right.depth_fraction, right.width_fraction, right.orientation_rad) == (pytest.approx(0.5), pytest.approx(-1.0), None)
    assert left.width_fraction == pytest.approx(1.0)
    assert [right.probability, left.probability] == pytest.approx([2 / 3, 1 / 3])
