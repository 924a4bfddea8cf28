"""How much of a pixel its object covers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import MIDDLE, TILE, aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import move_rays
from renderer.core.embree import GEOM_ID, INVALID_ID, LANES, PRIM_ID, Packet, SceneHandle, intersect16
from renderer.core.kernel import entry
from renderer.ground_truth.hit_view import HitLayers, HitView

RAYS_PER_SIDE = 4
_PLACES = (np.arange(RAYS_PER_SIDE, dtype=np.float32) + np.float32(0.5)) / np.float32(RAYS_PER_SIDE) - np.float32(0.5)
OFFSETS = np.stack([np.repeat([u, v], LANES) for v in _PLACES for u in _PLACES]).astype(np.float32)
"""(16, 32): offsets of the rays within a pixel, as ``aim_tile`` takes them, one after the other for all pixels of a tile."""

_LANE = np.arange(LANES)
WITHIN_PIXEL = np.concatenate([OFFSETS[:, 0] - (_LANE & 3), OFFSETS[:, LANES] - (_LANE >> 2)]).astype(np.float32)
"""(32,): the same for one packet whose rays all go through the first pixel of its tile."""


def coverage(view: HitView) -> NDArray[np.float32]:
    """Return the share of 4 x 4 rays through a pixel that hit the object which its middle hits, (height, width).

    Pixels whose eight neighbours see the same object count as covered without further rays.
    """
    instance = view.images.instance
    height, width = instance.shape
    padded = np.pad(instance, 1, mode="edge")
    edge = np.zeros(instance.shape, np.bool_)
    for dy in range(3):
        for dx in range(3):
            edge |= padded[dy : dy + height, dx : dx + width] != instance
    image = np.ones(instance.shape, np.float32)
    flat, view_scene = view.scene.flat, view.scene
    tables = (view_scene.tree, flat.face_part, flat.parts.object_id, view.camera)
    if view.config.is_plain and not len(view.camera.motion):
        view_scene.in_tiles(_count_in_pixels, *tables, np.flatnonzero(edge), instance, WITHIN_PIXEL, image)
    else:
        view_scene.in_tiles(_count_in_tiles, *tables, edge, instance, OFFSETS, image)
    return image


@entry
def _count_in_pixels(
    packet: Packet,
    scene: SceneHandle,
    face_part: NDArray[np.int32],
    object_id: NDArray[np.uint16],
    camera: PosedCamera,
    edge: NDArray[np.int64],
    instance: NDArray[np.uint16],
    offsets: NDArray[np.float32],
    image: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Trace a packet through each of the pixels ``edge``, given by their place in the image: ideal pinholes at rest."""
    share = np.float32(1.0 / LANES)
    for at in range(first, len(edge), step):
        y, x = edge[at] // camera.width, edge[at] % camera.width
        aim_tile(camera, x, y, offsets, packet)
        intersect16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.coherent)
        count = 0
        for k in range(LANES):
            hit = packet.integer[GEOM_ID + k] != INVALID_ID
            seen = object_id[face_part[packet.integer[PRIM_ID + k]]] if hit else np.uint16(0)
            count += 1 if seen == instance[y, x] else 0
        image[y, x] = share * np.float32(count)


@entry
def _count_in_tiles(
    packet: Packet,
    scene: SceneHandle,
    face_part: NDArray[np.int32],
    object_id: NDArray[np.uint16],
    camera: PosedCamera,
    edge: NDArray[np.bool_],
    instance: NDArray[np.uint16],
    offsets: NDArray[np.float32],
    image: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Trace the tiles with pixels at an ``edge``, rows ``first``, ``first + step``, ...: every lens and shutter."""
    share = np.float32(1.0 / len(offsets))
    for row in range(first * TILE, camera.height, step * TILE):
        for column in range(0, camera.width, TILE):
            bottom, right = min(row + TILE, camera.height), min(column + TILE, camera.width)
            if not edge[row:bottom, column:right].any():
                continue
            image[row:bottom, column:right] = np.float32(0.0)
            for s in range(len(offsets)):
                aim_tile(camera, column, row, offsets[s], packet)
                if camera.row_step > np.float32(0.0):
                    move_rays(camera, row, MIDDLE, packet)
                intersect16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.coherent)
                for k in range(LANES):
                    y, x = row + (k >> 2), column + (k & 3)
                    if y >= bottom or x >= right:
                        continue
                    hit = packet.integer[GEOM_ID + k] != INVALID_ID
                    seen = object_id[face_part[packet.integer[PRIM_ID + k]]] if hit else np.uint16(0)
                    image[y, x] += share if seen == instance[y, x] else np.float32(0.0)
            for y in range(row, bottom):
                for x in range(column, right):
                    if not edge[y, x]:
                        image[y, x] = np.float32(1.0)


LAYERS: HitLayers = {
    "coverage": coverage,
}
