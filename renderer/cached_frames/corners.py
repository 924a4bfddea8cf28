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
from renderer.core.sampling import Vector, dot
from renderer.path.ground_truth import TracedView
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
BEND, NEAR = np.float32(0.95), np.float32(0.03)
"""Cosine between normals from which on two triangles are one surface, if their distances differ by no more than this share."""
BEHIND = np.float32(0.2**2)
"""Squared sine of the angle between a surface and the way to another point, from which on that may lie behind it."""
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
                packet.real[ray.TNEAR + k], packet.real[ray.TFAR + k] = _ZERO, np.inf
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
    for corner in range(4):
        if is_one_surface(surfaces, view, x + (corner & 1), y + (corner >> 1), k, packet):
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
def is_one_surface(surfaces: Surfaces, view: TracedView, x: int, y: int, k: int, packet: Packet) -> bool:
    """Return whether pixel (x, y) sees the part that ray k has hit, facing the same way, and as far off or about in the same plane."""
    face, there, real = packet.integer[ray.PRIM_ID + k], view.hits.face[y, x], packet.real
    if there < 0 or surfaces.face_part[there] != surfaces.face_part[face] or aligned(surfaces, there, int(face)) < BEND:
        return False
    far = hit_distance(packet, k)
    if abs(view.distance[y, x] - far) <= NEAR * far:
        return True
    t = real[ray.TFAR + k]
    hit_x, hit_y = real[ray.ORG_X + k] + t * real[ray.DIR_X + k], real[ray.ORG_Y + k] + t * real[ray.DIR_Y + k]
    hit = hit_x, hit_y, real[ray.ORG_Z + k] + t * real[ray.DIR_Z + k]
    point, normal = seen_point(surfaces, view, x, y)
    squared, height = height_over(point, normal, hit)
    return bool(height * height <= BEHIND * squared)


@inlined
def height_over(point: Vector, normal: Vector, other: Vector) -> tuple[np.float32, np.float32]:
    """Return the squared way from a point of a surface to another, m2, and how far that goes along the normal there, metres."""
    way = other[0] - point[0], other[1] - point[1], other[2] - point[2]
    return dot(way, way), dot(way, normal)


@inlined
def seen_point(surfaces: Surfaces, view: TracedView, x: int, y: int) -> tuple[Vector, Vector]:
    """Return the point of a triangle that a pixel sees, and the normal there, not of unit length."""
    face, u, v = view.hits.face[y, x], view.hits.u[y, x], view.hits.v[y, x]
    w = _ONE - u - v
    a, b, c = view.faces[face, 0], view.faces[face, 1], view.faces[face, 2]
    vertices, normals, n = view.vertices, surfaces.normals, 9 * np.int64(face)
    point = (
        w * vertices[a, 0] + u * vertices[b, 0] + v * vertices[c, 0],
        w * vertices[a, 1] + u * vertices[b, 1] + v * vertices[c, 1],
        w * vertices[a, 2] + u * vertices[b, 2] + v * vertices[c, 2],
    )
    return point, (
        w * normals[n] + u * normals[n + 3] + v * normals[n + 6],
        w * normals[n + 1] + u * normals[n + 4] + v * normals[n + 7],
        w * normals[n + 2] + u * normals[n + 5] + v * normals[n + 8],
    )
