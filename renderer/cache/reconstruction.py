"""From shaded hits to a picture: mirrored light is mixed among neighbours of rough surfaces, and edges are smoothed.

Neither mixes what lies on different surfaces: neighbours count where they see the same part, facing the same way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cache.records import ROUGH
from renderer.camera.camera_rays import TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import embree as ray
from renderer.core.embree import INVALID_ID, LANES, Packet, SceneHandle, intersect16
from renderer.core.kernel import entry, inlined
from renderer.path.ground_truth import Hits
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE, _QUARTER = np.float32(0.0), np.float32(1.0), np.float32(0.25)
_MIRROR = np.float32(1e-3)
_SAME_WAY = np.float32(0.98)
_GUESS = np.float32(1e-3)
_NEAR = np.float32(0.03)
_BEND = np.float32(0.95)
OFFSETS = np.zeros((3, 2 * LANES), np.float32)
"""Where edge pixels are sampled beside their centre: a rotated grid, as offsets of tiles' rays, in pixels."""
OFFSETS[:, :LANES] = np.array([-0.375, 0.125, 0.375])[:, None]
OFFSETS[:, LANES:] = np.array([0.125, 0.375, -0.125])[:, None]


class Picture(NamedTuple):
    """What shading leaves, float32.

    light: (height, width, 3), cd/m2, without what is mirrored.  mirrored: (height, width, 4), the luminance that the mirrored ray found,
    and the width of GGX: 0 where nothing is mirrored by a ray, negative where neighbours' rays serve and the luminance is a guess.
    share: (height, width, 3), how much of it leaves to the camera.
    """

    light: NDArray[np.float32]
    mirrored: NDArray[np.float32]
    share: NDArray[np.float32]


def make_picture(height: int, width: int) -> Picture:
    """Return room for a picture."""
    return Picture(*(np.empty((height, width, channels), np.float32) for channels in (3, 4, 3)))


@inlined
def _aligned(surfaces: Surfaces, face: int, other: int) -> np.float32:
    """Return the cosine between the normals of two triangles' first corners."""
    normals, a, b = surfaces.normals, 9 * np.int64(face), 9 * np.int64(other)
    cosine: np.float32 = normals[a] * normals[b] + normals[a + 1] * normals[b + 1] + normals[a + 2] * normals[b + 2]
    return cosine


@entry
def mix_mirrored(surfaces: Surfaces, hits: Hits, picture: Picture, image: NDArray[np.float32], first: int, step: int) -> None:
    """Fill rows ``first``, ``first + step``, ... of ``image`` (height, width, 3) with all light of a picture.

    The rougher the surface, the farther neighbours it shares mirrored light with: each has one sample of the lobe.
    """
    height, width, _ = image.shape
    mirrored, share, face = picture.mirrored, picture.share, hits.face
    for y in range(first, height, step):
        for x in range(width):
            alpha = mirrored[y, x, 3]
            r, g, b = mirrored[y, x, 0], mirrored[y, x, 1], mirrored[y, x, 2]
            if alpha > _MIRROR or alpha < _ZERO:
                stride = 1 if abs(alpha) < ROUGH else 2
                here, count = face[y, x], _ONE if alpha > _ZERO else _GUESS
                r, g, b = count * r, count * g, count * b
                part = surfaces.face_part[here]
                for i in range(-2, 3):
                    for j in range(-2, 3):
                        # Steps of two begin where columns and rows are even, as such pixels send rays on rough surfaces.
                        v, u = y - (y & (stride - 1)) + stride * i, x - (x & (stride - 1)) + stride * j
                        if (u == x and v == y) or v < 0 or u < 0 or v >= height or u >= width or mirrored[v, u, 3] <= _MIRROR:
                            continue
                        there = face[v, u]
                        if there != here and (surfaces.face_part[there] != part or _aligned(surfaces, here, there) < _SAME_WAY):
                            continue
                        r, g, b = r + mirrored[v, u, 0], g + mirrored[v, u, 1], b + mirrored[v, u, 2]
                        count += _ONE
                scale = _ONE / count
                r, g, b = r * scale, g * scale, b * scale
            if alpha != _ZERO:
                image[y, x, 0] = picture.light[y, x, 0] + share[y, x, 0] * r
                image[y, x, 1] = picture.light[y, x, 1] + share[y, x, 1] * g
                image[y, x, 2] = picture.light[y, x, 2] + share[y, x, 2] * b
            else:
                image[y, x, 0], image[y, x, 1], image[y, x, 2] = picture.light[y, x, 0], picture.light[y, x, 1], picture.light[y, x, 2]


