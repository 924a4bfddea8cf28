"""From shaded hits to a picture: what gloss shows is mixed among neighbours that see the same part of something, facing the same way.

Neighbours sample their lobes, and points of lamps, by different numbers of one sequence (Keller and Heidrich, "Interleaved Sampling",
2001).  Weights fall off as a tent, which is separable: rows are summed up, then columns.

How much a pixel shows of lamps where nothing hides them is known in closed form, if not exactly; mixed is what points of them bring, over
that, a ratio of sums (Heitz, Hill and McGuire, "Combining Analytic Direct Illumination and Stochastic Shadows", 2018), so that its outlines
stay.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames.records import MIRROR, ROUGH
from renderer.core.kernel import entry, inlined
from renderer.path.ground_truth import Hits
from renderer.path.surface_tables import Surfaces

_ZERO = np.float32(0.0)
_SAME_WAY = np.float32(0.9)
_LEAST, _NEAR, _FAR = 2, 3, 7
"""How many pixels away the farthest are that are mixed: by the narrowest lobes, of lamps in narrow ones, by wide lobes."""
_MIXED = 12


class Picture(NamedTuple):
    """What shading leaves, float32.

    light: (height, width, 3), cd/m2, at first without what gloss shows.  alpha: (height, width), the width of GGX, 0 where nothing is
    mirrored by a ray, negative where neighbours' rays serve.  lamplight: (height, width), r + g + b of what gloss would show of lamps and
    panes if nothing hid them, cd/m2.  guess: (height, width, 3), cd/m2, what the ray found, or the light around if
    none was sent; share: (height, width, 3), how much of it leaves to the camera; under: the same by the lobe under a coat.
    gloss: (height, width, 12), what is mixed: what the ray found and 1, or 0 where it is not mixed or none was sent; what gloss shows of
    lamps and panes as far as shadow rays reached them, and ``lamplight``, or 0 where none were sent; what the ray found
    and 1 where it was aimed by the lobe under a coat.  sums: (height, width, 12), of those of a row, by weight.
    """

    light: NDArray[np.float32]
    alpha: NDArray[np.float32]
    lamplight: NDArray[np.float32]
    guess: NDArray[np.float32]
    share: NDArray[np.float32]
    under: NDArray[np.float32]
    gloss: NDArray[np.float32]
    sums: NDArray[np.float32]


def make_picture(height: int, width: int) -> Picture:
    """Return room for a picture."""
    light, guess, share, under = (np.empty((height, width, 3), np.float32) for _ in range(4))
    gloss, sums = (np.empty((height, width, _MIXED), np.float32) for _ in range(2))
    alpha, lamplight = (np.empty((height, width), np.float32) for _ in range(2))
    return Picture(light, alpha, lamplight, guess, share, under, gloss, sums)


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
def _reach(picture: Picture, focal_px: np.float32, x: int, y: int) -> tuple[int, int, int]:
    """Return how far mirrored light, lamps and what is under a coat are mixed, pixels; 0 for none.

    A lobe of GGX spreads what lies as far behind a surface as the eye is before it over about its width times the focal length.  Under a
    coat that is smooth lamps show in a rough lobe.
    """
    width, under = abs(picture.alpha[y, x]), picture.under[y, x]
    mirrored = min(max(int(width * focal_px), _LEAST), _FAR) if width > MIRROR else 0
    coated = max(under[0], under[1], under[2]) > _ZERO
    lamps = 0 if picture.lamplight[y, x] == _ZERO else _FAR if coated or width > ROUGH else _NEAR
    return mirrored, lamps, _FAR if coated else 0


@inlined
def _tent(reach: int, away: int) -> np.float32:
    """Return the weight of a pixel so far away; 0 where nothing is mixed."""
    return np.float32(reach + 1 - away) if away <= reach else _ZERO


class _Sum(NamedTuple):
    """A sum by weight: of light (r, g, b), cd/m2, and of what it is over."""

    r: np.float32
    g: np.float32
    b: np.float32
    over: np.float32


@inlined
def _added(total: _Sum, weight: np.float32, values: NDArray[np.float32], first: int) -> _Sum:
    """Return a sum with four numbers more, those of a pixel from ``first`` on."""
    return _Sum(
        total.r + weight * values[first],
        total.g + weight * values[first + 1],
        total.b + weight * values[first + 2],
        total.over + weight * values[first + 3],
    )


@inlined
def _sum_line(
    surfaces: Surfaces, hits: Hits, values: NDArray[np.float32], x: int, y: int, along_row: bool, reach: tuple[int, int, int]
) -> tuple[_Sum, _Sum, _Sum]:
    """Return the sums of ``values`` (height, width, 12) over the part of a row or column about (x, y) that sees the same.

    They are of what the rays found, of lamps, and of what is under a coat, by weights that fall off over ``reach``.
    """
    (height, width, _), face, farthest = values.shape, hits.face[y, x], max(reach[0], reach[1], reach[2])
    place, end = x if along_row else y, width if along_row else height
    last, alike = face, True
    mirrored = lamps = under = _Sum(_ZERO, _ZERO, _ZERO, _ZERO)
    for other in range(max(place - farthest, 0), min(place + farthest + 1, end)):
        v, u = y if along_row else other, other if along_row else x
        if hits.face[v, u] != last:
            last, alike = hits.face[v, u], _is_alike(surfaces, face, hits.face[v, u])
        if alike:
            away, value = abs(other - place), values[v, u]
            mirrored = _added(mirrored, _tent(reach[0], away), value, 0)
            lamps = _added(lamps, _tent(reach[1], away), value, 4)
            if reach[2] > 0:
                under = _added(under, _tent(reach[2], away), value, 8)
    return mirrored, lamps, under


@inlined
def _keep(sums: NDArray[np.float32], first: int, total: _Sum) -> None:
    sums[first], sums[first + 1], sums[first + 2], sums[first + 3] = total.r, total.g, total.b, total.over


@entry
def sum_across(surfaces: Surfaces, hits: Hits, picture: Picture, focal_px: np.float32, first: int, step: int) -> None:
    """Fill ``sums`` of rows ``first``, ``first + step``, ... of a picture."""
    sums = picture.sums
    height, width = picture.alpha.shape
    for y in range(first, height, step):
        for x in range(width):
            reach = _reach(picture, focal_px, x, y)
            if max(reach[0], reach[1], reach[2]) == 0:
                for field in range(_MIXED):
                    sums[y, x, field] = _ZERO
                continue
            mirrored, lamps, under = _sum_line(surfaces, hits, picture.gloss, x, y, True, reach)
            _keep(sums[y, x], 0, mirrored)
            _keep(sums[y, x], 4, lamps)
            _keep(sums[y, x], 8, under)


@entry
def mix_gloss(surfaces: Surfaces, hits: Hits, picture: Picture, focal_px: np.float32, first: int, step: int) -> None:
    """Add to ``light`` of rows ``first``, ``first + step``, ... of a picture whose ``sums`` are known what its gloss shows."""
    height, width = picture.alpha.shape
    for y in range(first, height, step):
        for x in range(width):
            if picture.alpha[y, x] == _ZERO:
                continue
            reach = _reach(picture, focal_px, x, y)
            mirrored, lamps, under = _sum_line(surfaces, hits, picture.sums, x, y, False, reach)
            seen = picture.lamplight[y, x] / lamps.over if lamps.over > _ZERO else _ZERO
            _add_mean(picture.light[y, x], picture.share[y, x], mirrored, reach[0] > 0, picture.guess[y, x])
            picture.light[y, x, 0] += seen * lamps.r
            picture.light[y, x, 1] += seen * lamps.g
            picture.light[y, x, 2] += seen * lamps.b
            if reach[2] > 0:
                _add_mean(picture.light[y, x], picture.under[y, x], under, True, picture.guess[y, x])


@inlined
def _add_mean(light: NDArray[np.float32], share: NDArray[np.float32], total: _Sum, mixed: bool, guess: NDArray[np.float32]) -> None:
    """Add a share of the mean of what rays found, or of the ``guess`` where nothing is ``mixed`` or none was sent."""
    found = mixed and total.over > _ZERO
    light[0] += share[0] * (total.r / total.over if found else guess[0])
    light[1] += share[1] * (total.g / total.over if found else guess[1])
    light[2] += share[2] * (total.b / total.over if found else guess[2])
