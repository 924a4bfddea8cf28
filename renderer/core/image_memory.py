"""Memory for images, frame after frame."""

import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

_LINE, _HUGE = 64, 1 << 21
"""Bytes of a line of the processor's cache, and of a large page of memory."""
_OURS, _MOST = 3, 16
"""References to a block that has no images, from the list, from the loop over it, and from the call that counts them; and blocks that are
kept at most."""


class ImageMemory:
    """Hands out images, those of one call in one block of memory, which is used again when none of its images is left.

    The system clears memory page by page, when it is first touched: that takes half as long as to fill four images.  numpy asks for large
    pages where an array has 4 MB or more, so a block of that size begins and ends on the bounds of large pages.
    """

    def __init__(self) -> None:
        """Begin without memory."""
        self._blocks: list[NDArray[np.uint8]] = []

    def empty(self, images: Sequence[tuple[tuple[int, ...], DTypeLike]]) -> list[NDArray[Any]]:
        """Return arrays of these shapes and dtypes, not yet filled; their memory is theirs as long as any of them lives."""
        sizes = [math.prod(shape) * np.dtype(dtype).itemsize for shape, dtype in images]
        starts = np.cumsum([0, *(-(-size // _LINE) * _LINE for size in sizes)])
        total = int(starts[-1])
        line = _HUGE if total >= 2 * _HUGE else _LINE
        block = self._block(-(-total // line) * line + line)
        block = block[-block.ctypes.data % line :]
        return [
            block[start : start + size].view(dtype).reshape(shape)
            for (shape, dtype), start, size in zip(images, starts[:-1].tolist(), sizes, strict=True)
        ]

    def _block(self, size: int) -> NDArray[np.uint8]:
        """Return a block of so many bytes; where none is free, those of other sizes that are free are given back."""
        is_free = [sys.getrefcount(block) <= _OURS for block in self._blocks]
        for block, free in zip(self._blocks, is_free, strict=True):
            if free and block.size == size:
                return block
        in_use = [block for block, free in zip(self._blocks, is_free, strict=True) if not free]
        self._blocks = [*in_use[1 - _MOST :], np.empty(size, np.uint8)]
        return self._blocks[-1]
