"""From shaded hits to a picture: mirrored light is mixed among neighbours that see the same part of something, facing the same way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, inlined
from renderer.irradiance_cache.records import APART, ROUGH
from renderer.path.ground_truth import Hits
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_MIRROR = np.float32(1e-3)
_SAME_WAY = np.float32(0.9)


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
def aligned(surfaces: Surfaces, face: int, other: int) -> np.float32:
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
    return bool(aligned(surfaces, face, other) >= _SAME_WAY)


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
