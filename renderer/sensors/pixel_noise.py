"""Normal and even numbers of a pixel: they depend on the frame's key, the pixel and the purpose only."""

from __future__ import annotations

import numpy as np

from renderer.core.kernel import kernel
from renderer.core.random_numbers import mix_bits

AXIAL, LATERAL_X, LATERAL_Y, SIGNAL, LEFT_IMAGE, RIGHT_IMAGE = range(1, 7)
"""Purposes: each has numbers of its own."""

_TO_UNIT, _GOLDEN, _OTHER = 2.0**-32, np.uint32(0x9E3779B9), np.uint32(0x68E31DA4)


@kernel
def even(key: np.uint32, pixel: int, purpose: int) -> float:
    """Return an even number in (0, 1)."""
    seed = mix_bits(np.uint32(mix_bits(np.uint32(pixel)) ^ np.uint32(key + np.uint32(np.uint32(purpose) * _GOLDEN))))
    return (float(seed) + 0.5) * _TO_UNIT


@kernel
def normal(key: np.uint32, pixel: int, purpose: int) -> float:
    """Return a standard normal number (Box and Muller 1958)."""
    seed = mix_bits(np.uint32(mix_bits(np.uint32(pixel)) ^ np.uint32(key + np.uint32(np.uint32(purpose) * _GOLDEN))))
    u, v = (float(seed) + 0.5) * _TO_UNIT, float(mix_bits(np.uint32(seed ^ _OTHER))) * _TO_UNIT
    number: float = np.sqrt(-2.0 * np.log(u)) * np.cos(2.0 * np.pi * v)
    return number
