"""Points by which hemispheres, lights and the sun are sampled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import LANES


def even_points(count: int) -> NDArray[np.float32]:
    """Return ``count`` points of the unit square, (count, 2) float32, spread evenly: blocks of 16 lie close together.

    Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences" (2018).
    """
    steps = np.arange(1, count + 1)[:, None] * np.array([0.7548776662466927, 0.5698402909980532])
    points = steps % 1.0
    blocks = max(count // LANES, 1)
    rows = max(1, int(np.sqrt(blocks)))
    order = np.lexsort((points[:, 1], (points[:, 0] * rows).astype(int)))
    return np.ascontiguousarray(points[order], np.float32)
