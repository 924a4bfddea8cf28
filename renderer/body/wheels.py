"""Encoders of two wheels, and the odometry that is made of them with a covariance that covers its error.

Odometry integrates what the encoders say along arcs, corrected to second order for what changes on them, with nominal radii and track.
Its covariance is propagated to first order for the state (x, y, heading, errors of both radii and of the track), so that what errs the same
way all the time is told as such (the systematic errors of J. Borenstein and L. Feng, "Measurement and correction of systematic odometry
errors in mobile robots", IEEE Trans. Robotics and Automation 12(6), 1996).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.body.config import WheelsConfig, stamps_up_to
from renderer.core.kernel import entry
from scene_description.errors import SceneSynthError
from scene_description.kinematics import Floats, driven_way
from scene_description.motion import Motion

WHEELS_KEY = 0x0D0
"""Tells the wheels' random numbers from those of other sensors."""
_LEAST = 1e-12
"""Variance of what is exact: zero would mean that it is unknown."""
_STATES = 6


class WheelReadings(NamedTuple):
    """The readings of a room, n of them; left wheel first.

    Attributes:
        stamps_ns: (n,) int64.
        angle_rad: (n, 2) float64, of the wheels, as the encoders say.
        rate_rad_s: (n, 2) float64, from one reading to the next.
        pose: (n, 3) float64, x, y (m), heading (rad): odometry, from the true pose on.
        pose_covariance: (n, 3, 3) float64.
        twist: (n, 2) float64, speed (m/s) and turn (rad/s) of the base.
        twist_variance: (n, 2) float64.
    """

    stamps_ns: NDArray[np.int64]
    angle_rad: Floats
    rate_rad_s: Floats
    pose: Floats
    pose_covariance: Floats
    twist: Floats
    twist_variance: Floats


class WheelReader:
    """Reads the wheels of a room piece by piece, as its motion becomes known; the same as all at once.

    ``scene_key`` seeds the errors.
    """

    def __init__(self, config: WheelsConfig, start_ns: int, scene_key: int) -> None:
        self._config, self._start_ns, self._read = config, start_ns, 0
        self._encoders = Encoders(config, scene_key)
        self._begin = np.zeros((1, 2))
        self._ways, self._pose, self._covariance = np.zeros((0, 2)), np.zeros((0, 3)), np.zeros((0, 3, 3))
        self._work, self._last_s = np.zeros((3, _STATES, _STATES)), -1.0 / config.rate_hz

    def read(self, motion: Motion, end_ns: int) -> WheelReadings:
        """Return the readings up to ``end_ns`` that were not read yet; ``motion`` is known from the last of the others on.

        Raises:
            SceneSynthError: what moves has no wheels.
        """
        if motion.drive is None:
            raise SceneSynthError(
                f"wheels.enabled: expected a motion on wheels, got '{motion.kind}'; set motion.kind:=base of the grammar node"
            )
        config = self._config
        stamps = np.array(stamps_up_to(config.rate_hz, self._start_ns, end_ns, self._read), np.int64)
        times = (stamps - self._start_ns) * 1e-9
        gone, _ = driven_way(motion.drive, motion.spacing_s, times)
        if not self._read:
            self._begin = gone[:1]
        angles = self._encoders.angles(gone - self._begin)
        before = len(self._ways)
        ways = np.concatenate([self._ways, config.radius_m * angles])
        pose = np.concatenate([self._pose, np.zeros((len(stamps), 3))])
        covariance = np.concatenate([self._covariance, np.zeros((len(stamps), 3, 3))])
        if not before and len(stamps):
            pose[0] = *motion.drive.start_m, gone[0, 1]
        spread = config.slip_m, config.radius_error, config.track_error
        integrate_odometry(ways, max(before, 1), config.track_m, *spread, pose, covariance, self._work)  # type: ignore[no-untyped-call]
        self._read += len(stamps)
        self._ways, self._pose, self._covariance = ways[-2:], pose[-2:], covariance[-2:]
        told = covariance[before:].copy()
        rounding = _rounding_variance(config)
        told[:, 0, 0] += 0.5 * rounding + _LEAST
        told[:, 1, 1] += 0.5 * rounding + _LEAST
        told[:, 2, 2] += 2.0 * rounding / config.track_m**2 + _LEAST
        steps = np.diff(ways, axis=0, prepend=ways[:1])[before:]
        seconds = np.diff(times, prepend=self._last_s)[:, None]
        self._last_s = float(times[-1]) if len(times) else self._last_s
        return WheelReadings(
            stamps,
            angles,
            steps / config.radius_m / seconds,
            pose[before:],
            told,
            np.column_stack([steps.sum(axis=1) / 2.0, (steps[:, 1] - steps[:, 0]) / config.track_m]) / seconds,
            _twist_variance(config, steps, seconds),
        )


