"""How far a picture is from another: FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020) and mean light.

FLIP is computed by its authors' package ``flip-evaluator`` on what is displayed, at 67 pixels a degree.
"""

from __future__ import annotations

import flip_evaluator
import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE


def mean_flip(reference: NDArray[np.generic], picture: NDArray[np.generic]) -> float:
    """Return the mean FLIP of two sRGB pictures (h, w, 3) uint8, 0 where they are equal and at most 1."""
    return float(flip_evaluator.evaluate(_unit(reference), _unit(picture), "LDR", applyMagma=False)[1])


def flip_map(reference: NDArray[np.generic], picture: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return FLIP of each pixel as a colour, (h, w, 3) uint8: from black, 0, by violet and orange to pale yellow, 1 (the map *magma*)."""
    colors = flip_evaluator.evaluate(_unit(reference), _unit(picture), "LDR", applyMagma=True)[0]
    return np.asarray(np.rint(255.0 * np.clip(colors, 0.0, 1.0)), np.uint8)


def mean_luminance(radiance: NDArray[np.generic] | None) -> float:
    """Return the mean luminance of a linear picture (h, w, 3), cd/m2."""
    assert radiance is not None
    return float((np.asarray(radiance, np.float64) @ LUMINANCE).mean())


def _unit(picture: NDArray[np.generic]) -> NDArray[np.float32]:
    return np.ascontiguousarray(picture, np.float32) / np.float32(255.0)
