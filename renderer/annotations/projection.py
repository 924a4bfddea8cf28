"""Where points of the world fall on the image plane of a frame, inside the image or not; with a rolling shutter, at their rows' times."""

from functools import lru_cache

import numpy as np

import kernel_cache.elementary as el
from renderer.camera.cameras import PosedCamera, bearing_table, place_on_image
from renderer.camera.config import CameraConfig
from renderer.camera.lenses import LENSES
from renderer.camera.row_times import Seen, see_by_rows
from renderer.core.arrays import Array
from scene_description.poses import rotation_from_quaternion
from scene_description.products import matmul
from scene_description.types import CameraPose

_STEP = 1e-3
"""Over which part of the field's edge its slope is taken."""
_REACH_PX = 1e7


class Projection:
    """Projects points for one frame.

    ``pose``: of the optical frame; ``view``: the camera as rays know it, with its motion.
    """

    def __init__(self, camera: CameraConfig, pose: CameraPose, view: PosedCamera) -> None:
        self._camera, self._view = camera, view
        self._pose, self._home = pose, rotation_from_quaternion(pose.orientation)
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
        if self._view.row_step > 0.0:
            return see_by_rows(self._view, self._pose, points_m, self.place)
        return Seen(matmul(points_m - self._position, self._home), np.broadcast_to(self._position, points_m.shape))

    def place(self, optical_m: Array) -> Array:
        """Return the places (n, 2) of points of the optical frame in image coordinates; NaN where the lens maps them nowhere.

        Distortion polynomials mean nothing beyond the image: what lies outside its field is placed straight on, as the edge leads.
        """
        edge = field_edge(self._camera)
        if np.isinf(edge):
            return _within_reach(place_on_image(self._camera, optical_m))
        aside, z = np.hypot(optical_m[:, 0], optical_m[:, 1]), optical_m[:, 2]
        slant = np.where(z > 0.0, aside / np.where(z > 0.0, z, 1.0), np.nan) if self.is_planar else el.arctan2(aside, z)
        outer = self._place_at(optical_m, np.minimum(slant, edge))
        inner = self._place_at(optical_m, np.minimum(slant, edge) - _STEP * edge)
        return _within_reach(outer + (outer - inner) * (np.maximum(slant - edge, 0.0) / (_STEP * edge))[:, None])

    def _place_at(self, optical_m: Array, slant: Array) -> Array:
        """Return the places of points that are turned to the axis until they have another slant."""
        aside = np.hypot(optical_m[:, 0], optical_m[:, 1])
        across = optical_m[:, :2] / np.maximum(aside, 1e-12)[:, None]
        length, ahead = (slant, np.ones_like(slant)) if self.is_planar else (el.sin(slant), el.cos(slant))
        return place_on_image(self._camera, np.column_stack([across * length[:, None], ahead]))


def _within_reach(places: Array) -> Array:
    return np.asarray(np.clip(places, -_REACH_PX, _REACH_PX))


@lru_cache(maxsize=16)
def field_edge(camera: CameraConfig) -> float:
    """Return the largest slant to the axis of any pixel: the tangent of the angle for planar lenses, the angle (rad) for others.

    Infinite for the ideal pinhole and the panorama, whose formulas hold everywhere.
    """
    lens = LENSES[camera.model]
    if lens.coefficients == 0:
        return float(np.inf)
    x, y, z = bearing_table(camera).reshape(-1, 3).astype(np.float64).T
    aside = np.hypot(x, y)
    return float(np.nanmax(aside / z if lens.planar else el.arctan2(aside, z)))
