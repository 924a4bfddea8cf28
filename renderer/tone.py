"""From linear luminance to display colour: exposure, sRGB, 8 bits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def white_luminance(exposure_ev100: float) -> float:
    """Return the luminance in cd/m2 that saturates a sensor at an exposure value: 1.2 * 2^EV100 (ISO 12232, saturation-based speed)."""
    return 1.2 * float(2.0**exposure_ev100)


def encode_srgb(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return 8-bit sRGB (IEC 61966-2-1) of linear values; 0 is black, 1 white, values beyond are clipped.

    By table: each code begins where the transfer function, inverted, passes half a code; no power is computed per pixel.
    """
    return np.searchsorted(_THRESHOLDS, linear, side="right").astype(np.uint8)


def to_display(radiance: NDArray[np.float32], exposure_ev100: float) -> NDArray[np.uint8]:
    """Return what a camera shows of luminance (height, width, 3) in cd/m2: sRGB, uint8."""
    return encode_srgb(radiance * np.float32(1.0 / white_luminance(exposure_ev100)))


def _decode_srgb(code: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


_THRESHOLDS = _decode_srgb((np.arange(255) + 0.5) / 255.0).astype(np.float32)
