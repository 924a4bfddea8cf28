"""Cameras of a rig: where each sits against the pose that the path gives, in that pose's optical frame (x right, y down, z forward)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from renderer.camera.config import CameraConfig
from scene_description.poses import Quaternion, multiply_quaternions, rotation_from_quaternion
from scene_description.products import matmul
from scene_description.types import CameraPose


def mount_quaternion(camera: CameraConfig) -> Quaternion:
    """Return the rotation of the camera against the rig: about the rig's x, then its y, then its z, by ``mount_rotation_rad``."""
    result: Quaternion = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in enumerate(camera.mount_rotation_rad):
        part = [0.0, 0.0, 0.0, math.cos(0.5 * angle)]
        part[axis] = math.sin(0.5 * angle)
        result = multiply_quaternions((part[0], part[1], part[2], part[3]), result)
    return result


def mounted(camera: CameraConfig, pose: CameraPose) -> CameraPose:
    """Return the pose of the camera's optical frame where the rig is at ``pose``; the same pose where it sits in the rig's middle."""
    if is_in_the_middle(camera):
        return pose
    moved = np.asarray(pose.position_m) + matmul(rotation_from_quaternion(pose.orientation), np.asarray(camera.mount_m))
    x, y, z = (float(value) for value in moved)
    orientation = multiply_quaternions(pose.orientation, mount_quaternion(camera))
    return CameraPose(stamp_ns=pose.stamp_ns, position_m=(x, y, z), orientation=orientation)


def mounted_path(camera: CameraConfig, path: Sequence[CameraPose]) -> tuple[CameraPose, ...]:
    """Return the camera's poses along the path of its rig."""
    return tuple(mounted(camera, pose) for pose in path)


def is_in_the_middle(camera: CameraConfig) -> bool:
    """Return whether the camera sits where the rig's path leads."""
    return not any((*camera.mount_m, *camera.mount_rotation_rad))


def stereo_shift_m(camera: CameraConfig) -> tuple[float, float]:
    """Return how far the camera sits right of and below the rig's middle, if that is all: what CameraInfo's P tells of a stereo pair."""
    x, y, z = camera.mount_m
    return (0.0, 0.0) if z or any(camera.mount_rotation_rad) else (x, y)
