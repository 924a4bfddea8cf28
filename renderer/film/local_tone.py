"""Local tone mapping: what is broad in the light is compressed, what is fine keeps its contrast: a room and its windows are readable.

The base layer of the logarithm of luminance is what a guided filter leaves of it, which smooths but keeps edges (K. He, J. Sun and
X. Tang, "Guided Image Filtering", IEEE PAMI 35, 2013); the detail is the rest (F. Durand and J. Dorsey, "Fast Bilateral Filtering for the
Display of High-Dynamic-Range Images", SIGGRAPH 2002).  The base is drawn towards middle grey by the same function in every frame, so
frames agree.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, kernel

MIDDLE_GREY = 0.18
"""Light, in multiples of white, whose base stays."""

_RADIUS_SHARE = 1.0 / 12.0
"""Of the image's width, the radius of the filter's windows."""
_EDGE_STOPS = 0.6
"""Deviation of a window, in stops, from which on an edge rather counts as one."""
_LEAST = 1e-4


def compress_base(light: NDArray[np.float32], span_stops: float) -> NDArray[np.float32]:
    """Return light (height, width, 3), in multiples of white, with its base layer within so many stops: 2.3 is 5:1, more is less.

    A base d stops away from middle grey is shown d / (1 + |d| / l) stops away, l being half the span; colours keep their hue.
    """
    height, width = light.shape[:2]
    stops, scratch = np.empty((height, width)), np.empty((4, height, width))
    shown = np.empty((height, width, 3), np.float32)
    _take_stops(light, stops)
    _guide(stops, max(1, round(_RADIUS_SHARE * width)), _EDGE_STOPS**2, scratch)
    _compress(light, scratch[0], 0.5 * span_stops, shown)
    return shown


@entry
def _take_stops(light: NDArray[np.float32], stops: NDArray[np.float64]) -> None:
    """Write the stops of luminance above middle grey."""
    for y in range(light.shape[0]):
        for x in range(light.shape[1]):
            luminance = 0.2126 * light[y, x, 0] + 0.7152 * light[y, x, 1] + 0.0722 * light[y, x, 2]
            stops[y, x] = math.log2(max(luminance, _LEAST) / MIDDLE_GREY)


@entry
def _guide(image: NDArray[np.float64], radius: int, edge: float, scratch: NDArray[np.float64]) -> None:
    """Write the guided filter of an image by itself to scratch[0]; scratch (4, height, width)."""
    height, width = image.shape
    slope, offset, passing, row = scratch[0], scratch[1], scratch[2], scratch[3]
    for y in range(height):
        for x in range(width):
            offset[y, x] = image[y, x]
            slope[y, x] = image[y, x] * image[y, x]
    _box_mean(slope, radius, passing, row)
    _box_mean(offset, radius, passing, row)
    for y in range(height):
        for x in range(width):
            mean = offset[y, x]
            variance = max(slope[y, x] - mean * mean, 0.0)
            slope[y, x] = variance / (variance + edge)
            offset[y, x] = (1.0 - slope[y, x]) * mean
    _box_mean(slope, radius, passing, row)
    _box_mean(offset, radius, passing, row)
    for y in range(height):
        for x in range(width):
            slope[y, x] = slope[y, x] * image[y, x] + offset[y, x]


@kernel
def _box_mean(image: NDArray[np.float64], radius: int, passing: NDArray[np.float64], sums: NDArray[np.float64]) -> None:
    """Replace an image by the means over squares of 2 radius + 1 pixels, as far as they lie in it; sums run along rows, then columns."""
    height, width = image.shape
    for y in range(height):
        total = 0.0
        for x in range(width):
            total += image[y, x]
            sums[y, x] = total
        for x in range(width):
            low, high = x - radius - 1, min(x + radius, width - 1)
            passing[y, x] = (sums[y, high] - (sums[y, low] if low >= 0 else 0.0)) / (high - max(low, -1))
    for x in range(width):
        sums[0, x] = passing[0, x]
    for y in range(1, height):
        for x in range(width):
            sums[y, x] = sums[y - 1, x] + passing[y, x]
    for y in range(height):
        low, high = y - radius - 1, min(y + radius, height - 1)
        for x in range(width):
            image[y, x] = (sums[high, x] - (sums[low, x] if low >= 0 else 0.0)) / (high - max(low, -1))


@entry
def _compress(light: NDArray[np.float32], base: NDArray[np.float64], most_stops: float, shown: NDArray[np.float32]) -> None:
    """Write light times what its base is compressed by."""
    for y in range(light.shape[0]):
        for x in range(light.shape[1]):
            stops = base[y, x]
            factor = np.float32(2.0 ** (stops / (1.0 + abs(stops) / most_stops) - stops))
            for c in range(3):
                shown[y, x, c] = light[y, x, c] * factor
