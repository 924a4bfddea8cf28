"""From shaded hits to a picture: mirrored light is mixed among neighbours of rough surfaces, and edges are smoothed.

Neither mixes what lies on different surfaces: neighbours count where they see the same part, facing the same way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import embree as ray
from renderer.core.embree import INVALID_ID, LANES, Packet, SceneHandle, intersect16
from renderer.core.kernel import entry, inlined
from renderer.irradiance_cache.records import APART, ROUGH, ShadeScratch
from renderer.path.ground_truth import Hits, TracedView
from renderer.path.records import LitScene
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE, _QUARTER = np.float32(0.0), np.float32(1.0), np.float32(0.25)
_AIMED = (ray.ORG_X, ray.ORG_Y, ray.ORG_Z, ray.DIR_X, ray.DIR_Y, ray.DIR_Z)
_MIRROR = np.float32(1e-3)
_SAME_WAY = np.float32(0.9)
_NEAR = np.float32(0.03)
_BEND = np.float32(0.95)
_CONTRAST = np.float32(0.03)
OFFSETS = np.zeros((3, 2 * LANES), np.float32)
"""Where edge pixels are sampled beside their centre: a rotated grid, as offsets of tiles' rays, in pixels."""
OFFSETS[:, :LANES] = np.array([-0.375, 0.125, 0.375])[:, None]
OFFSETS[:, LANES:] = np.array([0.125, 0.375, -0.125])[:, None]


class Picture(NamedTuple):
    """What shading leaves, float32.

    light: (height, width, 3), cd/m2, without what is mirrored.  mirrored: (height, width, 4), the luminance that the mirrored ray found,
    and the width of GGX: 0 where nothing is mirrored by a ray, negative where neighbours' rays serve and the luminance is a guess, and more
    by APART where every pixel of the surface sends a ray.
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


@inlined
def _is_alike(surfaces: Surfaces, face: int, other: int) -> bool:
    """Return whether two triangles are of one part and face about the same way."""
    if face == other:
        return True
    if face < 0 or other < 0 or surfaces.face_part[face] != surfaces.face_part[other]:
        return False
    return bool(_aligned(surfaces, face, other) >= _SAME_WAY)


@inlined
def _sum_around(
    surfaces: Surfaces, hits: Hits, mirrored: NDArray[np.float32], x: int, y: int, face: int, stride: int
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return the sum, and number, of what 5 x 5 pixels around (6 x 6 for steps of one) see mirrored by surfaces like a triangle."""
    height, width = hits.face.shape
    r = g = b = count = _ZERO
    begin = -3 if stride == 1 else -2
    for i in range(begin, 3):
        for j in range(begin, 3):
            v, u = y + stride * i, x + stride * j
            if v < 0 or u < 0 or v >= height or u >= width or mirrored[v, u, 3] <= _MIRROR:
                continue
            if _is_alike(surfaces, face, hits.face[v, u]):
                r, g, b = r + mirrored[v, u, 0], g + mirrored[v, u, 1], b + mirrored[v, u, 2]
                count += _ONE
    return r, g, b, count


@entry
def mix_mirrored(surfaces: Surfaces, hits: Hits, picture: Picture, image: NDArray[np.float32], first: int, step: int) -> None:
    """Fill pairs of rows ``first``, ``first + step``, ... of ``image`` (height, width, 3) with all light of a picture.

    The rougher the surface, the farther neighbours it shares mirrored light with: each has one sample of the lobe.  Where it is rough,
    blocks of 2 x 2 pixels share one mean, over pixels of even columns and rows; but each pixel of metal has a mean of its own, so that
    brushed steel shows no blocks.
    """
    height, width, _ = image.shape
    mirrored, share, face = picture.mirrored, picture.share, hits.face
    for top in range(2 * first, height, 2 * step):
        for left in range(0, width, 2):
            block = -1
            block_r = block_g = block_b = block_count = _ZERO
            for corner in range(4):
                y, x = top + (corner >> 1), left + (corner & 1)
                if y >= height or x >= width:
                    continue
                alpha = mirrored[y, x, 3]
                if alpha == _ZERO:
                    image[y, x, 0], image[y, x, 1], image[y, x, 2] = picture.light[y, x, 0], picture.light[y, x, 1], picture.light[y, x, 2]
                    continue
                r, g, b, count = mirrored[y, x, 0], mirrored[y, x, 1], mirrored[y, x, 2], _ONE
                dense = alpha >= APART
                alpha = alpha - APART if dense else alpha
                # Rough: the block's mean, but its own ray's too for a pixel that sent one and is not part of that.
                if abs(alpha) >= ROUGH and not dense:
                    if block < 0 or not _is_alike(surfaces, face[y, x], block):
                        block = face[y, x]
                        block_r, block_g, block_b, block_count = _sum_around(surfaces, hits, mirrored, left, top, block, 2)
                    if block_count > _ZERO and (alpha < _ZERO or corner == 0):
                        r, g, b, count = block_r, block_g, block_b, block_count
                    else:
                        r, g, b, count = r + block_r, g + block_g, b + block_b, _ONE + block_count
                elif abs(alpha) > _MIRROR:
                    around_r, around_g, around_b, around_count = _sum_around(surfaces, hits, mirrored, x, y, face[y, x], 1)
                    if around_count > _ZERO:
                        r, g, b, count = around_r, around_g, around_b, around_count
                scale = _ONE / count
                image[y, x, 0] = picture.light[y, x, 0] + share[y, x, 0] * r * scale
                image[y, x, 1] = picture.light[y, x, 1] + share[y, x, 1] * g * scale
                image[y, x, 2] = picture.light[y, x, 2] + share[y, x, 2] * b * scale


