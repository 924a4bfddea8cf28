"""Types of arrays that many modules share, and images that share one block of memory."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

Array = NDArray[np.float64]
"""Numbers of geometry and colour before they are tabulated for kernels."""

_LINE, _HUGE = 64, 1 << 21
"""Bytes of a line of the processor's cache, and of a large page of memory."""


def empty_together(images: Sequence[tuple[tuple[int, ...], DTypeLike]]) -> list[NDArray[Any]]:
    """Return arrays of these shapes and dtypes, not yet filled, in one block of memory that lives as long as any of them.

    The system hands out memory page by page, when it is first touched: with pages of 4 kB that takes longer than to fill an image.  numpy
    asks for large pages where an array has 4 MB or more, so a block of that size begins and ends on the bounds of large pages.
    """
    sizes = [math.prod(shape) * np.dtype(dtype).itemsize for shape, dtype in images]
    starts = np.cumsum([0, *(-(-size // _LINE) * _LINE for size in sizes)])
    total = int(starts[-1])
    line = _HUGE if total >= 2 * _HUGE else _LINE
    block = np.empty(-(-total // line) * line + line, np.uint8)
    block = block[-block.ctypes.data % line :]
    return [
        block[start : start + size].view(dtype).reshape(shape)
        for (shape, dtype), start, size in zip(images, starts[:-1].tolist(), sizes, strict=True)
    ]
