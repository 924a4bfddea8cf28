"""The ideal pinhole camera: world point <-> pixel, and the numbers that kernels cast rays with.

Two conventions for the same pixels.  In *image coordinates*, used by every function here, the image spans [0, width] x [0, height], so
the pixel in column c has its centre at u = c + 0.5 and the principal point is (width / 2, height / 2).  ROS (REP 104, image_geometry) and
OpenCV put integer coordinates on pixel centres: there the same principal point is ((width - 1) / 2, (height - 1) / 2), which is what
:func:`intrinsics` returns for CameraInfo.  Optical frame: x right, y down, z forward (REP 103).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.config import CameraConfig
from renderer.errors import RenderError
from scene_description.poses import world_from_optical
from scene_description.types import CameraPose


class Intrinsics(NamedTuple):
    """Focal lengths and principal point in pixels, with integer coordinates at pixel centres (K of ROS's CameraInfo)."""

    fx: float
    fy: float
    cx: float
    cy: float


class Pinhole(NamedTuple):
    """A posed camera for kernels: size in pixels, focal length in pixels, world_from_optical rotation (3, 3) and position (3,), float32."""

    width: int
    height: int
    focal_px: np.float32
    rotation: NDArray[np.float32]
    position: NDArray[np.float32]


def intrinsics(camera: CameraConfig) -> Intrinsics:
    """Return CameraInfo's K entries: pixel centres at integer coordinates, so cx = (width - 1) / 2 and cy = (height - 1) / 2."""
    focal = camera.focal_length_px
    return Intrinsics(focal, focal, 0.5 * (camera.width - 1), 0.5 * (camera.height - 1))


def pose_camera(camera: CameraConfig, pose: CameraPose) -> Pinhole:
    """Return the camera at a pose.

    Raises:
        RenderError: the pose is not finite or its quaternion is not of unit length within 1e-3.
    """
    numbers = (*pose.position_m, *pose.orientation)
    if not np.all(np.isfinite(numbers)):
        raise RenderError(f"camera pose: expected finite position and orientation, got {numbers}")
    length = float(np.linalg.norm(pose.orientation))
    if abs(length - 1.0) > 1e-3:
        raise RenderError(f"camera pose: expected a unit quaternion, got length {length:.6g}")
    x, y, z, w = (item / length for item in pose.orientation)
    matrix = world_from_optical(pose.position_m, (x, y, z, w)).astype(np.float32)
    return Pinhole(
        camera.width,
        camera.height,
        np.float32(camera.focal_length_px),
        np.ascontiguousarray(matrix[:3, :3]),
        np.ascontiguousarray(matrix[:3, 3]),
    )


def project(camera: CameraConfig, pose: CameraPose, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (u, v, depth) in image coordinates and metres of world points (n, 3); u and v are NaN at depth 0 or behind the camera."""
    world_from_camera = world_from_optical(pose.position_m, pose.orientation)
    optical = (np.asarray(points_m, np.float64) - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
    depth = optical[:, 2]
    scale = camera.focal_length_px / np.where(depth > 0.0, depth, np.nan)
    return np.column_stack([optical[:, 0] * scale + 0.5 * camera.width, optical[:, 1] * scale + 0.5 * camera.height, depth])


def unproject(camera: CameraConfig, pose: CameraPose, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the world points (n, 3) of rows (u, v, depth), image coordinates and metres: the inverse of :func:`project`."""
    u, v, depth = np.asarray(pixels, np.float64).T
    focal = camera.focal_length_px
    optical = np.column_stack([(u - 0.5 * camera.width) * depth / focal, (v - 0.5 * camera.height) * depth / focal, depth])
    world_from_camera = world_from_optical(pose.position_m, pose.orientation)
    return optical @ world_from_camera[:3, :3].T + world_from_camera[:3, 3]
