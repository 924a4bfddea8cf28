"""The pose of a frame as formats tell it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_description import CameraPose
from scene_description.poses import world_from_optical
from scene_synth_ros.dataset import Frame

_OPTICAL_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenGL's camera has x right, y up and looks along -z."""


def camera_pose(frame: Frame) -> CameraPose:
    """Return the pose of a frame's optical frame in the map, with a quaternion of exactly unit length."""
    x, y, z = (float(item) for item in frame.pose[0])
    turn = np.asarray(frame.pose[1], np.float64)
    qx, qy, qz, qw = (turn / np.linalg.norm(turn)).tolist()
    return CameraPose(stamp_ns=frame.stamp_ns, position_m=(x, y, z), orientation=(qx, qy, qz, qw))


def world_from_camera(pose: CameraPose) -> NDArray[np.float64]:
    """Return the matrix (4, 4) that takes points of the optical frame (x right, y down, z forward) to the map."""
    return world_from_optical(pose.position_m, pose.orientation)


def camera_from_world(pose: CameraPose) -> NDArray[np.float64]:
    """Return the matrix (4, 4) that takes points of the map to the optical frame."""
    forth = world_from_camera(pose)
    back = np.eye(4)
    back[:3, :3] = forth[:3, :3].T
    back[:3, 3] = -forth[:3, :3].T @ forth[:3, 3]
    return back


def world_from_opengl(pose: CameraPose) -> NDArray[np.float64]:
    """Return the matrix (4, 4) that takes points of OpenGL's camera (x right, y up, z backward) to the map."""
    return np.asarray(world_from_camera(pose) @ _OPTICAL_FROM_OPENGL)
