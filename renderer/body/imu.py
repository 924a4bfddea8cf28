"""An inertial measurement unit on a moving body: what is true by the derivatives of the motion, and what the device makes of it.

Specific force is acceleration less gravity, in the frame of the device: at rest it points up with the size of gravity (REP 145).  A reading
is the truth through a matrix of scales and misalignments, plus a bias that walks, plus white noise, cut to the range and rounded.  Every
number of noise depends on (scene, sensor, sample) only.
"""

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


class ImuReader:
    """Reads the device of a room piece by piece, as its motion becomes known; the same as all at once.

    ``scene_key`` seeds the errors.
    """

    def __init__(self, config: ImuConfig, start_ns: int, scene_key: int) -> None:
        self._config, self._start_ns, self._read = config, start_ns, 0
        self._errors = ImuErrors(config, scene_key)

    def read(self, motion: Motion, end_ns: int) -> ImuReadings:
        """Return the samples up to ``end_ns`` that were not read yet; ``motion`` is known from an interval before the first of them on."""
        stamps = np.array(stamps_up_to(self._config.rate_hz, self._start_ns, end_ns, self._read), np.int64)
        self._read += len(stamps)
        times = np.asarray((stamps - self._start_ns) * 1e-9, np.float64)
        at = device_kinematics(motion, self._config, times)
        rate, force = at.rate_rad_s, specific_force(at)
        if self._config.samples == "mean":
            rate, force = _means(motion, self._config, times)
        return ImuReadings(stamps, at.quaternion, rate, force, self._errors.gyroscope(rate), self._errors.accelerometer(force))


def read_imu(motion: Motion, config: ImuConfig, start_ns: int, end_ns: int, scene_key: int) -> ImuReadings:
    """Return the samples of a room whose motion lasts from ``start_ns`` to ``end_ns``; ``scene_key`` seeds the errors."""
    return ImuReader(config, start_ns, scene_key).read(motion, end_ns)


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
    """The errors of a device in one room, sample after sample: those of a longer room begin alike."""

    def __init__(self, config: ImuConfig, scene_key: int) -> None:
        c = self._config = config
        self._gyroscope = _AxisErrors(
            scene_key, 0, c, (c.gyro_noise_rad_s, c.gyro_walk_rad_s2, c.gyro_bias_rad_s), (c.gyro_range_rad_s, c.gyro_step_rad_s)
        )
        self._accelerometer = _AxisErrors(
            scene_key, 1, c, (c.accel_noise_m_s2, c.accel_walk_m_s3, c.accel_bias_m_s2), (c.accel_range_m_s2, c.accel_step_m_s2)
        )

    def gyroscope(self, true: Floats) -> Floats:
        """Return the readings of the next true rates (n, 3)."""
        return self._gyroscope.read(true)

    def accelerometer(self, true: Floats) -> Floats:
        """Return the readings of the next true specific forces (n, 3)."""
        return self._accelerometer.read(true)

    def biases(self, samples: int) -> tuple[Floats, Floats]:
        """Return the biases of gyroscope and accelerometer at the next samples, (n, 3) each, which count as read."""
        return self._gyroscope.bias(samples), self._accelerometer.bias(samples)


class _AxisErrors:
    """The errors of three axes: ``sizes`` are those of noise, walk and bias at the start, ``scale`` the range and step of readings."""

    def __init__(
        self, scene_key: int, sensor: int, config: ImuConfig, sizes: tuple[float, float, float], scale: tuple[float, float]
    ) -> None:
        def stream(purpose: int) -> np.random.Generator:
            return np.random.default_rng(np.random.SeedSequence([scene_key, IMU_KEY, sensor, purpose]))

        noise, walk, bias = sizes
        self._range, self._step = scale
        self._noise, self._walk = noise * math.sqrt(config.rate_hz), walk / math.sqrt(config.rate_hz)
        self._mixing = config.misalignment_rad * stream(0).standard_normal((3, 3))
        self._mixing[np.diag_indices(3)] = 1.0 + config.scale_error * stream(1).standard_normal((3,))
        self._first_bias = bias * stream(2).standard_normal((1, 3))
        self._steps, self._noises = stream(3), stream(4)
        self._walked: Floats | None = None
        self._first_step = np.zeros((1, 3))

    def bias(self, samples: int) -> Floats:
        """Return the bias (n, 3) at the next samples."""
        steps = self._steps.standard_normal((samples, 3))
        if self._walked is None:
            self._walked, self._first_step = np.zeros((1, 3)), steps[:1]
        walked = np.cumsum(np.concatenate([self._walked, steps]), axis=0)[1:]
        self._walked = walked[-1:] if samples else self._walked
        return np.asarray(self._first_bias + self._walk * (walked - self._first_step))

    def read(self, true: Floats) -> Floats:
        """Return the readings of the next true values (n, 3)."""
        read = sum(true[:, j : j + 1] * self._mixing[None, :, j] for j in range(3))
        read = read + self.bias(len(true))
        read = read + self._noise * self._noises.standard_normal((len(true), 3))
        read = np.clip(read, -self._range, self._range)
        return np.asarray(self._step * np.rint(read / self._step) if self._step else read)
