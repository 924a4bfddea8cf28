"""Response curves: which of 256 codes a camera gives to light, 1 being the white of the exposure; what is brighter is clipped.

``rec709``: the transfer function of ITU-R BT.709 without its footroom.  ``gamma``: a power.  ``table``: brightness at even steps of light,
as measured curves are told, those of the EMoR data base among them (M. D. Grossberg and S. K. Nayar, "Modeling the space of camera
response functions", IEEE PAMI 26, 2004).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import linear_from_srgb

_HALF_CODES = (np.arange(255) + 0.5) / 255.0


def thresholds(response: str, gamma: float, points: Sequence[float]) -> NDArray[np.float32]:
    """Return from which light on each of the codes 1 to 255 is given, (255,): where the curve passes half a code; infinite where never.

    Args:
        response: ``srgb``, ``rec709``, ``gamma`` or ``table``.
        gamma: brightness is light to the power of 1 / gamma.
        points: of the table, at least 2, in [0, 1], none below the one before.
    """
    if response == "table":
        return _where_reached(np.asarray(points, np.float64))
    light = {
        "srgb": linear_from_srgb(_HALF_CODES),
        "rec709": np.where(_HALF_CODES < 0.081, _HALF_CODES / 4.5, ((_HALF_CODES + 0.099) / 1.099) ** (1.0 / 0.45)),
        "gamma": _HALF_CODES**gamma,
    }
    return light[response].astype(np.float32)


def encode(light: NDArray[np.float32], first: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return how many of the thresholds ``first`` (255,) light reaches, pixel by pixel and channel by channel."""
    return np.searchsorted(first, light, side="right").astype(np.uint8)


def _where_reached(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the least light at which a curve, straight between its points, reaches half a code."""
    after = np.searchsorted(points, _HALF_CODES, side="left")
    upper = np.clip(after, 1, len(points) - 1)
    low, high = points[upper - 1], points[upper]
    within = np.divide(_HALF_CODES - low, high - low, out=np.zeros(255), where=high > low)
    light = (upper - 1 + within) / (len(points) - 1)
    return np.where(after == 0, -np.inf, np.where(after == len(points), np.inf, light)).astype(np.float32)
