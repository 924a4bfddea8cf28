"""The whole silhouettes of objects, what others hide and what lies outside the image included, as a pinhole camera would see them alone."""

from __future__ import annotations

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
from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import pose_camera
from renderer.camera.config import CameraConfig
from renderer.core.embree import make_packet
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

    Args:
        meshes: of the room's objects.
        camera: a pinhole.
    """

    def __init__(self, meshes: ObjectMeshes, camera: CameraConfig) -> None:
        self._meshes, self._lock = meshes, Lock()
        self._width, self._height = camera.width, camera.height
        self._canvas = _canvas(camera)

    def of_frame(self, pose: CameraPose, keys: list[int]) -> dict[int, Silhouette | None]:
        """Return object -> silhouette from a pose; None where nothing of it falls on the canvas."""
        view = pose_camera(self._canvas, pose)
        projection = Projection(self._canvas, pose, view)
        packet = make_packet()
        found: dict[int, Silhouette | None] = {}
        cover = np.zeros((view.height, view.width), np.bool_)
        for key in keys:
            with self._lock:
                extent, tree = project_extent(self._meshes, key, projection, _NEAR_M), self._meshes.tree(key).handle
            if math.isnan(extent.left):
                found[key] = None
                continue
            tiles = tiles_of(extent._replace(whole=True), MARGIN_PX, view, True)
            paint_cover(tree, view, packet, CENTRE, tiles, cover)
            left, right, top, bottom = (int(edge) for edge in TILE * np.add(tiles, (0, 1, 0, 1)))
            found[key] = self._cut(cover, cover[top:bottom, left:right], left, top)
            cover[top:bottom, left:right] = False
        return found

    def _cut(self, cover: NDArray[np.bool_], part: NDArray[np.bool_], left: int, top: int) -> Silhouette | None:
        """Return what was painted on the canvas, given the part of it that was painted on, and where that is."""
        rows, columns = np.flatnonzero(part.any(axis=1)), np.flatnonzero(part.any(axis=0))
        if not len(rows):
            return None
        first, above = left - self._width, top - self._height
        return Silhouette(
            pixels=int(part.sum()),
            left=first + int(columns[0]),
            top=above + int(rows[0]),
            right=first + int(columns[-1]),
            bottom=above + int(rows[-1]),
            inside=cover[self._height : 2 * self._height, self._width : 2 * self._width].copy(),
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
