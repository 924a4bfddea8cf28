"""An inertial measurement unit: it integrates to the pose, its errors have the sizes asked for, and the same seed is the same bytes."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from handheld_path import CLEAN, handheld
from scipy.integrate import cumulative_simpson
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from renderer.body.config import GRAVITY_M_S2, stamps_up_to
from renderer.body.imu import ImuErrors, device_kinematics, noise_variances, read_imu
from scene_description.motion import Motion
from scene_description.poses import quaternion_from_rpy

SECOND_NS = 10**9


def integrated(times: np.ndarray, rate: np.ndarray, force: np.ndarray, start: Rotation, place: np.ndarray, velocity: np.ndarray):
    """Integrate samples: splines through them, orientation by Magnus of order 4, velocity and place by Simpson."""
    step = times[1] - times[0]
    gyro, accel = make_interp_spline(times, rate, k=5), make_interp_spline(times, force, k=5)
    fine = times[0] + 0.5 * step * np.arange(2 * len(times) - 1)
    half, offset = 0.5 * step, 0.5 * step * math.sqrt(3) / 6
    first, second = (gyro(fine[:-1] + 0.5 * half + sign * offset) for sign in (-1, 1))
    exponents = 0.5 * half * (first + second) - math.sqrt(3) / 12 * half**2 * np.cross(second, first)
    turns = [start]
    for exponent in exponents:
        turns.append(turns[-1] * Rotation.from_rotvec(exponent))
    world = Rotation.concatenate(turns).apply(accel(fine)) - [0, 0, GRAVITY_M_S2]
    speed = velocity + cumulative_simpson(world, x=fine, axis=0, initial=0)
    return turns[-1], place + cumulative_simpson(speed, x=fine, axis=0, initial=0)[-1]


def test_a_minute_in_the_hand_integrates_to_a_millimetre_and_a_hundredth_of_a_degree() -> None:
    seed = int(time.time())
    config = replace(CLEAN, mount_m=(0.02, -0.05, 0.01), mount_rotation_rad=(0.3, -0.2, 1.0))
    motion = handheld(60.0, seed)
    read = read_imu(motion, config, 0, 60 * SECOND_NS, 1)
    np.testing.assert_array_equal(read.rate_rad_s, read.true_rate_rad_s)
    times = read.stamps_ns * 1e-9
    ends = device_kinematics(motion, config, times[[0, -1]])
    assert np.linalg.norm(read.true_force_m_s2 - np.array([0.0, 0.0, GRAVITY_M_S2]), axis=1).max() > 2.0
    turn, place = integrated(
        times, read.rate_rad_s, read.force_m_s2, Rotation.from_quat(ends.quaternion[0]), ends.position_m[0], ends.velocity_m_s[0]
    )
    far_mm = 1e3 * np.linalg.norm(place - ends.position_m[1])
    off_deg = math.degrees((turn.inv() * Rotation.from_quat(ends.quaternion[1])).magnitude())
    assert far_mm < 1.0, seed
    assert off_deg < 0.01, seed


def test_at_rest_a_tilted_device_reads_gravity_in_its_own_frame() -> None:
    still = Motion(kind="still", spacing_s=1.0, positions_m=((0.0, 0.0, 1.0),) * 6, turns=((0.0, 0.0, 0.0, 1.0),) * 6)
    read = read_imu(still, replace(CLEAN, mount_rotation_rad=(math.pi / 2, 0.0, 0.0)), 5, 5 + SECOND_NS, 1)
    np.testing.assert_allclose(read.force_m_s2, np.tile([0.0, GRAVITY_M_S2, 0.0], (201, 1)), atol=1e-12)  # its y axis points up
    np.testing.assert_allclose(read.rate_rad_s, 0.0, atol=1e-13)
    assert read.stamps_ns[[0, 1, -1]].tolist() == [5, 5 + 5_000_000, 5 + SECOND_NS]
    assert quaternion_from_rpy((0.0, 0.0, math.pi / 2)) == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


def test_means_over_the_interval_are_those_of_the_integral() -> None:
    motion, config = handheld(5.0, 3), replace(CLEAN, samples="mean")
    read = read_imu(motion, config, 0, 5 * SECOND_NS, 1)
    dense = read_imu(motion, replace(CLEAN, rate_hz=20_000.0), 0, 5 * SECOND_NS, 1)
    for name in ("true_rate_rad_s", "true_force_m_s2"):
        values = getattr(dense, name)
        k = 700
        expected = (values[100 * (k - 1) : 100 * k] + values[100 * (k - 1) + 1 : 100 * k + 1]).mean(axis=0) / 2
        np.testing.assert_allclose(getattr(read, name)[k], expected, rtol=0, atol=1e-6)


def allan_deviation(values: np.ndarray, rate_hz: float, tau_s: float) -> np.ndarray:
    """Overlapping Allan deviation of rates (n, axes), IEEE Std 952-1997 annex C."""
    m = round(tau_s * rate_hz)
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)]) / rate_hz
    second = total[2 * m :] - 2 * total[m:-m] + total[: -2 * m]
    return np.sqrt((second**2).mean(axis=0) / (2 * tau_s**2))


def test_the_allan_deviation_is_that_of_the_parameters() -> None:
    """White noise N / sqrt(tau), walk K sqrt(tau / 3), and a walk alone; the mean of 48 axes, as three hours of one err by 5 % at 100 s."""
    seed, rate, noise, walk, force_walk = int(time.time()), 10.0, 2e-3, 1e-5, 0.01
    config = replace(CLEAN, rate_hz=rate, gyro_noise_rad_s=noise, gyro_walk_rad_s2=walk, accel_walk_m_s3=force_walk)
    devices = [ImuErrors(config, seed + number) for number in range(16)]
    true = np.zeros((round(10_800 * rate), 3))
    rates, forces = (np.hstack(read) for read in zip(*((one.gyroscope(true), one.accelerometer(true)) for one in devices), strict=True))
    for tau in (0.1, 1.0, 10.0, 100.0):
        of_rates = math.sqrt(noise**2 / tau + walk**2 * tau / 3)
        of_forces = force_walk * math.sqrt((tau + 1 / (2 * rate**2 * tau)) / 3)  # a walk in steps
        for readings, expected in ((rates, of_rates), (forces, of_forces)):
            found = math.sqrt((allan_deviation(readings, rate, tau) ** 2).mean())
            assert found == pytest.approx(expected, rel=0.05), (seed, tau)


def test_constant_errors_saturation_and_steps() -> None:
    motion = handheld(5.0, 3)
    true = read_imu(motion, CLEAN, 0, 5 * SECOND_NS, 4)
    config = replace(CLEAN, gyro_bias_rad_s=0.1, scale_error=0.01, misalignment_rad=0.02)
    read = read_imu(motion, config, 0, 5 * SECOND_NS, 4)
    fit, *_ = np.linalg.lstsq(np.column_stack([true.rate_rad_s, np.ones(len(true.rate_rad_s))]), read.rate_rad_s, rcond=None)
    np.testing.assert_allclose(np.column_stack([true.rate_rad_s, np.ones(len(true.rate_rad_s))]) @ fit, read.rate_rad_s, atol=1e-12)
    assert np.abs(np.diag(fit[:3]) - 1).max() < 0.05
    assert 0 < np.abs(fit[:3] - np.diag(np.diag(fit[:3]))).max() < 0.1
    cut = read_imu(motion, replace(CLEAN, accel_range_m_s2=9.9, gyro_step_rad_s=0.01), 0, 5 * SECOND_NS, 4)
    assert cut.force_m_s2.max() == 9.9
    assert np.abs(cut.rate_rad_s / 0.01 - np.rint(cut.rate_rad_s / 0.01)).max() < 1e-9
    assert np.abs(cut.rate_rad_s - true.rate_rad_s).max() <= 0.005 + 1e-12


def test_noise_has_the_variance_told_and_depends_on_the_scene_alone() -> None:
    motion, config = handheld(20.0, 3), replace(CLEAN, gyro_noise_rad_s=1e-3, accel_noise_m_s2=1e-2, gyro_step_rad_s=1e-3)
    read = read_imu(motion, config, 0, 20 * SECOND_NS, 4)
    errors = read.rate_rad_s - read.true_rate_rad_s, read.force_m_s2 - read.true_force_m_s2
    for error, variance in zip(errors, noise_variances(config), strict=True):
        assert error.var() == pytest.approx(variance, rel=0.05)
    again, other = read_imu(motion, config, 0, 20 * SECOND_NS, 4), read_imu(motion, config, 0, 20 * SECOND_NS, 5)
    assert again.rate_rad_s.tobytes() == read.rate_rad_s.tobytes()
    assert not np.array_equal(other.rate_rad_s, read.rate_rad_s)
    shorter = read_imu(motion, config, 0, 10 * SECOND_NS, 4)
    assert shorter.force_m_s2.tobytes() == read.force_m_s2[:2001].tobytes()


def test_samples_end_with_the_room() -> None:
    assert stamps_up_to(200.0, 7, 7 + 10_000_000) == [7, 5_000_007, 10_000_007]
    assert stamps_up_to(3.0, 0, 666_666_666) == [0, 333_333_333]
    assert stamps_up_to(3.0, 0, 666_666_667) == [0, 333_333_333, 666_666_667]
