"""What devices do about lone pixels: the majority around a pixel decides whether it is read, so that holes and islands are blobs."""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, kernel


@entry
def remove_specks(read: NDArray[np.float32], window: int, result: NDArray[np.float32], first: int, step: int) -> None:
    """Fill rows ``first``, ``first + step``, ... of what is left of numbers (height, width) that a device reads; NaN are holes.

    A pixel is read where most of the window about it are: one that was not takes the number of the nearest that was, the first in the
    order of rows.
    """
    height, width = read.shape
    half = window // 2
    for y in range(first, height, step):
        for x in range(width):
            count, total = 0, 0
            for v in range(max(y - half, 0), min(y + half + 1, height)):
                for u in range(max(x - half, 0), min(x + half + 1, width)):
                    total += 1
                    count += 0 if np.isnan(read[v, u]) else 1
            if 2 * count <= total:
                result[y, x] = np.nan
            elif np.isnan(read[y, x]):
                result[y, x] = _nearest(read, x, y, half)
            else:
                result[y, x] = read[y, x]


@kernel
def _nearest(read: NDArray[np.float32], x: int, y: int, half: int) -> np.float32:
    """Return the number in the nearest pixel that has one."""
    found, least = np.float32(np.nan), 1 << 30
    for v in range(max(y - half, 0), min(y + half + 1, read.shape[0])):
        for u in range(max(x - half, 0), min(x + half + 1, read.shape[1])):
            away = (u - x) * (u - x) + (v - y) * (v - y)
            if away < least and not np.isnan(read[v, u]):
                found, least = read[v, u], away
    return found
