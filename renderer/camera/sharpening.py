"""Sharpening, as processors of cameras do it last: an unsharp mask of luma, so that colour gets no fringes and its noise stays as it is.

Luma is that of ITU-R BT.601; the blurred image is its mean by binomial weights, 1 4 6 4 1, along rows and columns: a Gaussian of one pixel.
What is no stronger than noise stays as it is (coring): detail d counts d^2 / (d^2 + c^2) of itself.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.camera.blur import blur

_RED, _GREEN, _BLUE = np.float32(0.299), np.float32(0.587), np.float32(0.114)
_WEIGHTS = (6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0)
"""Of a pixel, of each that is one away, and of each that is two away."""
_CORE = np.float32(1.5)
"""The detail c, in codes, of which half counts."""


def sharpen(codes: NDArray[np.uint8], amount: float) -> NDArray[np.uint8]:
    """Return codes (height, width, 3) plus ``amount`` times what their luma has more than its surroundings."""
    luma = _RED * codes[..., 0] + _GREEN * codes[..., 1] + _BLUE * codes[..., 2]
    detail = luma - blur(luma, _WEIGHTS)
    square = detail * detail
    detail *= np.float32(amount) * square / (square + _CORE * _CORE)
    sharp = codes + detail[..., None] + np.float32(0.5)
    return np.asarray(np.clip(sharp, np.float32(0.0), np.float32(255.0)), np.uint8)
