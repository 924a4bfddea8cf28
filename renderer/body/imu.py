"""An inertial measurement unit on a moving body: what is true by the derivatives of the motion, and what the device makes of it.

Specific force is acceleration less gravity, in the frame of the device: at rest it points up with the size of gravity (REP 145).  A reading
is the truth through a matrix of scales and misalignments, plus a bias that walks, plus white noise, cut to the range and rounded.  Every
number of noise depends on (scene, sensor, sample) only.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.body.config import GRAVITY_M_S2, ImuConfig, stamps_up_to
from scene_description.kinematics import Floats, Kinematics, conjugate, gauss_nodes, kinematics, mounted_kinematics, rotate
from scene_description.motion import Motion
from scene_description.poses import quaternion_from_rpy

IMU_KEY = 0x1207A11
"""Tells the device's random numbers from those of cameras."""


class ImuReadings(NamedTuple):
    """The samples of a room, n of them.

    Attributes:
        stamps_ns: (n,) int64, true times.
        quaternion: (n, 4) float64, takes the device's frame to the world.
        true_rate_rad_s: (n, 3) float64, angular velocity in the device's frame.
        true_force_m_s2: (n, 3) float64, specific force in the device's frame.
        rate_rad_s: (n, 3) float64, what the gyroscope reads.
        force_m_s2: (n, 3) float64, what the accelerometer reads.
    """

    stamps_ns: NDArray[np.int64]
    quaternion: Floats
    true_rate_rad_s: Floats
    true_force_m_s2: Floats
    rate_rad_s: Floats
    force_m_s2: Floats


def read_imu(motion: Motion, config: ImuConfig, start_ns: int, end_ns: int, scene_key: int) -> ImuReadings:
    """Return the samples of a room whose motion lasts from ``start_ns`` to ``end_ns``; ``scene_key`` seeds the errors."""
    stamps = np.array(stamps_up_to(config.rate_hz, start_ns, end_ns), np.int64)
    times = np.asarray((stamps - start_ns) * 1e-9, np.float64)
    at = device_kinematics(motion, config, times)
    rate, force = at.rate_rad_s, specific_force(at)
    if config.samples == "mean":
        rate, force = _means(motion, config, times)
    errors = ImuErrors(config, scene_key, len(stamps))
    return ImuReadings(stamps, at.quaternion, rate, force, errors.gyroscope(rate), errors.accelerometer(force))


def device_kinematics(motion: Motion, config: ImuConfig, times_s: Floats) -> Kinematics:
    """Return how the device moves."""
    return mounted_kinematics(kinematics(motion, times_s), config.mount_m, quaternion_from_rpy(config.mount_rotation_rad))


def specific_force(device: Kinematics) -> Floats:
    """Return acceleration less gravity in the device's frame (n, 3)."""
    return rotate(conjugate(device.quaternion), device.acceleration_m_s2 + np.array([[0.0, 0.0, GRAVITY_M_S2]]))


def noise_variances(config: ImuConfig) -> tuple[float, float]:
    """Return the variance of a sample's white noise and rounding, each axis: of the gyroscope and of the accelerometer."""
    gyro = config.gyro_noise_rad_s**2 * config.rate_hz + config.gyro_step_rad_s**2 / 12.0
    return gyro, config.accel_noise_m_s2**2 * config.rate_hz + config.accel_step_m_s2**2 / 12.0


def _means(motion: Motion, config: ImuConfig, times_s: Floats) -> tuple[Floats, Floats]:
    """Return rate and force, averaged over the interval before each time, by Gauss-Legendre quadrature."""
    interval_s = 1.0 / config.rate_hz
    rate, force = np.zeros((2, len(times_s), 3))
    for node, weight in gauss_nodes(5):
        at = device_kinematics(motion, config, times_s + interval_s * (0.5 * node - 0.5))
        rate, force = rate + 0.5 * weight * at.rate_rad_s, force + 0.5 * weight * specific_force(at)
    return rate, force


class ImuErrors:
    """The errors of a device in one room."""

    def __init__(self, config: ImuConfig, scene_key: int, samples: int) -> None:
        self._config, self._key, self._samples = config, scene_key, samples

    def gyroscope(self, true: Floats) -> Floats:
        """Return the readings of true rates (n, 3)."""
        c = self._config
        return self._read(true, 0, c.gyro_noise_rad_s, c.gyro_walk_rad_s2, c.gyro_bias_rad_s, c.gyro_range_rad_s, c.gyro_step_rad_s)

    def accelerometer(self, true: Floats) -> Floats:
        """Return the readings of true specific forces (n, 3)."""
        c = self._config
        return self._read(true, 1, c.accel_noise_m_s2, c.accel_walk_m_s3, c.accel_bias_m_s2, c.accel_range_m_s2, c.accel_step_m_s2)

    def biases(self) -> tuple[Floats, Floats]:
        """Return the biases of gyroscope and accelerometer at every sample, (n, 3) each."""
        c = self._config
        return self._bias(0, c.gyro_walk_rad_s2, c.gyro_bias_rad_s), self._bias(1, c.accel_walk_m_s3, c.accel_bias_m_s2)

    def _bias(self, sensor: int, walk: float, bias: float) -> Floats:
        steps = self._normals(sensor, 3, (self._samples, 3))
        walked = walk / math.sqrt(self._config.rate_hz) * (np.cumsum(steps, axis=0) - steps[:1])
        return np.asarray(bias * self._normals(sensor, 2, (1, 3)) + walked)

    def _normals(self, sensor: int, purpose: int, shape: tuple[int, ...]) -> Floats:
        """Return standard normal numbers; of a longer room the first are the same."""
        return np.random.default_rng(np.random.SeedSequence([self._key, IMU_KEY, sensor, purpose])).standard_normal(shape)

    def _read(self, true: Floats, sensor: int, noise: float, walk: float, bias: float, most: float, step: float) -> Floats:
        rate_hz = self._config.rate_hz
        mixing = self._config.misalignment_rad * self._normals(sensor, 0, (3, 3))
        mixing[np.diag_indices(3)] = 1.0 + self._config.scale_error * self._normals(sensor, 1, (3,))
        read = sum(true[:, j : j + 1] * mixing[None, :, j] for j in range(3))
        read = read + self._bias(sensor, walk, bias)
        read = read + noise * math.sqrt(rate_hz) * self._normals(sensor, 4, (self._samples, 3))
        read = np.clip(read, -most, most)
        return np.asarray(step * np.rint(read / step) if step else read)
