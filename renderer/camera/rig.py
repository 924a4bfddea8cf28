"""Cameras of a rig: where each sits against the pose that the path gives, in that pose's optical frame (x right, y down, z forward)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from renderer.camera.config import CameraConfig
from scene_description.kinematics import camera_kinematics, mounted_kinematics
from scene_description.motion import Motion
from scene_description.poses import Quaternion, Vec3, multiply_quaternions, quaternion_from_rpy, rotation_from_quaternion
from scene_description.products import matmul
from scene_description.types import CameraPose


def mount_quaternion(camera: CameraConfig) -> Quaternion:
    """Return the rotation of the camera against the rig: about the rig's x, then its y, then its z, by ``mount_rotation_rad``."""
    return quaternion_from_rpy(camera.mount_rotation_rad)


def mounted(camera: CameraConfig, pose: CameraPose) -> CameraPose:
    """Return the pose of the camera's optical frame where the rig is at ``pose``; the same pose where it sits in the rig's middle."""
    if is_in_the_middle(camera):
        return pose
    moved = np.asarray(pose.position_m) + matmul(rotation_from_quaternion(pose.orientation), np.asarray(camera.mount_m))
    x, y, z = (float(value) for value in moved)
    orientation = multiply_quaternions(pose.orientation, mount_quaternion(camera))
    return CameraPose(stamp_ns=pose.stamp_ns, position_m=(x, y, z), orientation=orientation)


@dataclass(frozen=True, slots=True)
class CarriedPath(Sequence[CameraPose]):
    """The poses of a camera's frames, and the motion of the body that carries it, which says where it is between them.

    Attributes:
        poses: of the frames; the motion began at the first of the whole path, ``start_ns``.
        mount_m, mount_turn: place and orientation of the camera in the optical frame of the path.
    """

    poses: tuple[CameraPose, ...]
    motion: Motion
    start_ns: int
    mount_m: Vec3
    mount_turn: Quaternion

    @overload
    def __getitem__(self, index: int) -> CameraPose: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[CameraPose, ...]: ...
    def __getitem__(self, index: int | slice) -> CameraPose | tuple[CameraPose, ...]:
        """Return poses of frames."""
        return self.poses[index]

    def __len__(self) -> int:
        """Return how many frames there are."""
        return len(self.poses)

    def at(self, stamp_ns: int) -> CameraPose:
        """Return where the camera is at a stamp."""
        return self.between(stamp_ns, np.zeros(1))[0]

    def between(self, stamp_ns: int, times_s: NDArray[np.float64]) -> tuple[CameraPose, ...]:
        """Return where the camera is at ``stamp_ns`` + ``times_s`` (n,)."""
        rig = camera_kinematics(self.motion, (stamp_ns - self.start_ns) * 1e-9 + times_s)
        at = mounted_kinematics(rig, self.mount_m, self.mount_turn)
        stamps = [max(stamp_ns + round(time_s * 1e9), 0) for time_s in times_s.tolist()]
        return tuple(
            CameraPose(stamp_ns=stamp, position_m=(x, y, z), orientation=(qx, qy, qz, qw))
            for stamp, (x, y, z), (qx, qy, qz, qw) in zip(stamps, at.position_m.tolist(), at.quaternion.tolist(), strict=True)
        )


def mounted_path(camera: CameraConfig, path: Sequence[CameraPose], motion: Motion | None = None) -> Sequence[CameraPose]:
    """Return the camera's poses along the path of its rig; with its motion, if there is one and it is exposed for a time."""
    return _carried(camera, path, motion, path[0].stamp_ns)


def driven_path(camera: CameraConfig, rig: CarriedPath, stamps_ns: Sequence[int]) -> Sequence[CameraPose]:
    """Return the camera's poses at the stamps of some frames, as :func:`mounted_path` does, where a motion is known in part only."""
    return _carried(camera, [rig.at(stamp_ns) for stamp_ns in stamps_ns], rig.motion, rig.start_ns)


def _carried(camera: CameraConfig, path: Sequence[CameraPose], motion: Motion | None, start_ns: int) -> Sequence[CameraPose]:
    poses = tuple(mounted(camera, pose) for pose in path)
    if motion is None or not (camera.row_time_s or camera.shutter_s):
        return poses
    return CarriedPath(poses, motion, start_ns, camera.mount_m, mount_quaternion(camera))


def rig_path(path: Sequence[CameraPose], motion: Motion | None) -> Sequence[CameraPose]:
    """Return the poses of a rig with its motion, if there is one."""
    return path if motion is None else carried_rig(path, motion)


def carried_rig(path: Sequence[CameraPose], motion: Motion) -> CarriedPath:
    """Return the poses of a rig with the motion of the body that carries it."""
    return CarriedPath(tuple(path), motion, path[0].stamp_ns, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def is_in_the_middle(camera: CameraConfig) -> bool:
    """Return whether the camera sits where the rig's path leads."""
    return not any((*camera.mount_m, *camera.mount_rotation_rad))


def stereo_shift_m(camera: CameraConfig) -> tuple[float, float]:
    """Return how far the camera sits right of and below the rig's middle, if that is all: what CameraInfo's P tells of a stereo pair."""
    x, y, z = camera.mount_m
    return (0.0, 0.0) if z or any(camera.mount_rotation_rad) else (x, y)
