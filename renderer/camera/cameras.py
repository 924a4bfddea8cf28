"""A camera at a pose: world point <-> pixel, and the numbers that kernels cast rays with.

Two conventions for the same pixels.  In *image coordinates*, used by every function here, the image spans [0, width] x [0, height], so
the pixel in column c has its centre at u = c + 0.5 and the centre of the image is (width / 2, height / 2).  ROS (REP 104, image_geometry)
and OpenCV put integer coordinates on pixel centres: there the same point is ((width - 1) / 2, (height - 1) / 2), which is what
:func:`intrinsics` returns for CameraInfo.  Optical frame: x right, y down, z forward (REP 103).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.config import CameraConfig
from renderer.camera.lenses import LENSES
from renderer.core.errors import RenderError
from scene_description.poses import world_from_optical
from scene_description.products import matmul, norm
from scene_description.types import CameraPose


class Intrinsics(NamedTuple):
    """Focal lengths and principal point in pixels, with integer coordinates at pixel centres (K of ROS's CameraInfo)."""

    fx: float
    fy: float
    cx: float
    cy: float


AT_REST = np.zeros((0, 12), np.float32)
"""``motion`` of a camera that does not move."""


class PosedCamera(NamedTuple):
    """A posed camera for kernels.

    Size in pixels, focal length in pixels, world_from_optical rotation (3, 3) and position (3,), float32.  bearings: (height + 2,
    width + 2, 3) float32, directions in the optical frame through the centres of the pixels and of a frame of pixels around them, NaN
    where the lens sees nothing; (0, 0, 3) for the ideal pinhole, which needs none.

    lens_radius_m and focus_m: of the aperture, 0 for none, and where it is in focus; sees_aside: whether the lens is none that maps a
    plane.  motion: (n, 12) float32, rotation against ``rotation`` (9) and position (3) at even times of the exposure, empty for a camera at
    rest; row_step and shutter_step: how many of these times pass from row to row, and while the shutter is open.
    """

    width: int
    height: int
    focal_px: np.float32
    rotation: NDArray[np.float32]
    position: NDArray[np.float32]
    bearings: NDArray[np.float32]
    lens_radius_m: np.float32 = np.float32(0.0)
    focus_m: np.float32 = np.float32(1.0)
    sees_aside: bool = False
    motion: NDArray[np.float32] = AT_REST
    row_step: np.float32 = np.float32(0.0)
    shutter_step: np.float32 = np.float32(0.0)


def intrinsics(camera: CameraConfig) -> Intrinsics:
    """Return CameraInfo's K entries: pixel centres at integer coordinates, so a centred cx is (width - 1) / 2."""
    fx = camera.focal_length_px
    fy = camera.focal_y_px or (camera.height / np.pi if camera.model == "equirectangular" else fx)
    cx = 0.5 * (camera.width - 1) if camera.principal_x_px == -1.0 else camera.principal_x_px
    cy = 0.5 * (camera.height - 1) if camera.principal_y_px == -1.0 else camera.principal_y_px
    return Intrinsics(fx, fy, cx, cy)


def pose_camera(camera: CameraConfig, pose: CameraPose) -> PosedCamera:
    """Return the camera at a pose.

    Raises:
        RenderError: the pose is not finite, its quaternion is not of unit length within 1e-3, or the lens has no inverse.
    """
    numbers = (*pose.position_m, *pose.orientation)
    if not np.all(np.isfinite(numbers)):
        raise RenderError(f"camera pose: expected finite position and orientation, got {numbers}")
    length = float(norm(pose.orientation))
    if abs(length - 1.0) > 1e-3:
        raise RenderError(f"camera pose: expected a unit quaternion, got length {length:.6g}")
    x, y, z, w = (item / length for item in pose.orientation)
    matrix = world_from_optical(pose.position_m, (x, y, z, w)).astype(np.float32)
    return PosedCamera(
        camera.width,
        camera.height,
        np.float32(camera.focal_length_px),
        np.ascontiguousarray(matrix[:3, :3]),
        np.ascontiguousarray(matrix[:3, 3]),
        np.zeros((0, 0, 3), np.float32) if camera.is_plain else bearing_table(camera),
        np.float32(camera.lens_radius_m),
        np.float32(camera.focus_distance_m or 1.0),
        not LENSES[camera.model].planar,
    )


@lru_cache(maxsize=4)
def bearing_table(camera: CameraConfig) -> NDArray[np.float32]:
    """Return ``PosedCamera.bearings`` of a lens; row i, column j belongs to the pixel in row i - 1, column j - 1.

    Kernels follow the table's differences within a pixel: rays through centres are exact, others off by less than 1e-2 pixels.

    Raises:
        RenderError: a planar model is not one-to-one over the image, or the lens sees nothing at all.
    """
    u, v = np.meshgrid(np.arange(camera.width + 2.0) - 0.5, np.arange(camera.height + 2.0) - 0.5)
    table = bearings(camera, np.column_stack([u.ravel(), v.ravel()])).reshape(camera.height + 2, camera.width + 2, 3)
    lost = np.argwhere(np.isnan(table[1:-1, 1:-1, 0]))
    if len(lost) and (LENSES[camera.model].planar or len(lost) == camera.width * camera.height):
        row, column = lost[0]
        raise RenderError(
            f"camera.distortion: expected coefficients that map directions one-to-one over the whole image, got {camera.distortion},"
            f" which fold over at pixel ({column}, {row})"
        )
    return table.astype(np.float32)


def bearings(camera: CameraConfig, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the directions (n, 3), optical frame, seen at image coordinates (n, 2); NaN where the lens sees nothing.

    Planar models (pinhole, Brown-Conrady, rational) give z = 1, the others unit length.
    """
    k = intrinsics(camera)
    points = (np.asarray(pixels, np.float64) - (k.cx + 0.5, k.cy + 0.5)) / (k.fx, k.fy)
    return LENSES[camera.model].bearing(points, _coefficients(camera))


def project(camera: CameraConfig, pose: CameraPose, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (u, v, depth) in image coordinates and metres along the optical z of world points (n, 3); u and v are NaN where not seen."""
    world_from_camera = world_from_optical(pose.position_m, pose.orientation)
    optical = matmul(np.asarray(points_m, np.float64) - world_from_camera[:3, 3], world_from_camera[:3, :3])
    return np.column_stack([place_on_image(camera, optical), optical[:, 2]])


def place_on_image(camera: CameraConfig, optical_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the image coordinates (n, 2) of points (n, 3) of the optical frame; NaN where they are not seen."""
    k = intrinsics(camera)
    return LENSES[camera.model].project(optical_m, _coefficients(camera)) * (k.fx, k.fy) + (k.cx + 0.5, k.cy + 0.5)


def unproject(camera: CameraConfig, pose: CameraPose, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the world points (n, 3) of rows (u, v, depth), image coordinates and metres along optical z: the inverse of :func:`project`.

    For cameras that see sideways or back, where depth does not determine a point, see :func:`bearings`.
    """
    rows = np.asarray(pixels, np.float64)
    directions = bearings(camera, rows[:, :2])
    optical = directions * (rows[:, 2] / directions[:, 2])[:, None]
    world_from_camera = world_from_optical(pose.position_m, pose.orientation)
    return np.asarray(matmul(optical, world_from_camera[:3, :3].T) + world_from_camera[:3, 3])


def _coefficients(camera: CameraConfig) -> tuple[float, ...]:
    return (*camera.distortion, *(0.0,) * (LENSES[camera.model].coefficients - len(camera.distortion)))