@inlined
def _differ(image: NDArray[np.float32], x: int, y: int, u: int, v: int) -> bool:
    """Return whether two pixels differ by more than the eye can tell."""
    for channel in range(3):
        here, there = image[y, x, channel], image[v, u, channel]
        if abs(here - there) > _CONTRAST * max(here, there):
            return True
    return False


@inlined
def _is_edge(surfaces: Surfaces, hits: Hits, distance: NDArray[np.float32], image: NDArray[np.float32], x: int, y: int) -> bool:
    """Return whether one of the pixels beside, above or below sees another part, or the same bent or farther away, in other light."""
    height, width = distance.shape
    here = hits.face[y, x]
    for side in range(4):
        u, v = x + (side == 0) - (side == 1), y + (side == 2) - (side == 3)
        if u < 0 or v < 0 or u >= width or v >= height:
            continue
        there = hits.face[v, u]
        if here == there or not _differ(image, x, y, u, v):
            continue
        if here < 0 or there < 0 or surfaces.face_part[here] != surfaces.face_part[there]:
            return True
        if _aligned(surfaces, here, there) < _BEND or abs(distance[v, u] - distance[y, x]) > _NEAR * distance[y, x]:
            return True
    return False


@entry
def smooth_edges(
    scene: LitScene,
    view: TracedView,
    offsets: NDArray[np.float32],
    memory: ShadeScratch,
    image: NDArray[np.float32],
    smooth: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Fill rows of tiles ``first``, ``first + step``, ... of ``smooth`` with ``image``, edges by three more rays a pixel.

    These are not shaded: each takes the light of the pixel nearby that sees the same surface.
    """
    height, width, _ = image.shape
    packet, queue = memory.trace.rays, memory.edges
    for row in range(first * TILE, height, step * TILE):
        for column in range(0, width, TILE):
            edges = _copy_tile(scene.surfaces, view, column, row, image, smooth)
            if edges == 0:
                continue
            queued = _aim_edges(view.camera, column, row, edges, offsets, packet, queue)
            for k in range(LANES):
                if edges >> k & 1:
                    for channel in range(3):
                        smooth[row + k // TILE, column + k % TILE, channel] *= _QUARTER
            for begin in range(0, queued, LANES):
                count = min(LANES, queued - begin)
                _trace_edges(scene.tree, begin, count, packet, queue)
                for k in range(count):
                    pixel = int(queue[6, begin + k])
                    y, x = row + pixel // TILE, column + pixel % TILE
                    u, v = _alike(scene.surfaces, view, x, y, k, packet)
                    for channel in range(3):
                        smooth[y, x, channel] += _QUARTER * image[v, u, channel]


@inlined
def _copy_tile(surfaces: Surfaces, view: TracedView, column: int, row: int, image: NDArray[np.float32], smooth: NDArray[np.float32]) -> int:
    """Copy a tile's pixels; return which are edges, a bit each."""
    height, width, _ = image.shape
    edges = 0
    for y in range(row, min(row + TILE, height)):
        for x in range(column, min(column + TILE, width)):
            for channel in range(3):
                smooth[y, x, channel] = image[y, x, channel]
            if _is_edge(surfaces, view.hits, view.distance, image, x, y):
                edges |= 1 << ((y - row) * TILE + x - column)
    return edges


@inlined
def _trace_edges(tree: SceneHandle, begin: int, count: int, packet: Packet, queue: NDArray[np.float32]) -> None:
    """Trace ``count`` rays of the queue, from ``begin`` on."""
    real, integer, alive = packet.real, packet.integer, packet.alive
    for k in range(LANES):
        alive[k] = -1 if k < count else 0
        for field in range(6):
            real[_AIMED[field] + k] = queue[field, begin + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, np.inf
        integer[ray.GEOM_ID + k] = INVALID_ID
    intersect16(alive.ctypes.data, tree.address, real.ctypes.data, tree.coherent)


@inlined
def _aim_edges(
    camera: PosedCamera, column: int, row: int, edges: int, offsets: NDArray[np.float32], packet: Packet, queue: NDArray[np.float32]
) -> int:
    """Fill ``queue`` (7, 48) with origin and direction of the rays of a tile's edge pixels, and the pixel; return how many there are."""
    queued = 0
    for sample in range(len(offsets)):
        aim_exposed_tile(camera, column, row, offsets[sample], packet)
        for k in range(LANES):
            if edges >> k & 1 and packet.alive[k] != 0:
                for field in range(6):
                    queue[field, queued] = packet.real[_AIMED[field] + k]
                queue[6, queued] = np.float32(k)
                queued += 1
    return queued


@inlined
def _alike(surfaces: Surfaces, view: TracedView, x: int, y: int, k: int, packet: Packet) -> tuple[int, int]:
    """Return the pixel (column, row) among (x, y) and its eight neighbours that sees the surface that ray k has hit."""
    hits, distance, real = view.hits, view.distance, packet.real
    face = int(packet.integer[ray.PRIM_ID + k]) if packet.integer[ray.GEOM_ID + k] != INVALID_ID else -1
    if hits.face[y, x] == face:
        return x, y
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    far = real[ray.TFAR + k] * np.sqrt(dx * dx + dy * dy + dz * dz)
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
