"""Records that cross stages of shading: what is looked up, what sends a ray, and the memory of a thread."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import LANES
from renderer.core.kernel import inlined
from renderer.core.layout import Layout
from renderer.irradiance_cache.atlas import Atlas

SHARP = np.float32(0.01)
"""Width of GGX from which on lamps are shown by :mod:`renderer.irradiance_cache.lamps`, not by the ray."""
ROUGH = np.float32(0.03)
"""Width of GGX from which on mirrored light is mixed over twice the distance."""
WIDE = np.float32(0.1)
"""Width of GGX from which on window panes are shown as lamps are."""
_FAINT = np.float32(0.06)

# A row of ``Around.kept``: 16 primary hits while their rays are traced.
_KEPT = Layout()
SHARE = _KEPT.field(3)  # of the light from the gloss ray that leaves towards the camera
POINT = _KEPT.field(3)  # where it begins
AHEAD = _KEPT.field(3)  # its direction
LIGHT = _KEPT.field(3)  # luminance of the pixel so far
BASE = _KEPT.field(3)  # what glass or a pane lets through of what it does not reflect
PANE = _KEPT.field()  # 1 for a window pane
KIND = _KEPT.field()  # 0 no ray, 1 one, 2 one that is mirrored and one that goes through
ALPHA = _KEPT.field()
UNDER = _KEPT.field(3)  # as SHARE, of the lobe under the coat
UNDER_ALPHA = _KEPT.field()
SEEN = _KEPT.field(3)  # luminance that the gloss ray finds


class Cache(NamedTuple):
    """What frames look up.

    fine: nodes, and rows: (n, ROW) of :mod:`renderer.irradiance_cache.nodes`, their light.  coarse: nodes for what is mirrored; even:
    (n, 3), illuminance over pi there, lux; worth: (n,), the share of a node's surroundings that is not close by; leaving: (n, 3), what of that
    light is reflected, cd/m2.
    """

    fine: Atlas
    rows: NDArray[np.float32]
    coarse: Atlas
    even: NDArray[np.float32]
    worth: NDArray[np.float32]
    leaving: NDArray[np.float32]


class Gloss(NamedTuple):
    """Which hits send a ray: those whose microfacets reflect at least ``least`` and are no rougher than ``roughest``."""

    least: np.float32
    roughest: np.float32


class Around(NamedTuple):
    """Memory of one thread.

    nodes, weights: (4,); kept: (KEPT, 16), of primary hits while their rays are traced; edges: (7, 48), rays of a tile's edges.
    """

    nodes: NDArray[np.int32]
    weights: NDArray[np.float32]
    kept: NDArray[np.float32]
    edges: NDArray[np.float32]


@inlined
def is_faint(kept: NDArray[np.float32], k: int) -> bool:
    """Return whether lane k mirrors little, by a lobe that is not sharp."""
    return bool((kept[ALPHA, k] >= SHARP) & (max(kept[SHARE, k], kept[SHARE + 1, k], kept[SHARE + 2, k]) < _FAINT))


@inlined
def takes_from_others(x: int, y: int, kept: NDArray[np.float32], k: int) -> bool:
    """Return whether lane k, of pixel (x, y), sends no mirrored ray: three of four on rough surfaces, half where little is mirrored."""
    if kept[ALPHA, k] > ROUGH:
        return bool((x | y) & 1)
    return is_faint(kept, k) and (x + y) & 1 == 1


def make_around() -> Around:
    """Return that memory."""
    return Around(
        np.zeros(4, np.int32), np.zeros(4, np.float32), np.zeros((_KEPT.size, LANES), np.float32), np.zeros((7, 3 * LANES), np.float32)
    )
