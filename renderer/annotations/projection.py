"""Where points of the world fall on the image plane of a frame, inside the image or not; with a rolling shutter, at their rows' times."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from renderer.camera.cameras import PosedCamera, project
from renderer.camera.config import CameraConfig
from renderer.camera.lenses import LENSES
from renderer.core.arrays import Array
from scene_description.poses import rotation_from_quaternion
from scene_description.types import CameraPose

_AT_ORIGIN = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0))
_ROUNDS = 4
"""A row's time follows from the row, the row from the pose at its time; each round leaves some thousandth of the error."""


class Seen(NamedTuple):
    """Points as a camera has them: in its optical frame (n, 3), and where it was then (n, 3), world; metres, float64."""

    optical_m: Array
    origin_m: Array


class Projection:
    """Projects points for one frame.

    Args:
        camera: its lens.
        pose: of the optical frame.
        view: the camera as rays know it, with its motion.
    """

    def __init__(self, camera: CameraConfig, pose: CameraPose, view: PosedCamera) -> None:
        self._camera, self._view = camera, view
        self._home = rotation_from_quaternion(pose.orientation)
        self._position = np.asarray(pose.position_m)

    @property
    def is_straight(self) -> bool:
        """Whether straight edges stay straight, so that the corners of a mesh bound it."""
        return len(self._view.bearings) == 0 and self._view.row_step == 0.0

    @property
    def is_planar(self) -> bool:
        """Whether the lens sees only what lies before it."""
        return LENSES[self._camera.model].planar

    def see(self, points_m: Array) -> Seen:
        """Return world points (n, 3) as the camera has them when it takes the rows that they fall on."""
        optical, origin = (points_m - self._position) @ self._home, np.broadcast_to(self._position, points_m.shape)
        if self._view.row_step > 0.0:
            middle = 0.5 * self._camera.height
            for _ in range(_ROUNDS):
                v = self.place(optical)[:, 1]
                moved = self._motion_at(np.where(np.isfinite(v), v, middle) - 0.5)
                origin = moved[:, 9:]
                optical = np.einsum("nij,ni->nj", moved[:, :9].reshape(-1, 3, 3), points_m - origin) @ self._home
        return Seen(optical, origin)

    def place(self, optical_m: Array) -> Array:
        """Return the places (n, 2) of points of the optical frame in image coordinates; NaN where the lens maps them nowhere."""
        places = project(self._camera, _AT_ORIGIN, optical_m)[:, :2]
        return np.where((self._slant(optical_m) <= lens_limit(self._camera))[:, None], places, np.nan)

    def place_within(self, optical_m: Array) -> Array:
        """Return the places (n, 2) of points, those beyond the lens's limit moved to where it ends; NaN behind a planar lens."""
        limit = lens_limit(self._camera)
        if np.isinf(limit):
            return project(self._camera, _AT_ORIGIN, optical_m)[:, :2]
        aside = np.hypot(optical_m[:, 0], optical_m[:, 1])
        beyond = self._slant(optical_m) > limit
        ahead = np.where(beyond, aside / limit if self.is_planar else aside / np.tan(limit), optical_m[:, 2])
        if self.is_planar:
            ahead = np.where(optical_m[:, 2] > 0.0, ahead, -1.0)
        return project(self._camera, _AT_ORIGIN, np.column_stack([optical_m[:, :2], ahead]))[:, :2]

    def _slant(self, optical_m: Array) -> Array:
        """Return the tangent of the angle to the axis, for lenses that are not planar the angle itself; inf behind a planar one."""
        aside, z = np.hypot(optical_m[:, 0], optical_m[:, 1]), optical_m[:, 2]
        if not self.is_planar:
            return np.asarray(np.arctan2(aside, z))
        return np.where(z > 0.0, aside / np.where(z > 0.0, z, 1.0), np.inf)

    def _motion_at(self, rows: Array) -> Array:
        """Return (n, 12), rotation and position of ``PosedCamera.motion``, in the middle of the exposure of rows (n,)."""
        knots, last = self._view.motion.astype(np.float64), self._camera.height - 1.0
        place = 0.5 * float(self._view.shutter_step) + np.clip(rows, 0.0, last) * float(self._view.row_step)
        index = np.clip(place.astype(np.int64), 0, len(knots) - 2)
        share = (place - index)[:, None]
        return np.asarray((1.0 - share) * knots[index] + share * knots[index + 1])


@lru_cache(maxsize=16)
def lens_limit(camera: CameraConfig) -> float:
    """Return how far from the axis a lens maps directions in order: beyond it places turn back to the middle.

    The tangent of the angle for planar lenses, the angle (rad) for others; infinite for the ideal pinhole and the panorama.
    """
    lens = LENSES[camera.model]
    if lens.coefficients == 0:
        return float(np.inf)
    slants = np.linspace(0.0, 20.0 if lens.planar else np.pi, 4001)
    ends = (slants, np.ones_like(slants)) if lens.planar else (np.sin(slants), np.cos(slants))
    radial = [*camera.distortion, *(0.0,) * (lens.coefficients - len(camera.distortion))]
    if lens.planar:
        radial[2:4] = 0.0, 0.0  # tangential
    places = lens.project(np.column_stack([ends[0], np.zeros_like(slants), ends[1]]), radial)[:, 0]
    back = np.flatnonzero(~(np.diff(places) > 0.0))
    return float(slants[back[0]]) if len(back) else float("inf") if lens.planar else float(slants[-1])
