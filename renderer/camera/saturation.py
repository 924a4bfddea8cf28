"""Saturation, which processors of cameras raise to make colours livelier: the distance from grey of equal luma, multiplied."""

import numpy as np
from numpy.typing import NDArray

_RED, _GREEN, _BLUE = np.float32(0.299), np.float32(0.587), np.float32(0.114)
"""Of luma, ITU-R BT.601."""


def saturate(codes: NDArray[np.uint8], factor: float) -> NDArray[np.uint8]:
    """Return codes (height, width, 3) with ``factor`` times their distance from the grey of their luma, which stays."""
    luma = (_RED * codes[..., 0] + _GREEN * codes[..., 1] + _BLUE * codes[..., 2])[..., None]
    lively = luma + np.float32(factor) * (codes - luma) + np.float32(0.5)
    return np.asarray(np.clip(lively, np.float32(0.0), np.float32(255.0)), np.uint8)
