"""Grain: the noise that is left in a camera's pictures, in codes of the display.

Most of it is shared by the three channels, as processors of cameras take away noise of colour first.  It fades where codes end, because a
pixel that is black or saturated has none.  Every number depends on (scene, frame, pixel) only.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.core.random_numbers import mix_bits, standard_normal

_OWN_SHARE = 0.5
"""Deviation of a channel's own noise, over that which the channels share."""
_STREAM, _SECOND = np.uint32(0x2C1B3C6D), np.uint32(0x297A2D39)
_TABLE_BITS = 10


def add_grain(codes: NDArray[np.uint8], deviation: float, frame_key: np.uint32, first_row: int = 0) -> NDArray[np.uint8]:
    """Return codes (height, width, 3) with grain.

    Args:
        codes: sRGB.
        deviation: of luma at middle codes, in codes.
        frame_key: of the frame's random numbers.
        first_row: of the frame that the first of ``codes`` is.
    """
    grained = np.empty(codes.shape, np.uint8)
    first = np.uint32(first_row * codes.shape[1])
    _add_grain(codes.reshape(-1, 3), _deviates(), np.float32(deviation), np.uint32(frame_key), first, grained.reshape(-1, 3))
    return grained


@cache
def _deviates() -> NDArray[np.float32]:
    deviates = np.empty(1 << _TABLE_BITS, np.float32)
    _fill_normal(deviates)
    return deviates


@entry
def _fill_normal(deviates: NDArray[np.float32]) -> None:
    """Write standard normal numbers, keyed by their place."""
    for i in range(len(deviates)):
        first = mix_bits(np.uint32(np.uint32(i) + _STREAM))
        deviates[i] = standard_normal(first, mix_bits(np.uint32(first + _SECOND)))


@entry
def _add_grain(
    codes: NDArray[np.uint8],
    deviates: NDArray[np.float32],
    deviation: np.float32,
    frame_key: np.uint32,
    first: np.uint32,
    grained: NDArray[np.uint8],
) -> None:
    """Write each code plus a deviate that the pixel's channels share and one of its own, rounded; weight 1 - (2 c - 1)^4 of c in [0, 1]."""
    last = np.uint32(len(deviates) - 1)
    for i in range(len(codes)):
        hashed = mix_bits(np.uint32(mix_bits(np.uint32(np.uint32(i) + first + _STREAM)) ^ frame_key))
        shared = deviates[hashed & last]
        own = mix_bits(np.uint32(hashed + _SECOND))
        for c in range(3):
            signed = np.float32(codes[i, c]) * np.float32(2.0 / 255.0) - np.float32(1.0)
            weight = np.float32(1.0) - signed * signed * signed * signed
            noise = shared + np.float32(_OWN_SHARE) * deviates[(own >> np.uint32(_TABLE_BITS * c)) & last]
            code = np.float32(codes[i, c]) + deviation * weight * noise + np.float32(0.5)
            grained[i, c] = np.uint8(min(max(code, np.float32(0.0)), np.float32(255.0)))
