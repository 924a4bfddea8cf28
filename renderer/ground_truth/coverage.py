"""How much of a pixel its object covers."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import TILE, aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.ground_truth.hit_view import HitLayers, HitView

_ZERO, _ONE, _SHARE = np.float32(0.0), np.float32(1.0), np.float32(1.0 / 16.0)
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
    instance, scene = view.images.instance, view.scene
    image = np.empty(instance.shape, np.float32)
    count, offsets = (
        (_count_in_pixels, WITHIN_PIXEL) if view.config.is_plain and not len(view.camera.motion) else (_count_in_tiles, OFFSETS)
    )
    objects = _SeenObjects(scene.tree, scene.flat.face_part, scene.flat.parts.object_id, view.camera, instance)
    scene.in_tiles(count, objects, offsets, image)
    return image


class _SeenObjects(NamedTuple):
    """A view, and the objects in it: part of each triangle (m,), object of each part (p,), and the layer ``instance``."""

    tree: SceneHandle
    face_part: NDArray[np.int32]
    object_id: NDArray[np.uint16]
    camera: PosedCamera
    instance: NDArray[np.uint16]


@entry
def _count_in_pixels(
    rays: Packet,
    ids: NDArray[np.float32],
    view: _SeenObjects,
    offsets: NDArray[np.float32],
    image: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Trace a packet through each pixel at an edge of rows ``first``, ``first + step``, ...: ideal pinholes at rest."""
    camera, instance = view.camera, view.instance
    for y in range(first, camera.height, step):
        _mark_edges(instance, y, image[y])
        for x in range(camera.width):
            if image[y, x] < _ZERO:
                aim_tile(camera, x, y, offsets, rays)
                _see_ids(view, rays, ids)
                count = 0
                for k in range(LANES):
                    count += 1 if ids[k] == np.float32(instance[y, x]) else 0
                image[y, x] = _SHARE * np.float32(count)


@entry
def _count_in_tiles(
    rays: Packet,
    ids: NDArray[np.float32],
    view: _SeenObjects,
    offsets: NDArray[np.float32],
    image: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Trace the tiles with pixels at an edge, rows ``first``, ``first + step``, ...: every lens and shutter."""
    camera, instance = view.camera, view.instance
    for row in range(first * TILE, camera.height, step * TILE):
        for y in range(row, min(row + TILE, camera.height)):
            _mark_edges(instance, y, image[y])
        for column in range(0, camera.width, TILE):
            edges = 0
            for y in range(row, min(row + TILE, camera.height)):
                for x in range(column, min(column + TILE, camera.width)):
                    if image[y, x] < _ZERO:
                        image[y, x] = _ZERO
                        edges |= 1 << ((y - row) * TILE + x - column)
            for s in range(len(offsets) if edges else 0):
                aim_exposed_tile(camera, column, row, offsets[s], rays)
                _see_ids(view, rays, ids)
                for k in range(LANES):
                    y, x = row + (k >> 2), column + (k & 3)
                    if (edges >> k) & 1 and ids[k] == np.float32(instance[y, x]):
                        image[y, x] += _SHARE


@kernel
def _mark_edges(instance: NDArray[np.uint16], y: int, marks: NDArray[np.float32]) -> None:
    """Write -1 where one of the eight neighbours of a pixel of row ``y`` sees another object, else 1."""
    width = len(marks)
    above, here, below = instance[max(y - 1, 0)], instance[y], instance[min(y + 1, len(instance) - 1)]
    for x in range(width):
        marks[x] = -_ONE if (above[x] != here[x]) | (below[x] != here[x]) else _ONE
    for x in range(1, width):
        differs = (above[x - 1] != here[x]) | (here[x - 1] != here[x]) | (below[x - 1] != here[x])
        marks[x] = -_ONE if differs else marks[x]
    for x in range(width - 1):
        differs = (above[x + 1] != here[x]) | (here[x + 1] != here[x]) | (below[x + 1] != here[x])
        marks[x] = -_ONE if differs else marks[x]


@kernel
def _see_ids(view: _SeenObjects, rays: Packet, ids: NDArray[np.float32]) -> None:
    """Trace a packet and write the ids of the objects that it hits, 0 for none, to the first 16 numbers of ``ids``."""
    intersect16(rays.alive.ctypes.data, view.tree.address, rays.real.ctypes.data, view.tree.coherent)
    for k in range(LANES):
        hit = rays.integer[ray.GEOM_ID + k] != INVALID_ID
        ids[k] = np.float32(view.object_id[view.face_part[rays.integer[ray.PRIM_ID + k]]]) if hit else _ZERO


LAYERS: HitLayers = {"coverage": coverage}
