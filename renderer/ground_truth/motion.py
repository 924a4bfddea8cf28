"""Optical flow to the neighbouring frames of the path, and where what a pixel sees is hidden there.  Nothing in a room moves."""

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import TILE
from renderer.camera.cameras import PosedCamera, place_on_image, project
from renderer.camera.row_times import eye_of_row, see_by_rows
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, occluded16
from renderer.core.kernel import entry, kernel
from renderer.core.lanes import LANES_SIZE
from renderer.core.layout import Layout
from renderer.core.ray_packet import LANES, Packet
from renderer.core.tiles import load_pairs, load_vectors
from renderer.ground_truth.hit_view import HitLayers, HitView
from renderer.ground_truth.points import point_images
from renderer.path.surfaces import lift_height

VISIBLE, HIDDEN, OUTSIDE, UNKNOWN = range(4)
"""Values of the layers ``occlusion`` and ``occlusion_backward``."""
_ZERO, _NOT_QUITE = np.float32(0.0), np.float32(0.9999)

_LANES = Layout(LANES)
_P_X, _P_Y, _P_Z = _LANES.vector()  # the point, world
_N_X, _N_Y, _N_Z = _LANES.vector()  # its normal, world
_FLOW = _LANES.field(2)
_STATE = _LANES.field()  # what the layer tells
assert _LANES.size <= LANES_SIZE


def flow(view: HitView) -> NDArray[np.float32]:
    """Return where what a pixel sees goes in the next frame, (height, width, 2), right and down, in pixels."""
    return _flow_to(view, 1, view.shared(point_images).flow)


def flow_backward(view: HitView) -> NDArray[np.float32]:
    """Return where what a pixel sees was in the frame before, less where it is, (height, width, 2), in pixels."""
    return _flow_to(view, 0, view.shared(point_images).flow_backward)


def occlusion(view: HitView) -> NDArray[np.uint8]:
    """Return whether what a pixel sees is seen in the next frame too, (height, width)."""
    return _occlusion_in(view, view.neighbour_views[1], view.shared(flow))


def occlusion_backward(view: HitView) -> NDArray[np.uint8]:
    """Return whether what a pixel sees was seen in the frame before, (height, width)."""
    return _occlusion_in(view, view.neighbour_views[0], view.shared(flow_backward))


def _flow_to(view: HitView, side: int, image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the flow to the frame before (side 0) or after this one (1), each row at its time; NaN where nothing is hit, seen, or known.

    ``image``: that of ``point_images``, which holds it already for ideal pinholes.
    """
    pose, other = view.neighbours[side], view.neighbour_views[side]
    if pose is None or other is None or view.config.is_plain:
        return image
    v, u = np.mgrid[: image.shape[0], : image.shape[1]] + 0.5
    points = view.shared(point_images).position.reshape(-1, 3).astype(np.float64)
    if other.row_step > _ZERO:
        place = partial(place_on_image, view.config)
        places = place(see_by_rows(other, pose, points, place).optical_m)
    else:
        places = project(view.config, pose, points)
    places = places.reshape(*image.shape[:2], -1)
    image[..., 0], image[..., 1] = places[..., 0] - u, places[..., 1] - v
    return image


def _occlusion_in(view: HitView, other: PosedCamera | None, moved: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return ``VISIBLE``, ``HIDDEN`` behind something, ``OUTSIDE`` of the image, or ``UNKNOWN`` where nothing is hit or no frame is."""
    if other is None:
        return np.full(view.hits.face.shape, UNKNOWN, np.uint8)
    image = np.empty(view.hits.face.shape, np.uint8)
    points = view.shared(point_images)
    view.scene.in_tiles(_look_back, view.scene.tree, _SeenPoints(points.position, points.normals_world, moved), other, image)
    return image


class _SeenPoints(NamedTuple):
    """What pixels see: position and normal, world, and where they go in another frame."""

    position: NDArray[np.float32]
    normals: NDArray[np.float32]
    flow_px: NDArray[np.float32]


@entry
def _look_back(
    rays: Packet,
    lanes: NDArray[np.float32],
    scene: SceneHandle,
    seen: _SeenPoints,
    other: PosedCamera,
    image: NDArray[np.uint8],
    first: int,
    step: int,
) -> None:
    """Cast rays from what the pixels see to the other camera; rows ``first``, ``first + step``, ... of tiles."""
    height, width = image.shape
    for row in range(first * TILE, height, step * TILE):
        for column in range(0, width, TILE):
            load_vectors(seen.position, column, row, _P_X, lanes)
            load_vectors(seen.normals, column, row, _N_X, lanes)
            load_pairs(seen.flow_px, column, row, _FLOW, lanes)
            _aim_at(other, column, row, rays, lanes)
            some = 0
            for k in range(LANES):
                some |= rays.alive[k]
            if some:
                occluded16(rays.alive.ctypes.data, scene.address, rays.real.ctypes.data, scene.coherent)
                for k in range(LANES):
                    hidden = rays.alive[k] != 0 and rays.real[ray.TFAR + k] < _ZERO
                    lanes[_STATE + k] = np.float32(HIDDEN) if hidden else lanes[_STATE + k]
            for y in range(row, min(row + TILE, height)):
                for x in range(column, min(column + TILE, width)):
                    image[y, x] = np.uint8(lanes[_STATE + (y - row) * TILE + x - column])


@kernel
def _aim_at(other: PosedCamera, column: int, row: int, rays: Packet, lanes: NDArray[np.float32]) -> None:
    """Aim rays from a little above the points of the lanes at a camera, alive where it has the point in its image; fill the states."""
    real, alive = rays.real, rays.alive
    eye_x, eye_y, eye_z = other.position[0], other.position[1], other.position[2]
    right, bottom = np.float64(other.width), np.float64(other.height)
    for k in range(LANES):
        x, y, z = lanes[_P_X + k], lanes[_P_Y + k], lanes[_P_Z + k]
        u, v = np.float64(lanes[_FLOW + k]) + (column + (k & 3) + 0.5), np.float64(lanes[_FLOW + LANES + k]) + (row + (k >> 2) + 0.5)
        if other.row_step > _ZERO:
            eye_x, eye_y, eye_z = eye_of_row(other, v)
        inside = (u >= 0.0) & (u <= right) & (v >= 0.0) & (v <= bottom)
        alive[k] = np.int32(-1) if inside else np.int32(0)
        state = np.float32(VISIBLE) if inside else np.float32(OUTSIDE)
        lanes[_STATE + k] = state if x == x else np.float32(UNKNOWN)
        lift = lift_height(x, y, z)
        x, y, z = x + lift * lanes[_N_X + k], y + lift * lanes[_N_Y + k], z + lift * lanes[_N_Z + k]
        real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = x, y, z
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = eye_x - x, eye_y - y, eye_z - z
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _NOT_QUITE


LAYERS: HitLayers = {
    "flow": lambda view: view.shared(flow),
    "flow_backward": lambda view: view.shared(flow_backward),
    "occlusion": occlusion,
    "occlusion_backward": occlusion_backward,
}