@inlined
def _is_edge(surfaces: Surfaces, hits: Hits, distance: NDArray[np.float32], x: int, y: int) -> bool:
    """Return whether one of the pixels beside, above or below sees another part, or the same one bent or farther away."""
    height, width = distance.shape
    here = hits.face[y, x]
    for side in range(4):
        u, v = x + (side == 0) - (side == 1), y + (side == 2) - (side == 3)
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        there = hits.face[v, u]
        if here == there:
            continue
        if here < 0 or there < 0 or surfaces.face_part[here] != surfaces.face_part[there]:
            return True
        if _aligned(surfaces, here, there) < _BEND or abs(distance[v, u] - distance[y, x]) > _NEAR * distance[y, x]:
            return True
    return False


@entry
def smooth_edges(
    scene: SceneHandle,
    surfaces: Surfaces,
    camera: PosedCamera,
    distance: NDArray[np.float32],
    hits: Hits,
    offsets: NDArray[np.float32],
    packet: Packet,
    image: NDArray[np.float32],
    smooth: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Fill rows of tiles ``first``, ``first + step``, ... of ``smooth`` with ``image``, edges by three more rays a pixel.

    These are not shaded: each takes the light of the pixel nearby that sees the same surface.
    """
    height, width, _ = image.shape
    real, integer, alive = packet.real, packet.integer, packet.alive
    for row in range(first * TILE, height, step * TILE):
        for column in range(0, width, TILE):
            edges = 0
            for y in range(row, min(row + TILE, height)):
                for x in range(column, min(column + TILE, width)):
                    for channel in range(3):
                        smooth[y, x, channel] = image[y, x, channel]
                    if _is_edge(surfaces, hits, distance, x, y):
                        edges |= 1 << ((y - row) * TILE + x - column)
            if edges == 0:
                continue
            for k in range(LANES):
                if edges >> k & 1:
                    for channel in range(3):
                        smooth[row + k // TILE, column + k % TILE, channel] *= _QUARTER
            for sample in range(len(offsets)):
                aim_exposed_tile(camera, column, row, offsets[sample], packet)
                for k in range(LANES):
                    alive[k] = alive[k] if edges >> k & 1 else 0
                intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.coherent)
                for k in range(LANES):
                    if edges >> k & 1:
                        y, x = row + k // TILE, column + k % TILE
                        face = int(integer[ray.PRIM_ID + k]) if integer[ray.GEOM_ID + k] != INVALID_ID else -1
                        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
                        far = real[ray.TFAR + k] * np.sqrt(dx * dx + dy * dy + dz * dz)
                        u, v = _alike(surfaces, hits, distance, x, y, face, far)
                        for channel in range(3):
                            smooth[y, x, channel] += _QUARTER * image[v, u, channel]


@inlined
def _alike(surfaces: Surfaces, hits: Hits, distance: NDArray[np.float32], x: int, y: int, face: int, far: np.float32) -> tuple[int, int]:
    """Return the pixel (column, row) among (x, y) and its eight neighbours that sees the surface of a triangle at a distance."""
    height, width = distance.shape
    best, column, row = np.float32(np.inf), x, y
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            there = hits.face[v, u]
            apart = np.float32((u - x) * (u - x) + (v - y) * (v - y))
            if there == face:
                value = apart
            elif face < 0 or there < 0 or surfaces.face_part[there] != surfaces.face_part[face]:
                continue
            else:
                value = np.float32(4.0) + apart + np.float32(100.0) * abs(distance[v, u] - far) / far
                value += np.float32(8.0) * (_ONE - _aligned(surfaces, there, face))
            if value < best:
                best, column, row = value, u, v
    return column, row
