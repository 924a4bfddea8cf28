"""From shaded hits to a picture: what gloss shows is mixed among neighbours that see the same part of something, facing the same way.

Neighbours sample their lobes, and points of lamps, by different numbers of one sequence (Keller and Heidrich, "Interleaved Sampling",
2001).  Weights fall off as a tent, which is separable: rows are summed up, then columns.

How much a pixel shows of lamps where nothing hides them is known in closed form; mixed is what of that is seen, a ratio of sums (Heitz,
Hill and McGuire, "Combining Analytic Direct Illumination and Stochastic Shadows", 2018), so that its outlines stay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, inlined
from renderer.irradiance_cache.records import MIRROR, ROUGH, SHARP
from renderer.path.ground_truth import Hits
from renderer.path.surface_tables import Surfaces

_ZERO = np.float32(0.0)
_SAME_WAY = np.float32(0.9)
_NEAR, _FAR = 3, 7
"""How many pixels away the farthest are that are mixed."""


class Picture(NamedTuple):
    """What shading leaves, float32.

    light: (height, width, 3), cd/m2, at first without what gloss shows.  alpha: (height, width), the width of GGX, 0 where nothing is
    mirrored by a ray, negative where neighbours' rays serve.  guess: (height, width, 3), cd/m2, what the ray found, or the light around if
    none was sent; share: (height, width, 3), how much of it leaves to the camera.
    gloss: (height, width, 8), what is mixed: what the ray found and 1, or 0 where it is not mixed or none was sent; what gloss shows of
    lamps and panes as far as shadow rays reached them, and r + g + b of what it would show if nothing hid them, cd/m2.  sums: (height,
    width, 8), of those of a row, by weight.
    """

    light: NDArray[np.float32]
    alpha: NDArray[np.float32]
    guess: NDArray[np.float32]
    share: NDArray[np.float32]
    gloss: NDArray[np.float32]
    sums: NDArray[np.float32]


def make_picture(height: int, width: int) -> Picture:
    """Return room for a picture."""
    light, guess, share = (np.empty((height, width, 3), np.float32) for _ in range(3))
    gloss, sums = (np.empty((height, width, 8), np.float32) for _ in range(2))
    return Picture(light, np.empty((height, width), np.float32), guess, share, gloss, sums)


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
    mirrored = _FAR if width > ROUGH else _NEAR if width > MIRROR else 0
    lamps = 0 if shown == _ZERO else _NEAR if SHARP <= width <= ROUGH else _FAR
    return mirrored, lamps


@inlined
def _tent(reach: int, away: int) -> np.float32:
    """Return the weight of a pixel so far away; 0 where nothing is mixed."""
    return np.float32(reach + 1 - away) if away <= reach else _ZERO


@inlined
def _sum_line(
    surfaces: Surfaces,
    hits: Hits,
    values: NDArray[np.float32],
    x: int,
    y: int,
    along_row: bool,
    reach: tuple[int, int],
    sums: NDArray[np.float32],
) -> None:
    """Fill ``sums`` (8,) with those of ``values`` (height, width, 8) over the part of a row or column about (x, y) that sees the same.

    By weight: the first four as far as mirrored light is mixed, the others as lamps are.
    """
    (near, far), (height, width, _), face = reach, values.shape, hits.face[y, x]
    place, end, farthest = x if along_row else y, width if along_row else height, max(near, far)
    last, alike = face, True
    for field in range(8):
        sums[field] = _ZERO
    for other in range(max(place - farthest, 0), min(place + farthest + 1, end)):
        v, u = y if along_row else other, other if along_row else x
        if hits.face[v, u] != last:
            last, alike = hits.face[v, u], _is_alike(surfaces, face, hits.face[v, u])
        if alike:
            mirrored, lamps = _tent(near, abs(other - place)), _tent(far, abs(other - place))
            for field in range(4):
                sums[field] += mirrored * values[v, u, field]
            for field in range(4, 8):
                sums[field] += lamps * values[v, u, field]


@entry
def sum_across(surfaces: Surfaces, hits: Hits, picture: Picture, first: int, step: int) -> None:
    """Fill ``sums`` of rows ``first``, ``first + step``, ... of a picture."""
    gloss, sums = picture.gloss, picture.sums
    height, width = picture.alpha.shape
    for y in range(first, height, step):
        for x in range(width):
            _sum_line(surfaces, hits, gloss, x, y, True, _reach(picture.alpha[y, x], gloss[y, x, 7]), sums[y, x])


@entry
def mix_gloss(surfaces: Surfaces, hits: Hits, picture: Picture, first: int, step: int) -> None:
    """Add to ``light`` of rows ``first``, ``first + step``, ... of a picture whose ``sums`` are known what its gloss shows.

    ``gloss`` is used up.
    """
    light, share = picture.light, picture.share
    height, width = picture.alpha.shape
    for y in range(first, height, step):
        for x in range(width):
            if picture.alpha[y, x] == _ZERO:
                continue
            mixed = picture.gloss[y, x]
            shown = mixed[7]
            reach = _reach(picture.alpha[y, x], shown)
            _sum_line(surfaces, hits, picture.sums, x, y, False, reach, mixed)
            rays, whole = mixed[3], mixed[7]
            seen = shown / whole if whole > _ZERO else _ZERO
            for channel in range(3):
                found = mixed[channel] / rays if reach[0] > 0 and rays > _ZERO else picture.guess[y, x, channel]
                light[y, x, channel] += share[y, x, channel] * found + seen * mixed[4 + channel]