class Encoders:
    """The encoders of both wheels in one room, reading after reading: those of a longer room begin alike."""

    def __init__(self, config: WheelsConfig, scene_key: int) -> None:
        errors = np.array([config.radius_error, config.radius_error, config.track_error])
        errors *= np.random.default_rng(np.random.SeedSequence([scene_key, WHEELS_KEY, 0])).standard_normal(3)
        self._config, self._half_track = config, 0.5 * config.track_m * (1.0 + errors[2])
        self._radii = config.radius_m * (1.0 + errors[:2])
        self._slips = np.random.default_rng(np.random.SeedSequence([scene_key, WHEELS_KEY, 1]))
        self._ways, self._slipped = np.zeros((0, 2)), np.zeros((1, 2))

    def angles(self, gone: Floats) -> Floats:
        """Return what they say next (n, 2), where a base has gone a distance and turned (n, 2) since they were zero."""
        ways = np.column_stack([gone[:, 0] - self._half_track * gone[:, 1], gone[:, 0] + self._half_track * gone[:, 1]])
        before = self._ways if len(self._ways) else ways[:1]
        sizes = np.sqrt(np.abs(np.diff(ways, axis=0, prepend=before)))
        slips = self._config.slip_m * sizes * self._slips.standard_normal(ways.shape)
        slipped = np.cumsum(np.concatenate([self._slipped, slips]), axis=0)
        if len(ways):
            self._ways, self._slipped = ways[-1:], slipped[-1:]
        angles = (ways + slipped[1:]) / self._radii
        step = 2.0 * math.pi / self._config.ticks if self._config.ticks else 0.0
        return np.asarray(step * np.rint(angles / step) if step else angles)


@entry
def integrate_odometry(ways, begin, track, slip, radius_error, track_error, pose, covariance, work):  # type: ignore[no-untyped-def]
    """Fill ``pose`` (n, 3) and ``covariance`` (n, 3, 3) from the row ``begin`` on, by the one or two before, for ways of the wheels (n, 2).

    ``work``: (3, 6, 6), zeros at first, then as it was left.
    """
    spread, jacobian, product = work[0], work[1], work[2]
    spread[3, 3] = spread[4, 4] = radius_error * radius_error
    spread[5, 5] = track_error * track_error
    gone_before, turn_before = 0.0, 0.0
    if begin > 1:
        left, right = ways[begin - 1, 0] - ways[begin - 2, 0], ways[begin - 1, 1] - ways[begin - 2, 1]
        gone_before, turn_before = 0.5 * (left + right), (right - left) / track
    for k in range(begin, len(ways)):
        left, right = ways[k, 0] - ways[k - 1, 0], ways[k, 1] - ways[k - 1, 1]
        gone, turn = 0.5 * (left + right), (right - left) / track
        middle = pose[k - 1, 2] + 0.5 * turn
        chord = gone * (1.0 - turn * turn / 24.0 * (1.0 - turn * turn / 80.0))  # 2 sin(turn / 2) / turn
        cosine, sine = math.cos(middle), math.sin(middle)
        aside = (gone * turn_before - gone_before * turn) / 12.0  # speed and turn change within the step, as they did since the last
        gone_before, turn_before = gone, turn
        pose[k, 0] = pose[k - 1, 0] + chord * cosine - aside * sine
        pose[k, 1] = pose[k - 1, 1] + chord * sine + aside * cosine
        pose[k, 2] = pose[k - 1, 2] + turn
        # what errors of the way and the turn do to the pose, and what the wheels' errors do to these
        for i in range(6):
            for j in range(6):
                jacobian[i, j] = 1.0 if i == j else 0.0
        jacobian[0, 2], jacobian[1, 2] = -chord * sine, chord * cosine
        way = (-0.5 * left, -0.5 * right, 0.0)
        heading = (left / track, -right / track, turn)
        for j in range(3):
            jacobian[0, 3 + j] = cosine * way[j] - 0.5 * chord * sine * heading[j]
            jacobian[1, 3 + j] = sine * way[j] + 0.5 * chord * cosine * heading[j]
            jacobian[2, 3 + j] = heading[j]
        for i in range(6):
            for j in range(6):
                total = 0.0
                for m in range(6):
                    total += jacobian[i, m] * spread[m, j]
                product[i, j] = total
        for i in range(6):
            for j in range(6):
                total = 0.0
                for m in range(6):
                    total += product[i, m] * jacobian[j, m]
                spread[i, j] = total
        for side in range(2):
            variance = slip * slip * abs(left if side == 0 else right)
            sign = (2.0 * side - 1.0) / track
            x = 0.5 * cosine - 0.5 * chord * sine * sign
            y = 0.5 * sine + 0.5 * chord * cosine * sign
            noise = (x, y, sign)
            for i in range(3):
                for j in range(3):
                    spread[i, j] += variance * noise[i] * noise[j]
        for i in range(3):
            for j in range(3):
                covariance[k, i, j] = 0.5 * (spread[i, j] + spread[j, i])


def _rounding_variance(config: WheelsConfig) -> float:
    """Return the variance of a wheel's way because its encoder has steps (m2)."""
    return (2.0 * math.pi * config.radius_m / config.ticks) ** 2 / 12.0 if config.ticks else 0.0


def _twist_variance(config: WheelsConfig, steps: Floats, seconds: Floats) -> Floats:
    """Return the variances (n, 2) of speed and turn."""
    ways = config.slip_m**2 * np.abs(steps) + (config.radius_error * steps) ** 2 + 2.0 * _rounding_variance(config)
    total = ways.sum(axis=1)
    turns = (config.track_error * (steps[:, 1] - steps[:, 0])) ** 2
    return np.column_stack([total / 4.0, (total + turns) / config.track_m**2]) / seconds**2 + _LEAST
