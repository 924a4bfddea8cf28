"""Which row of a rolling shutter sees a point, and where.

The pose at a row's time tells where a point falls, and that place the row.  Both agree where ``miss(row) = place(row) - row`` is zero,
which the secant method finds: as the image moves by far less than a row in a row's time, the slope of ``miss`` is near -1.  What falls
beside the rows is where the first or the last of them sees it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import knot_of_row, mixed
from renderer.core.arrays import Array
from renderer.core.kernel import kernel
from scene_description.poses import rotation_from_quaternion
from scene_description.products import matmul
from scene_description.types import CameraPose

_ROUNDS = 8
_CLOSE_PX = 1e-3
_FLATTEST = -0.1
"""A slope above it is none to go by: -1 stands for it."""
_BEHIND_M = 1e-6


class Seen(NamedTuple):
    """Points as a camera has them: in its optical frame (n, 3), and where it was then (n, 3), world; metres, float64."""

    optical_m: Array
    origin_m: Array


def see_by_rows(camera: PosedCamera, pose: CameraPose, points_m: Array, place: Callable[[Array], Array]) -> Seen:
    """Return world points (n, 3) as a camera has them when it takes the rows that they fall on.

    ``pose``: of the optical frame at the stamp; ``place``: points of the optical frame (n, 3) -> image coordinates (n, 2).  Points that
    fall nowhere are those of the row at which that shows.
    """
    home, last = rotation_from_quaternion(pose.orientation), camera.height - 1.0
    knots = camera.motion.astype(np.float64)
    row, slope = np.full(len(points_m), 0.5 * last), np.full(len(points_m), -1.0)
    before = miss_before = np.full(len(points_m), np.nan)
    for _ in range(_ROUNDS):
        step = 0.5 * float(camera.shutter_step) + row * float(camera.row_step)
        index = np.clip(step.astype(np.int64), 0, len(knots) - 2)
        share = (step - index)[:, None]
        moved = (1.0 - share) * knots[index] + share * knots[index + 1]
        optical = matmul(matmul((points_m - moved[:, 9:])[:, None], moved[:, :9].reshape(-1, 3, 3))[:, 0], home)
        miss = np.nan_to_num(place(optical)[:, 1] - 0.5 - row, nan=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = (miss - miss_before) / (row - before)
        slope = np.where(slope < _FLATTEST, slope, -1.0)
        before, miss_before, row = row, miss, np.clip(row - miss / slope, 0.0, last)
        if not (np.abs(row - before) > _CLOSE_PX).any():
            break
    return Seen(optical, moved[:, 9:])


@kernel
def project_by_rows(camera: PosedCamera, x: np.float32, y: np.float32, z: np.float32, v: float) -> tuple[float, float]:
    """Return the image coordinates of a world point in an ideal pinhole; NaN behind it.  ``v``: a guess of the second one."""
    row = _row_at(camera, v)
    u, v = _project_at(camera, row, x, y, z)
    miss, slope = v - 0.5 - row, -1.0
    for _ in range(_ROUNDS):
        before, miss_before = row, miss
        row = _row_at(camera, row - miss / slope + 0.5)
        if not abs(row - before) > _CLOSE_PX:
            break
        u, v = _project_at(camera, row, x, y, z)
        miss = v - 0.5 - row
        slope = (miss - miss_before) / (row - before)
        slope = slope if slope < _FLATTEST else -1.0
    return u, v


@kernel
def eye_of_row(camera: PosedCamera, v: float) -> tuple[np.float32, np.float32, np.float32]:
    """Return where the camera is, world, when it takes what lies at ``v`` of its image coordinates."""
    i, s = knot_of_row(camera, np.float32(_row_at(camera, v)))
    return mixed(camera.motion, i, s, 9), mixed(camera.motion, i, s, 10), mixed(camera.motion, i, s, 11)


@kernel
def _row_at(camera: PosedCamera, v: float) -> float:
    """Return the row, with parts of rows, at image coordinate ``v``; the last one where it is NaN."""
    last = camera.height - 1.0
    row = v - 0.5
    row = row if row < last else last
    return row if row > 0.0 else 0.0


@kernel
def _project_at(camera: PosedCamera, row: float, x: np.float32, y: np.float32, z: np.float32) -> tuple[float, float]:
    """Return where a world point falls when a row is taken."""
    knots, r = camera.motion, camera.rotation
    i, s = knot_of_row(camera, np.float32(row))
    x, y, z = x - mixed(knots, i, s, 9), y - mixed(knots, i, s, 10), z - mixed(knots, i, s, 11)
    wx = mixed(knots, i, s, 0) * x + mixed(knots, i, s, 3) * y + mixed(knots, i, s, 6) * z
    wy = mixed(knots, i, s, 1) * x + mixed(knots, i, s, 4) * y + mixed(knots, i, s, 7) * z
    wz = mixed(knots, i, s, 2) * x + mixed(knots, i, s, 5) * y + mixed(knots, i, s, 8) * z
    depth = r[0, 2] * wx + r[1, 2] * wy + r[2, 2] * wz
    if not depth > _BEHIND_M:
        return np.nan, np.nan
    across, down = r[0, 0] * wx + r[1, 0] * wy + r[2, 0] * wz, r[0, 1] * wx + r[1, 1] * wy + r[2, 1] * wz
    focal = np.float64(camera.focal_px)
    return focal * across / depth + 0.5 * camera.width, focal * down / depth + 0.5 * camera.height
