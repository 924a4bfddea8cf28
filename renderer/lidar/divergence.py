"""The rays that stand for a beam that diverges."""

import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el

Floats = NDArray[np.float64]

_AROUND = 7


def spread(middle: Floats, divergence_rad: float) -> Floats:
    """Return unit directions (n, rays of a beam, 3) of beams in unit directions (n, 3), none of them vertical.

    The first ray of a beam is its middle; where it diverges, seven more lie on a cone about it whose opening gives all eight together the
    mean square angle of an evenly filled beam.
    """
    if divergence_rad == 0.0:
        return middle[:, None]
    x, y, z = middle.T
    level = np.maximum(np.sqrt(x * x + y * y), 1e-9)
    aside = np.column_stack([-y / level, x / level, np.zeros(len(middle))])
    up = np.column_stack([-z * aside[:, 1], z * aside[:, 0], x * aside[:, 1] - y * aside[:, 0]])
    around = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    opening = math.tan(0.5 * divergence_rad * math.sqrt((_AROUND + 1) / (2.0 * _AROUND)))
    ring = middle[:, None] + opening * (el.cos(around)[:, None] * aside[:, None] + el.sin(around)[:, None] * up[:, None])
    rays = np.concatenate([middle[:, None], ring], axis=1)
    return np.asarray(rays / np.linalg.norm(rays, axis=2, keepdims=True))
