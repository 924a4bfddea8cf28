"""From shaded hits to a picture: what gloss shows is mixed among neighbours that see the same part of something, facing the same way.

Neighbours sample their lobes, and points of lamps, by different numbers of one sequence, all of them within a tile of 4 x 4 pixels or,
where the surface is rough, 8 x 8.  Weights fall off as a tent twice as wide as that: as it is a box of a tile's width mixed by the same
box, no pattern of tiles remains of it (Keller and Heidrich, "Interleaved Sampling", 2001), and it is separable: rows are summed up, then
columns.

How much a pixel shows of lamps where nothing hides them is known in closed form; mixed is what of that is seen, a ratio of sums (Heitz,
Hill and McGuire, "Combining Analytic Direct Illumination and Stochastic Shadows", 2018), so that its outlines stay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, inlined
from renderer.irradiance_cache.records import ROUGH, SHARP
from renderer.path.ground_truth import Hits
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_MIRROR = np.float32(1e-3)
_SAME_WAY = np.float32(0.9)
_NEAR, _FAR = 3, 7
"""How many pixels away the farthest are that are mixed: a tile's width less one."""


class Picture(NamedTuple):
    """What shading leaves, float32.

    light: (height, width, 3), cd/m2, without what gloss shows.  mirrored: (height, width, 4), the luminance that the mirrored ray found,
    and the width of GGX: 0 where nothing is mirrored by a ray, negative where neighbours' rays serve and the luminance is a guess.
    share: (height, width, 3), how much of it leaves to the camera.  lamps: (height, width, 4), cd/m2, what gloss shows of lamps and panes
    as far as shadow rays reached them, and r + g + b of what it would show if nothing hid them.  sums: (height, width, 8), of those of a
    row that are mixed, by weight: what rays found, their weight, and lamps.
    """

    light: NDArray[np.float32]
    mirrored: NDArray[np.float32]
    share: NDArray[np.float32]
    lamps: NDArray[np.float32]
    sums: NDArray[np.float32]


def make_picture(height: int, width: int) -> Picture:
    """Return room for a picture."""
    return Picture(*(np.empty((height, width, channels), np.float32) for channels in (3, 4, 3, 4, 8)))


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
def _reach(alpha: np.float32, shown: np.float32) -> tuple[int, int]:
    """Return how far mirrored light and lamps are mixed, pixels; 0 for none.  Under a coat that is smooth lamps show in a rough lobe."""
    width = abs(alpha)
    mirrored = _FAR if width > ROUGH else _NEAR if width > _MIRROR else 0
    lamps = 0 if shown == _ZERO else _NEAR if SHARP <= width <= ROUGH else _FAR
    return mirrored, lamps


@entry
def sum_across(surfaces: Surfaces, hits: Hits, picture: Picture, first: int, step: int) -> None:
    """Fill ``sums`` of rows ``first``, ``first + step``, ... of a picture."""
    mirrored, lamps, sums = picture.mirrored, picture.lamps, picture.sums
    height, width, _ = mirrored.shape
    for y in range(first, height, step):
        for x in range(width):
            for channel in range(8):
                sums[y, x, channel] = _ZERO
            if mirrored[y, x, 3] == _ZERO:
                continue
            near, far = _reach(mirrored[y, x, 3], lamps[y, x, 3])
            reach, face = max(near, far), hits.face[y, x]
            last, alike = face, True
            for u in range(max(x - reach, 0), min(x + reach + 1, width)):
                away = abs(u - x)
                traced, shown = (away <= near) & (mirrored[y, u, 3] > _MIRROR), (away <= far) & (lamps[y, u, 3] > _ZERO)
                if not (traced or shown):
                    continue
                if hits.face[y, u] != last:
                    last, alike = hits.face[y, u], _is_alike(surfaces, face, hits.face[y, u])
                if not alike:
                    continue
                if traced:
                    weight = np.float32(near + 1 - away)
                    for channel in range(3):
                        sums[y, x, channel] += weight * mirrored[y, u, channel]
                    sums[y, x, 3] += weight
                if shown:
                    weight = np.float32(far + 1 - away)
                    for channel in range(4):
                        sums[y, x, 4 + channel] += weight * lamps[y, u, channel]


@entry
def mix_gloss(surfaces: Surfaces, hits: Hits, picture: Picture, image: NDArray[np.float32], first: int, step: int) -> None:
    """Fill rows ``first``, ``first + step``, ... of ``image`` (height, width, 3) with all light of a picture whose ``sums`` are known."""
    mirrored, share, lamps, sums = picture.mirrored, picture.share, picture.lamps, picture.sums
    height, width, _ = image.shape
    for y in range(first, height, step):
        for x in range(width):
            if mirrored[y, x, 3] == _ZERO:
                image[y, x, 0], image[y, x, 1], image[y, x, 2] = picture.light[y, x, 0], picture.light[y, x, 1], picture.light[y, x, 2]
                continue
            near, far = _reach(mirrored[y, x, 3], lamps[y, x, 3])
            reach, face = max(near, far), hits.face[y, x]
            r = g = b = rays = lamps_r = lamps_g = lamps_b = whole = _ZERO
            last, alike = face, True
            for v in range(max(y - reach, 0), min(y + reach + 1, height)):
                if hits.face[v, x] != last:
                    last, alike = hits.face[v, x], _is_alike(surfaces, face, hits.face[v, x])
                if not alike or sums[v, x, 3] + sums[v, x, 7] == _ZERO:
                    continue
                away = abs(v - y)
                weight = np.float32(max(near + 1 - away, 0))
                r, g, b = r + weight * sums[v, x, 0], g + weight * sums[v, x, 1], b + weight * sums[v, x, 2]
                rays += weight * sums[v, x, 3]
                weight = np.float32(max(far + 1 - away, 0))
                lamps_r, lamps_g, lamps_b = (
                    lamps_r + weight * sums[v, x, 4],
                    lamps_g + weight * sums[v, x, 5],
                    lamps_b + weight * sums[v, x, 6],
                )
                whole += weight * sums[v, x, 7]
            if near > 0 and rays > _ZERO:
                r, g, b = r / rays, g / rays, b / rays
            else:
                r, g, b = mirrored[y, x, 0], mirrored[y, x, 1], mirrored[y, x, 2]
            seen = lamps[y, x, 3] / whole if whole > _ZERO else _ZERO
            image[y, x, 0] = picture.light[y, x, 0] + share[y, x, 0] * r + seen * lamps_r
            image[y, x, 1] = picture.light[y, x, 1] + share[y, x, 1] * g + seen * lamps_g
            image[y, x, 2] = picture.light[y, x, 2] + share[y, x, 2] * b + seen * lamps_b
