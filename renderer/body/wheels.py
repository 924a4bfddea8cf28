"""Encoders of two wheels, and the odometry that is made of them with a covariance that covers its error.

Odometry integrates what the encoders say along arcs, corrected to second order for what changes on them, with nominal radii and track.
Its covariance is propagated to first order for the state (x, y, heading, errors of both radii and of the track), so that what errs the same
way all the time is told as such (the systematic errors of J. Borenstein and L. Feng, "Measurement and correction of systematic odometry
errors in mobile robots", IEEE Trans. Robotics and Automation 12(6), 1996).
"""

from __future__ import annotations

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


def read_wheels(motion: Motion, config: WheelsConfig, start_ns: int, end_ns: int, scene_key: int) -> WheelReadings:
    """Return the readings of a room; ``scene_key`` seeds the errors.

    Raises:
        SceneSynthError: what moves has no wheels.
    """
    if motion.drive is None:
        raise SceneSynthError(
            f"wheels.enabled: expected a motion on wheels, got '{motion.kind}'; set motion.kind:=base of the grammar node"
        )
    stamps = np.array(stamps_up_to(config.rate_hz, start_ns, end_ns), np.int64)
    times = (stamps - start_ns) * 1e-9
    gone, _ = driven_way(motion.drive, motion.spacing_s, times)
    angles = encoder_angles(gone - gone[:1], config, scene_key)
    pose, covariance = np.zeros((len(stamps), 3)), np.zeros((len(stamps), 3, 3))
    pose[0] = *motion.drive.start_m, gone[0, 1]
    ways = config.radius_m * angles
    spread = config.slip_m, config.radius_error, config.track_error
    integrate_odometry(ways, config.track_m, *spread, pose, covariance, np.zeros((3, _STATES, _STATES)))  # type: ignore[no-untyped-call]
    rounding = _rounding_variance(config)
    covariance[:, 0, 0] += 0.5 * rounding + _LEAST
    covariance[:, 1, 1] += 0.5 * rounding + _LEAST
    covariance[:, 2, 2] += 2.0 * rounding / config.track_m**2 + _LEAST
    steps, seconds = np.diff(ways, axis=0, prepend=ways[:1]), np.diff(times, prepend=times[:1] - 1.0 / config.rate_hz)[:, None]
    return WheelReadings(
        stamps,
        angles,
        steps / config.radius_m / seconds,
        pose,
        covariance,
        np.column_stack([steps.sum(axis=1) / 2.0, (steps[:, 1] - steps[:, 0]) / config.track_m]) / seconds,
        _twist_variance(config, steps, seconds),
    )


def encoder_angles(gone: Floats, config: WheelsConfig, scene_key: int) -> Floats:
    """Return what the encoders say (n, 2) where a base has gone a distance and turned (n, 2) since they were zero."""
    rng = np.random.default_rng(np.random.SeedSequence([scene_key, WHEELS_KEY, 0]))
    errors = np.array([config.radius_error, config.radius_error, config.track_error]) * rng.standard_normal(3)
    half_track = 0.5 * config.track_m * (1.0 + errors[2])
    ways = np.column_stack([gone[:, 0] - half_track * gone[:, 1], gone[:, 0] + half_track * gone[:, 1]])
    normals = np.random.default_rng(np.random.SeedSequence([scene_key, WHEELS_KEY, 1])).standard_normal(ways.shape)
    slips = config.slip_m * np.sqrt(np.abs(np.diff(ways, axis=0, prepend=ways[:1]))) * normals
    angles = (ways + np.cumsum(slips, axis=0)) / (config.radius_m * (1.0 + errors[:2]))
    step = 2.0 * math.pi / config.ticks if config.ticks else 0.0
    return np.asarray(step * np.rint(angles / step) if step else angles)


@entry
def integrate_odometry(ways, track, slip, radius_error, track_error, pose, covariance, work):  # type: ignore[no-untyped-def]
    """Fill ``pose`` (n, 3) from its first row on, and ``covariance`` (n, 3, 3), for ways of the wheels (n, 2); work: (3, 6, 6)."""
    spread, jacobian, product = work[0], work[1], work[2]
    spread[3, 3] = spread[4, 4] = radius_error * radius_error
    spread[5, 5] = track_error * track_error
    gone_before, turn_before = 0.0, 0.0
    for k in range(1, len(ways)):
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
