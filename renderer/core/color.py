"""Colour: linear RGB with Rec. 709 primaries, its luminance, and the transfer function of sRGB."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el

Rgb = tuple[np.float32, np.float32, np.float32]
"""A colour in a kernel's registers."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear RGB with Rec. 709 primaries in luminance (ITU-R BT.709)."""


def linear_from_srgb(encoded: NDArray[Any]) -> NDArray[Any]:
    """Return linear values in [0, 1] of sRGB ones in [0, 1] (IEC 61966-2-1); the precision is that of the argument."""
    return np.where(encoded <= 0.04045, encoded / 12.92, el.power((encoded + 0.055) / 1.055, 2.4))


def srgb_from_linear(linear: NDArray[Any]) -> NDArray[Any]:
    """Return sRGB values of linear ones (IEC 61966-2-1), [0, 1] both; what is negative stays so."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * el.power(np.maximum(linear, 0.0), 1.0 / 2.4) - 0.055)
