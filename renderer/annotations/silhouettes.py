"""The whole silhouettes of objects, what others hide and what lies outside the image included, as a pinhole camera would see them alone."""

import math
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.annotations.annotator import MARGIN_PX, tiles_of
from renderer.annotations.extents import project_extent
from renderer.annotations.object_meshes import ObjectMeshes
from renderer.annotations.pixels import paint_cover
from renderer.annotations.projection import Projection
from renderer.camera.camera_rays import CENTRE
from renderer.camera.cameras import pose_camera
from renderer.camera.config import CameraConfig
from renderer.core.ray_packet import make_packet
from scene_description.types import CameraPose

_NEAR_M = 1e-4
"""What lies nearer before the camera is not looked for, so that an object that reaches behind it is looked for on one side only."""
CANVAS = 3
"""Sides of the canvas against the image, which is in its middle: silhouettes are known one image's width and height beyond its border."""


class Silhouette(NamedTuple):
    """A silhouette on the canvas.

    Attributes:
        pixels: how many it has.
        left: its first column, image coordinates: negative left of the image.
        top: its first row.
        right: its last column.
        bottom: its last row.
        inside: (height, width) bool, the part of it in the image.
    """

    pixels: int
    left: int
    top: int
    right: int
    bottom: int
    inside: NDArray[np.bool_]


class Silhouettes:
    """Casts the rays of one camera at single objects of a room; may be used by several threads.

    ``camera``: a pinhole.
    """

    def __init__(self, meshes: ObjectMeshes, camera: CameraConfig) -> None:
        self._meshes, self._lock = meshes, Lock()
        self._width, self._height = camera.width, camera.height
        self._canvas = _canvas(camera)

    def of_frame(self, pose: CameraPose, instance: NDArray[np.uint16], keys: list[int]) -> dict[int, Silhouette | None]:
        """Return object -> silhouette from a pose; None where nothing of it falls on the canvas.

        A pixel that an object has belongs to its silhouette, whatever rounding says of the ray that is cast at it alone.

        ``pose``: of the optical frame; ``instance``: (height, width), ids of the frame; ``keys``: the objects.
        """
        view = pose_camera(self._canvas, pose)
        projection = Projection(self._canvas, pose, view)
        packet = make_packet()
        found: dict[int, Silhouette | None] = {}
        cover = np.zeros((view.height, view.width), np.bool_)
        inside = cover[self._height : 2 * self._height, self._width : 2 * self._width]
        for key in keys:
            with self._lock:
                extent, tree = project_extent(self._meshes, key, projection, _NEAR_M), self._meshes.tree(key).handle
            np.equal(instance, key, out=inside)
            if not math.isnan(extent.left):
                tiles = tiles_of(extent._replace(whole=True), MARGIN_PX, view, True)
                paint_cover(tree, view, packet, CENTRE, tiles, cover)
            found[key] = self._cut(cover, inside)
            cover[:] = False
        return found

    def _cut(self, cover: NDArray[np.bool_], inside: NDArray[np.bool_]) -> Silhouette | None:
        """Return what was painted on the canvas, given the part of it that is the image."""
        rows = np.flatnonzero(cover.any(axis=1))
        if not len(rows):
            return None
        part = cover[rows[0] : rows[-1] + 1]
        columns = np.flatnonzero(part.any(axis=0))
        return Silhouette(
            pixels=int(np.count_nonzero(part)),
            left=int(columns[0]) - self._width,
            top=int(rows[0]) - self._height,
            right=int(columns[-1]) - self._width,
            bottom=int(rows[-1]) - self._height,
            inside=inside.copy(),
        )


def _canvas(camera: CameraConfig) -> CameraConfig:
    """Return the camera that sees the canvas."""
    wide, high = CANVAS * camera.width, CANVAS * camera.height
    focal_x, focal_y = camera.focal_length_px, camera.focal_y_px or camera.focal_length_px
    centre_x = 0.5 * (camera.width - 1) if camera.principal_x_px == -1.0 else camera.principal_x_px
    centre_y = 0.5 * (camera.height - 1) if camera.principal_y_px == -1.0 else camera.principal_y_px
    centred = (centre_x, centre_y) == (0.5 * (camera.width - 1), 0.5 * (camera.height - 1))
    return CameraConfig(
        width=wide,
        height=high,
        focal_x_px=focal_x,
        focal_y_px=focal_y,
        principal_x_px=-1.0 if centred else centre_x + camera.width,
        principal_y_px=-1.0 if centred else centre_y + camera.height,
    )
