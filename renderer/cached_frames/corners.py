"""What lies between the middles of pixels: rays through corners that four of them share find what all four miss, such as wires.

Every second corner, as on a chessboard, is enough: each row and column of pixels has some on both sides.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames.reconstruction import aligned
from renderer.cached_frames.records import CachedView, ShadeScratch
from renderer.camera.camera_rays import TILE
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import ray_packet as ray
from renderer.core.embree import intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.path.ground_truth import TracedView
from renderer.path.surface_tables import Surfaces

BEND, NEAR = np.float32(0.95), np.float32(0.03)
"""Cosine between normals from which on two triangles are one surface, if their distances differ by no more than this share."""
_COLUMNS, _ROWS = np.arange(LANES) % TILE, np.arange(LANES) // TILE
_CORNER_X = 2 * _COLUMNS + _ROWS % 2
_CORNERS = np.concatenate([_CORNER_X - _COLUMNS, np.zeros(LANES)]).astype(np.float32) + np.float32(0.5)
"""Offsets of a tile's rays, in pixels, to every second lower right corner of the pixels of two tiles."""


@entry
def look_between(shown: CachedView, memory: ShadeScratch, missed: NDArray[np.bool_], first: int, step: int) -> None:
    """Fill rows of tiles ``first``, ``first + step``, ... of ``missed`` (height, width).

    It tells at which pixels' lower right corners a ray meets a surface that none of the four pixels around sees; it is False at first.
    """
    view, packet = shown.traced, memory.trace.rays
    height, width = missed.shape
    for row in range(first * TILE, height, step * TILE):
        for column in range(0, width, 2 * TILE):
            aim_exposed_tile(view.camera, column, row, _CORNERS, packet)
            for k in range(LANES):
                packet.real[ray.TNEAR + k], packet.real[ray.TFAR + k] = np.float32(0.0), np.inf
                packet.integer[ray.GEOM_ID + k] = INVALID_ID
            intersect16(packet.alive.ctypes.data, shown.scene.tree.address, packet.real.ctypes.data, shown.scene.tree.coherent)
            for k in range(LANES):
                x, y = column + _CORNER_X[k], row + _ROWS[k]
                if x + 1 < width and y + 1 < height:
                    missed[y, x] = not _is_seen(shown.scene.surfaces, view, x, y, k, packet)


@inlined
def _is_seen(surfaces: Surfaces, view: TracedView, x: int, y: int, k: int, packet: Packet) -> bool:
    """Return whether one of the pixels (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1) sees the surface that ray k has hit."""
    hits = view.hits
    face = int(packet.integer[ray.PRIM_ID + k]) if packet.integer[ray.GEOM_ID + k] != INVALID_ID else -1
    for corner in range(4):
        if hits.face[y + (corner >> 1), x + (corner & 1)] == face:
            return True
    if face < 0:
        return False
    far = hit_distance(packet, k)
    for corner in range(4):
        if is_one_surface(surfaces, view, x + (corner & 1), y + (corner >> 1), face, far):
            return True
    return False


@inlined
def hit_distance(packet: Packet, k: int) -> np.float32:
    """Return how far away ray k has hit, metres."""
    real = packet.real
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    far: np.float32 = real[ray.TFAR + k] * np.sqrt(dx * dx + dy * dy + dz * dz)
    return far


@inlined
def is_one_surface(surfaces: Surfaces, view: TracedView, x: int, y: int, face: int, far: np.float32) -> bool:
    """Return whether pixel (x, y) sees the part of a triangle, which is ``far`` away, as far off and facing the same way."""
    there = view.hits.face[y, x]
    if there < 0 or surfaces.face_part[there] != surfaces.face_part[face]:
        return False
    return bool((aligned(surfaces, there, face) >= BEND) & (abs(view.distance[y, x] - far) <= NEAR * far))
