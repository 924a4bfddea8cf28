"""Lateral chromatic aberration: a lens magnifies colours differently, so that edges away from the axis have coloured fringes.

Red and blue images are the green one, larger or smaller about the image centre: the linear part of the usual model by channel (J. Mallon
and P. F. Whelan, "Calibration and removal of lateral chromatic aberration in images", Pattern Recognition Letters 28, 2007).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def magnify_channels(light: NDArray[np.float32], red_shift_px: float, blue_shift_px: float) -> NDArray[np.float32]:
    """Return light (height, width, 3) with its red and its blue image magnified; the same array where nothing is to do.

    What lies outside the image is taken to be as its edge.  Between pixels light is interpolated linearly.

    ``red_shift_px``, ``blue_shift_px``: how far these images of a corner lie outside the green one; negative: inside.
    """
    height, width = light.shape[:2]
    corner = 0.5 * math.hypot(width, height)
    result = light
    for channel, shift in ((0, red_shift_px), (2, blue_shift_px)):
        if shift:
            result = result.copy() if result is light else result
            result[..., channel] = _magnified(light[..., channel], 1.0 + shift / corner)
    return result


def _magnified(image: NDArray[np.float32], factor: float) -> NDArray[np.float32]:
    """Return an image (height, width) magnified about its centre."""
    for axis in (0, 1):
        size = image.shape[axis]
        middle = 0.5 * (size - 1)
        place = np.clip(middle + (np.arange(size) - middle) / factor, 0.0, size - 1.0)
        before = np.minimum(place.astype(np.int64), max(size - 2, 0))
        share = (place - before).astype(np.float32)
        share = share[:, None] if axis == 0 else share
        here, there = np.take(image, before, axis), np.take(image, np.minimum(before + 1, size - 1), axis)
        image = here + share * (there - here)
    return image
