"""Transfer function of sRGB (IEC 61966-2-1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def linear_from_srgb(encoded: ArrayLike) -> NDArray[np.float64]:
    """Return linear values in [0, 1] of sRGB-encoded values in [0, 1]."""
    values = np.asarray(encoded, np.float64)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
