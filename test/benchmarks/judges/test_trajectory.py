"""The error of a trajectory: none after rotation and shift, and its root mean square otherwise; scale is told, not taken away."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.judges.trajectory import judge, places_only

STAMPS = 0.1 * np.arange(1000)


def test_a_trajectory_that_is_turned_and_shifted_has_no_error() -> None:
    true = np.random.default_rng(1).normal(size=(1000, 3)).cumsum(axis=0)
    said = Rotation.from_rotvec((0.3, -1.0, 2.0)).apply(true) + np.array((5.0, -3.0, 1.0))
    found = judge(places_only(STAMPS, said), places_only(STAMPS, true))
    assert found.ate_m < 1e-9 and found.scale == pytest.approx(1.0) and found.poses == 1000
    mirrored = true * np.array((1.0, 1.0, -1.0))
    assert judge(places_only(STAMPS, mirrored), places_only(STAMPS, true)).ate_m > 0.1
    late = judge(places_only(STAMPS[100:], said[100:]), places_only(STAMPS, true))
    assert late.ate_m < 1e-9 and late.poses == 900


def test_the_error_is_the_root_mean_square_distance() -> None:
    true = np.column_stack([np.linspace(-5.0, 5.0, 1000), np.cos(STAMPS), np.sin(STAMPS)])
    aside = true + np.outer(np.where(np.arange(1000) % 2, 0.03, -0.03), (0.0, 1.0, 0.0))
    assert judge(places_only(STAMPS, aside), places_only(STAMPS, true)).ate_m == pytest.approx(0.03, rel=1e-3)


def test_a_trajectory_that_is_too_large_is_told() -> None:
    true = np.random.default_rng(2).normal(size=(1000, 3)).cumsum(axis=0)
    large = judge(places_only(STAMPS, 1.02 * true), places_only(STAMPS, true))
    assert large.scale == pytest.approx(1.02) and large.ate_m > 0.1
    assert judge(places_only(STAMPS, 1.02 * true), places_only(STAMPS, true), scaled=True).ate_m < 1e-9


def test_errors_that_have_nothing_to_do_with_the_way_leave_the_scale_alone() -> None:
    rng = np.random.default_rng(3)
    true = rng.normal(scale=0.07, size=(1000, 3))
    said = 1.01 * true + rng.normal(scale=0.015, size=(1000, 3))  # larger by 4.6 % in its spread, not in its scale
    assert judge(places_only(STAMPS, said), places_only(STAMPS, true)).scale == pytest.approx(1.01, abs=0.01)


def test_what_stands_still_is_only_shifted() -> None:
    said = np.outer(np.where(np.arange(1000) % 2, 0.02, -0.02), (0.0, 0.0, 1.0)) + 7.0
    found = judge(places_only(STAMPS, said), places_only(STAMPS, np.ones((1000, 3))))
    assert found.ate_m == pytest.approx(0.02, rel=1e-3) and np.isnan(found.scale)


def test_what_goes_along_a_line_is_turned_into_it() -> None:
    true = np.outer(np.sin(STAMPS), (0.6, 0.8, 0.0))
    turned = Rotation.from_rotvec((0.0, 0.0, 2.0)).apply(true) + 3.0
    assert judge(places_only(STAMPS, turned), places_only(STAMPS, true)).ate_m < 1e-9
    aside = turned + np.outer(np.where(np.arange(1000) % 2, 0.03, -0.03), (0.0, 0.0, 1.0))
    assert judge(places_only(STAMPS, aside), places_only(STAMPS, true)).ate_m == pytest.approx(0.03, rel=1e-3)
