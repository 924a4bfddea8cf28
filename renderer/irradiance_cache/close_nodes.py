"""Nodes so close to other surfaces that smoothing leaves them alone: the noise of their rays is shared with those beside them."""

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE
from renderer.irradiance_cache.nodes import LAMPS, LIGHT, TOWARD, NodeLight
from renderer.path.light_nodes import Atlas

_FARTHEST_STEPS = np.float32(1.0 / 0.35)
"""Harmonic mean distance of what surrounds a node, in steps between nodes, below which it is mixed with no other."""
_ALIKE = np.float32(0.3)
_WEIGHT = np.float32(0.6)
_TINY = np.float32(1e-20)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)


def share_noise(
    atlas: Atlas,
    place: NDArray[np.int32],
    grids: NDArray[np.int32],
    spacing_m: np.float32,
    nodes: NDArray[np.int64],
    light: NodeLight,
    rows: NDArray[np.float32],
) -> None:
    """Fill LIGHT, TOWARD and LAMPS of ``rows`` (n, ROW) of those ``nodes`` (i,) that are close to other surfaces.

    The four nodes beside one on its grid count the less the more their gathered light differs, not at all from 30 % on, nor where something
    stands between (the bilateral filter of Tomasi and Manduchi, "Bilateral Filtering for Gray and Color Images", 1998): the noise of a
    gather is a tenth, shadows where things touch are deeper.  ``place``, ``grids``: as of :func:`renderer.irradiance_cache.nodes.places`.
    """
    chosen = nodes[(place[nodes] >= 0) & (light.valid[nodes] > 0.0) & (light.open_m[nodes] < _FARTHEST_STEPS * spacing_m)]
    at = place[chosen]
    if not len(at):
        return
    offset, width, height = grids[np.searchsorted(grids[:, 0], at, side="right") - 1].T
    column, row = (at - offset) % width, (at - offset) // width
    # Beside: whether there is a place, which, and where the way there begins in ``cuts``.
    beside = (
        (column + 1 < width, at + 1, at, 0),
        (column > 0, at - 1, at - 1, 0),
        (row + 1 < height, at + width, at, 1),
        (row > 0, at - width, at - width, 1),
    )
    total, shared, toward = np.ones(len(at), np.float32), light.indirect[chosen].copy(), light.toward[chosen].copy()
    here = _luminance(light.indirect[chosen])
    for within, there, begin, way in beside:
        other = np.where(within, atlas.grid[np.where(within, there, at)], -1)
        passes = (other >= 0) & (light.valid[other] > 0.0) & np.isnan(atlas.cuts[np.where(within, begin, at), way])
        around = _luminance(light.indirect[other])
        weight = _WEIGHT * np.maximum(1.0 - np.abs(around - here) / (_ALIKE * np.maximum(np.maximum(around, here), _TINY)), 0.0)
        weight = np.where(passes, weight, 0.0).astype(np.float32)
        total += weight
        shared += weight[:, None] * light.indirect[other]
        toward += weight[:, None] * light.toward[other]
    rows[chosen, LIGHT : LIGHT + 3] = shared / total[:, None] + light.direct[chosen]
    rows[chosen, TOWARD : TOWARD + 3] = toward / total[:, None]
    lamps = light.direct[chosen, 0] + light.direct[chosen, 1] + light.direct[chosen, 2]
    lit = rows[chosen, LIGHT] + rows[chosen, LIGHT + 1] + rows[chosen, LIGHT + 2]
    rows[chosen, LAMPS] = lamps / np.maximum(lit, _TINY)


def _luminance(color: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(_RED * color[:, 0] + _GREEN * color[:, 1] + _BLUE * color[:, 2], np.float32)
