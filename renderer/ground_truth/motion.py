"""Optical flow to the neighbouring frames of the path, and where what a pixel sees is hidden there.  Nothing in a room moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera, project
from renderer.core import embree as ray
from renderer.core.embree import LANES, Packet, SceneHandle, occluded16
from renderer.core.kernel import entry
from renderer.ground_truth.hit_view import HitLayers, HitView
from renderer.path.surfaces import lift_height
from scene_description.types import CameraPose

VISIBLE, HIDDEN, OUTSIDE, UNKNOWN = range(4)
"""Values of the layers ``occlusion`` and ``occlusion_backward``."""
_NOT_QUITE = np.float32(0.9999)


def flow(view: HitView) -> NDArray[np.float32]:
    """Return where what a pixel sees goes in the next frame, (height, width, 2), right and down, in pixels."""
    return _flow_to(view, view.neighbours[1])


def flow_backward(view: HitView) -> NDArray[np.float32]:
    """Return where what a pixel sees was in the frame before, less where it is, (height, width, 2), in pixels."""
    return _flow_to(view, view.neighbours[0])


def occlusion(view: HitView) -> NDArray[np.uint8]:
    """Return whether what a pixel sees is seen in the next frame too, (height, width)."""
    return _occlusion_in(view, view.neighbours[1], view.shared(flow))


def occlusion_backward(view: HitView) -> NDArray[np.uint8]:
    """Return whether what a pixel sees was seen in the frame before, (height, width)."""
    return _occlusion_in(view, view.neighbours[0], view.shared(flow_backward))


def _flow_to(view: HitView, pose: CameraPose | None) -> NDArray[np.float32]:
    """Return the flow to the camera at a pose, its stamp's, whatever its shutter; NaN where nothing is hit, seen, or known."""
    image = np.full((*view.hits.face.shape, 2), np.nan, np.float32)
    if pose is None:
        return image
    if view.config.is_plain:
        camera = view.camera_at(pose)
        view.scene.in_rows(_project_plain, view.position, camera, image)
        return image
    v, u = np.mgrid[: image.shape[0], : image.shape[1]] + 0.5
    places = project(view.config, pose, view.position.reshape(-1, 3).astype(np.float64)).reshape(*image.shape[:2], 3)
    image[..., 0], image[..., 1] = places[..., 0] - u, places[..., 1] - v
    return image


def _occlusion_in(view: HitView, pose: CameraPose | None, moved: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return ``VISIBLE``, ``HIDDEN`` behind something, ``OUTSIDE`` of the image, or ``UNKNOWN`` where nothing is hit or no frame is."""
    image = np.full(view.hits.face.shape, UNKNOWN, np.uint8)
    if pose is None:
        return image
    camera = view.camera_at(pose)
    view.scene.in_tiles(_look_back, view.scene.tree, view.position, view.normals_world, moved, camera.position, image)
    return image


@entry
def _project_plain(position: NDArray[np.float32], camera: PosedCamera, image: NDArray[np.float32], first: int, step: int) -> None:
    """Fill rows of the flow to an ideal pinhole, in double precision; what lies behind it has none."""
    height, width = image.shape[0], image.shape[1]
    r, p, focal = camera.rotation, camera.position, float(camera.focal_px)
    for i in range(first, height, step):
        for j in range(width):
            x, y, z = float(position[i, j, 0]) - p[0], float(position[i, j, 1]) - p[1], float(position[i, j, 2]) - p[2]
            depth = r[0, 2] * x + r[1, 2] * y + r[2, 2] * z
            if depth > 1e-6:
                across, down = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z, r[0, 1] * x + r[1, 1] * y + r[2, 1] * z
                image[i, j, 0] = focal * across / depth + 0.5 * width - (j + 0.5)
                image[i, j, 1] = focal * down / depth + 0.5 * height - (i + 0.5)


@entry
def _look_back(
    packet: Packet,
    scene: SceneHandle,
    position: NDArray[np.float32],
    normals: NDArray[np.float32],
    flow_px: NDArray[np.float32],
    eye: NDArray[np.float32],
    image: NDArray[np.uint8],
    first: int,
    step: int,
) -> None:
    """Cast rays from what the pixels see to the other camera; rows ``first``, ``first + step``, ... of tiles of 4 x 4 pixels."""
    height, width = image.shape
    real = packet.real
    for row in range(4 * first, height, 4 * step):
        for column in range(0, width, 4):
            some = False
            for k in range(LANES):
                y, x = min(row + (k >> 2), height - 1), min(column + (k & 3), width - 1)
                u, v = flow_px[y, x, 0] + x + 0.5, flow_px[y, x, 1] + y + 0.5
                inside = 0.0 <= u <= width and 0.0 <= v <= height
                if not np.isnan(position[y, x, 0]):
                    image[y, x] = VISIBLE if inside else OUTSIDE
                packet.alive[k] = -1 if inside else 0
                some = some or inside
                px, py, pz = position[y, x, 0], position[y, x, 1], position[y, x, 2]
                height_m = lift_height(px, py, pz)
                for axis in range(3):
                    start = position[y, x, axis] + height_m * normals[y, x, axis]
                    real[ray.ORG_X + LANES * axis + k] = start
                    real[ray.DIR_X + LANES * axis + k] = eye[axis] - start
                real[ray.TNEAR + k], real[ray.TFAR + k] = np.float32(0.0), _NOT_QUITE
            if not some:
                continue
            occluded16(packet.alive.ctypes.data, scene.address, real.ctypes.data, scene.coherent)
            for k in range(LANES):
                y, x = row + (k >> 2), column + (k & 3)
                if y < height and x < width and packet.alive[k] != 0 and real[ray.TFAR + k] < np.float32(0.0):
                    image[y, x] = HIDDEN


LAYERS: HitLayers = {
    "flow": flow,
    "flow_backward": flow_backward,
    "occlusion": occlusion,
    "occlusion_backward": occlusion_backward,
}
