"""Occlusion boundaries: where a surface ends before another that lies behind it."""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, kernel
from renderer.ground_truth.hit_view import HitLayers, HitView
from renderer.ground_truth.points import point_images

STEP_M = 0.01
"""Least distance between two surfaces; beside it two pixels' footprints, which tell a step from a slope."""


def boundaries(view: HitView) -> NDArray[np.uint8]:
    """Return 255 at the last pixel of a surface that hides what its neighbour, left, right, above or below, sees; else 0.

    Neighbours see one surface if one of the two points lies in the tangent plane of the other, within ``STEP_M`` and two pixels'
    footprints, as those of one triangle do.  Of two that do not, the nearer one is at the boundary.
    """
    image = np.zeros(view.hits.face.shape, np.uint8)
    footprint = np.float32(2.0 / float(view.camera.focal_px))
    points = view.shared(point_images)
    view.scene.in_rows(_mark, points.position, points.normals_world, view.images.range, view.hits.face, footprint, image)
    return image


@entry
def _mark(
    position: NDArray[np.float32],
    normals: NDArray[np.float32],
    distance: NDArray[np.float32],
    faces: NDArray[np.int32],
    footprint: np.float32,
    image: NDArray[np.uint8],
    first: int,
    step: int,
) -> None:
    height, width = image.shape
    for y in range(first, height, step):
        for x in range(width):
            here = distance[y, x]
            if not np.isfinite(here):
                continue
            least = np.float32(STEP_M) + footprint * here
            for side in range(4):
                i, j = y + (side == 0) - (side == 1), x + (side == 2) - (side == 3)
                if i < 0 or j < 0 or i >= height or j >= width or not distance[i, j] > here or faces[i, j] == faces[y, x]:
                    continue
                if distance[i, j] == np.inf or (
                    _off_plane(position, normals, y, x, i, j) > least and _off_plane(position, normals, i, j, y, x) > least
                ):
                    image[y, x] = 255


@kernel
def _off_plane(position: NDArray[np.float32], normals: NDArray[np.float32], y: int, x: int, i: int, j: int) -> np.float32:
    """Return how far the point of pixel (i, j) lies from the tangent plane at pixel (y, x), metres."""
    total = np.float32(0.0)
    for axis in range(3):
        total += normals[y, x, axis] * (position[i, j, axis] - position[y, x, axis])
    distance: np.float32 = abs(total)
    return distance


LAYERS: HitLayers = {"boundaries": boundaries}
