"""Wheels: exact without errors, a covariance that covers, errors of the sizes asked for."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from renderer.body.config import WheelsConfig
from renderer.body.wheels import WheelReader
from scene_description import SceneSynthError
from scene_description.kinematics import kinematics
from scene_description.motion import Drive, Motion

SECOND_NS = 10**9
CONFIG = WheelsConfig()
CLEAN = replace(CONFIG, ticks=0, slip_m=0.0, radius_error=0.0, track_error=0.0)


def winding(seconds: float, seed: int) -> Motion:
    """A drive that turns as it goes, back and forth: more than the lines and turns on the spot of sampled ones."""
    rng = np.random.default_rng(seed)
    count = round(10 * seconds) + 5
    speeds = 0.3 + 0.2 * np.sin(np.linspace(0, seconds * rng.uniform(0.3, 0.6), count))
    turning = 0.6 * np.sin(np.linspace(0, seconds * rng.uniform(0.3, 0.6), count) + rng.uniform(0, 6))
    drive = Drive(
        start_m=(1.0, -2.0),
        distances_m=tuple(np.cumsum(0.1 * speeds).tolist()),
        headings_rad=tuple((0.7 + np.cumsum(0.1 * turning)).tolist()),
    )
    return Motion(kind="base", spacing_s=0.1, drive=drive)


def truth(motion: Motion, stamps: np.ndarray) -> np.ndarray:
    at = kinematics(motion, stamps * 1e-9)
    headings = np.unwrap(2 * np.arctan2(at.quaternion[:, 2], at.quaternion[:, 3]))
    return np.column_stack([at.position_m[:, :2], headings])


def test_without_errors_odometry_is_within_a_tenth_of_a_millimetre() -> None:
    motion = winding(60.0, int(time.time()))
    read = WheelReader(CLEAN, 0, 1).read(motion, 60 * SECOND_NS)
    true = truth(motion, read.stamps_ns)
    assert np.ptp(true[:, :2], axis=0).max() > 1.0
    assert np.linalg.norm((read.pose - true)[:, :2], axis=1).max() < 1e-4
    assert np.abs(np.angle(np.exp(1j * (read.pose - true)[:, 2]))).max() < 1e-9
    speed = np.linalg.norm(kinematics(motion, (read.stamps_ns - 10**7) * 1e-9).velocity_m_s, axis=1)
    np.testing.assert_allclose(read.twist[1:, 0], speed[1:], atol=1e-4)
    np.testing.assert_allclose(read.rate_rad_s.mean(axis=1) * CLEAN.radius_m, read.twist[:, 0], atol=1e-12)
    assert (read.pose_covariance[:, [0, 1, 2], [0, 1, 2]] > 0).all()


@pytest.mark.parametrize(
    "config", [replace(CLEAN, slip_m=0.002), replace(CONFIG, slip_m=0.0003), CONFIG], ids=["slip", "mostly systematic", "all"]
)
def test_the_covariance_covers(config: WheelsConfig) -> None:
    """The normalised error squared of three numbers has mean 3, and 95 % of it below 7.81 as far as errors are small.

    The bounds are six standard deviations and more of 2,000 drives away: a seed of the clock alone does not pass them.
    """
    seed, motion = int(time.time()), winding(20.0, 5)
    true, found = truth(motion, np.array([20 * SECOND_NS]))[-1], []
    for key in range(seed, seed + 2000):
        read = WheelReader(config, 0, key).read(motion, 20 * SECOND_NS)
        error = read.pose[-1] - true
        error[2] = math.remainder(error[2], math.tau)
        found.append(error @ np.linalg.solve(read.pose_covariance[-1], error))
    assert 2.6 < np.mean(found) < 3.4, (seed, np.mean(found))
    assert 0.90 < np.mean(np.array(found) < 7.815) < 0.98, (seed, np.mean(np.array(found) < 7.815))


def test_the_twists_variance_covers() -> None:
    motion, errors = winding(20.0, 5), []
    config = replace(CONFIG, radius_error=0.0, track_error=0.0)
    true = WheelReader(CLEAN, 0, 1).read(motion, 20 * SECOND_NS).twist
    for key in range(20):
        read = WheelReader(config, 0, key).read(motion, 20 * SECOND_NS)
        errors.append((read.twist - true)[1:] ** 2 / read.twist_variance[1:])
    np.testing.assert_allclose(np.mean(errors, axis=(0, 1)), 1.0, rtol=0.1)


def test_encoders_have_steps_and_the_scene_decides() -> None:
    motion = winding(10.0, 5)
    read = WheelReader(CONFIG, 0, 9).read(motion, 10 * SECOND_NS)
    ticks = read.angle_rad * CONFIG.ticks / (2 * math.pi)
    assert np.abs(ticks - np.rint(ticks)).max() < 1e-6
    again = WheelReader(CONFIG, 0, 9).read(motion, 10 * SECOND_NS)
    assert again.pose.tobytes() == read.pose.tobytes()
    assert WheelReader(CONFIG, 0, 9).read(motion, 5 * SECOND_NS).pose.tobytes() == read.pose[:251].tobytes()


def test_what_has_no_wheels_is_refused() -> None:
    still = Motion(kind="still", spacing_s=1.0, positions_m=((0.0, 0.0, 1.0),) * 6, turns=((0.0, 0.0, 0.0, 1.0),) * 6)
    with pytest.raises(SceneSynthError, match=r"wheels.enabled: expected a motion on wheels, got 'still'; set motion.kind:=base"):
        WheelReader(CONFIG, 0, 1).read(still, SECOND_NS)
