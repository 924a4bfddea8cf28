"""Where the hits lie: in the world, before the camera, on their surface, in the box of their object."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.ground_truth.hit_view import HitLayers, HitView


def position(view: HitView) -> NDArray[np.float32]:
    """Return the points that are hit, (height, width, 3), world, metres; NaN where nothing is."""
    return view.position


def position_camera(view: HitView) -> NDArray[np.float32]:
    """Return the same in the optical frame at the frame's stamp."""
    return view.turned(view.position, view.camera.rotation.T, view.camera.position)


def uv(view: HitView) -> NDArray[np.float32]:
    """Return texture coordinates, (height, width, 2), metres along the surface, before scale and turn of any texture; NaN for none."""
    return view.interpolated(view.scene.flat.mesh.uvs)


def object_coordinates(view: HitView) -> NDArray[np.float32]:
    """Return where the hits lie in the boxes of their objects, (height, width, 3), from 0 to 1; NaN where nothing is hit."""
    image = np.full(view.position.shape, np.nan, np.float32)
    boxes = view.scene.flat.part_box
    if len(boxes):
        view.scene.in_rows(_into_boxes, view.position, view.part, boxes, image)
    return image


@entry
def _into_boxes(
    points: NDArray[np.float32], part: NDArray[np.int32], boxes: NDArray[np.float32], image: NDArray[np.float32], first: int, step: int
) -> None:
    height, width, _ = points.shape
    for y in range(first, height, step):
        for x in range(width):
            p = part[y, x]
            if p >= 0:
                for axis in range(3):
                    image[y, x, axis] = (
                        boxes[p, axis, 0] * points[y, x, 0]
                        + boxes[p, axis, 1] * points[y, x, 1]
                        + boxes[p, axis, 2] * points[y, x, 2]
                        + boxes[p, axis, 3]
                    )


LAYERS: HitLayers = {
    "position": position,
    "position_camera": position_camera,
    "uv": uv,
    "object_coordinates": object_coordinates,
}
