"""Blur along rows and columns by symmetric weights; what lies outside an image is taken to be as its edge."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_REACH = 3.0
"""Deviations of a Gaussian beyond which nothing is left of it."""


def gaussian_weights(deviation_px: float) -> tuple[float, ...]:
    """Return the weights of a pixel and of those that are one, two ... away: a Gaussian's share of each pixel's width, 1 in all."""
    reach = math.ceil(_REACH * deviation_px)
    below = [math.erf((place - 0.5) / (math.sqrt(2.0) * deviation_px)) for place in range(reach + 2)]
    shares = [high - low for low, high in pairwise(below)]
    total = shares[0] + 2.0 * math.fsum(shares[1:])
    return tuple(share / total for share in shares)


def blur(image: NDArray[np.float32], weights: Sequence[float]) -> NDArray[np.float32]:
    """Return an image (height, width, ...) blurred along its columns, then its rows; ``weights``: as of :func:`gaussian_weights`."""
    for axis in (0, 1):
        image = _blurred(image, weights, axis)
    return image


def _blurred(image: NDArray[np.float32], weights: Sequence[float], axis: int) -> NDArray[np.float32]:
    reach, size = len(weights) - 1, image.shape[axis]
    padded = np.pad(image, [(reach, reach) if a == axis else (0, 0) for a in range(image.ndim)], mode="edge")
    at = [np.take(padded, np.arange(i, i + size), axis) for i in range(2 * reach + 1)]
    total = np.float32(weights[0]) * at[reach]
    for away, weight in enumerate(weights[1:], 1):
        total = total + np.float32(weight) * (at[reach - away] + at[reach + away])
    return np.asarray(total, np.float32)
