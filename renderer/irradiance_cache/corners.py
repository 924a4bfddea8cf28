"""What lies between the middles of pixels: rays through the corners that four of them share find what all four miss, such as wires."""

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import TILE
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import ray_packet as ray
from renderer.core.embree import intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.irradiance_cache.reconstruction import aligned
from renderer.irradiance_cache.records import CachedView, ShadeScratch
from renderer.path.ground_truth import TracedView
from renderer.path.surface_tables import Surfaces

BEND, NEAR = np.float32(0.95), np.float32(0.03)
"""Cosine between normals from which on two triangles are one surface, if their distances differ by no more than this share."""
_LOWER_RIGHT = np.full(2 * LANES, 0.5, np.float32)


@entry
def look_between(shown: CachedView, memory: ShadeScratch, missed: NDArray[np.bool_], first: int, step: int) -> None:
    """Fill rows of tiles ``first``, ``first + step``, ... of ``missed`` (height, width).

    It tells at which pixels' lower right corners a ray meets a surface that none of the four pixels around sees.
    """
    view, packet = shown.traced, memory.trace.rays
    height, width = missed.shape
    for row in range(first * TILE, height, step * TILE):
        for column in range(0, width, TILE):
            aim_exposed_tile(view.camera, column, row, _LOWER_RIGHT, packet)
            for k in range(LANES):
                packet.real[ray.TNEAR + k], packet.real[ray.TFAR + k] = np.float32(0.0), np.inf
                packet.integer[ray.GEOM_ID + k] = INVALID_ID
            intersect16(packet.alive.ctypes.data, shown.scene.tree.address, packet.real.ctypes.data, shown.scene.tree.coherent)
            for k in range(LANES):
                x, y = column + k % TILE, row + k // TILE
                if x < width and y < height:
                    missed[y, x] = x + 1 < width and y + 1 < height and not _is_seen(shown.scene.surfaces, view, x, y, k, packet)


@inlined
def _is_seen(surfaces: Surfaces, view: TracedView, x: int, y: int, k: int, packet: Packet) -> bool:
    """Return whether one of the pixels (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) sees the surface that ray k has hit."""
    hits, distance, real = view.hits, view.distance, packet.real
    face = int(packet.integer[ray.PRIM_ID + k]) if packet.integer[ray.GEOM_ID + k] != INVALID_ID else -1
    for corner in range(4):
        if hits.face[y + (corner >> 1), x + (corner & 1)] == face:
            return True
    if face < 0:
        return False
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    far = real[ray.TFAR + k] * np.sqrt(dx * dx + dy * dy + dz * dz)
    for corner in range(4):
        v, u = y + (corner >> 1), x + (corner & 1)
        there = hits.face[v, u]
        if there >= 0 and surfaces.face_part[there] == surfaces.face_part[face]:
            if aligned(surfaces, there, face) >= BEND and abs(distance[v, u] - far) <= NEAR * far:
                return True
    return False
