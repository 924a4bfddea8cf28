"""What every motion is planned from, and what all of them become."""

import math
from typing import NamedTuple

import numpy as np

from grammar.camera.camera_path import CameraSpace
from grammar.camera.motion_config import MotionConfig
from grammar.camera.path_config import CameraPathConfig
from grammar.geometry.arrays import Floats
from scene_description.kinematics import camera_kinematics
from scene_description.motion import DEGREE, Motion
from scene_description.poses import LINK_FROM_OPTICAL, Quaternion, multiply_quaternions
from scene_description.types import CameraPose

SECOND_NS = 1_000_000_000
REACH = (DEGREE + 1) / 2.0
"""How many knots before and after its time a control point is felt."""


class MotionPlan(NamedTuple):
    """What a motion is planned from: its settings, those of walks, the room, and how long it lasts."""

    config: MotionConfig
    path: CameraPathConfig
    space: CameraSpace
    duration_s: float


def control_times(duration_s: float, spacing_s: float) -> Floats:
    """Return the times at which curves of a duration stand nearest to their control points, (c,): all knots, and two beyond each end."""
    segments = max(math.ceil(duration_s / spacing_s - 1e-9), 1)
    return (np.arange(segments + DEGREE, dtype=np.float64) - (DEGREE - 1) / 2.0) * spacing_s


def ease(times_s: Floats, start_s: float, ramp_s: float) -> Floats:
    """Return a smooth step: 0 until ``start_s``, 1 from ``ramp_s`` later on, with two continuous derivatives."""
    x = np.clip((times_s - start_s) / ramp_s, 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def eased_time(times_s: Floats, start_s: float, ramp_s: float) -> Floats:
    """Return the integral of :func:`ease`: how far something goes that comes up to unit speed."""
    since = times_s - start_s
    x = np.clip(since / ramp_s, 0.0, 1.0)
    return ramp_s * x * x * x * x * (2.5 + x * (x - 3.0)) + np.maximum(since - ramp_s, 0.0)


def euler_quaternion(yaw_rad: float, pitch_rad: float, roll_rad: float = 0.0) -> Quaternion:
    """Return the orientation of a body that heads along a yaw and looks up by a pitch, rolled to its right about its own x axis.

    It changes with the angles without a jump, also where the yaw passes a half turn.
    """
    z = (0.0, 0.0, math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad))
    y = (0.0, math.sin(-0.5 * pitch_rad), 0.0, math.cos(0.5 * pitch_rad))
    x = (math.sin(0.5 * roll_rad), 0.0, 0.0, math.cos(0.5 * roll_rad))
    return multiply_quaternions(multiply_quaternions(z, y), x)


def camera_turn(pitch_rad: float) -> Quaternion:
    """Return what takes the optical frame of a camera that looks ahead, and up by a pitch, to its body."""
    return multiply_quaternions(euler_quaternion(0.0, pitch_rad), LINK_FROM_OPTICAL)


def as_points(values: Floats) -> tuple[tuple[float, float, float], ...]:
    """Return rows (n, 3) as a motion has them."""
    return tuple((x, y, z) for x, y, z in values.tolist())


def poses_of(motion: Motion, stamps_ns: list[int]) -> tuple[CameraPose, ...]:
    """Return where the camera is at some stamps; the motion begins at the first."""
    at = camera_kinematics(motion, (np.array(stamps_ns) - stamps_ns[0]) / SECOND_NS)
    return tuple(
        CameraPose(stamp_ns=stamp, position_m=(x, y, z), orientation=(qx, qy, qz, qw))
        for stamp, (x, y, z), (qx, qy, qz, qw) in zip(stamps_ns, at.position_m.tolist(), at.quaternion.tolist(), strict=True)
    )
