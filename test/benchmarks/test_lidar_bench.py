"""The error of a trajectory: none after rotation and shift, and its root mean square otherwise."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.lidar_bench import trajectory_error_m


def test_a_trajectory_that_is_turned_and_shifted_has_no_error() -> None:
    true = np.random.default_rng(1).normal(size=(50, 3)).cumsum(axis=0)
    said = Rotation.from_rotvec((0.3, -1.0, 2.0)).apply(true) + np.array((5.0, -3.0, 1.0))
    assert trajectory_error_m(said, true) < 1e-12
    mirrored = true * np.array((1.0, 1.0, -1.0))
    assert trajectory_error_m(mirrored, true) > 0.1


def test_the_error_is_the_root_mean_square_distance() -> None:
    true = np.column_stack([np.linspace(-5.0, 5.0, 1000), np.zeros(1000), np.zeros(1000)])
    aside = true + np.outer(np.where(np.arange(1000) % 2, 0.03, -0.03), (0.0, 1.0, 0.0))
    assert trajectory_error_m(aside, true) == pytest.approx(0.03, rel=1e-3)
