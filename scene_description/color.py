"""Transfer function of sRGB (IEC 61966-2-1)."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def linear_from_srgb(encoded: ArrayLike) -> NDArray[np.float64]:
    """Return linear values in [0, 1] of sRGB-encoded values in [0, 1]."""
    values = np.asarray(encoded, np.float64)
    linear = [value / 12.92 if value <= 0.04045 else math.pow((value + 0.055) / 1.055, 2.4) for value in values.reshape(-1).tolist()]
    return np.array(linear).reshape(values.shape)
