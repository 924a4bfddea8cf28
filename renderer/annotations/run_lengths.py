"""Masks in COCO's form: run lengths by columns, as the compressed string of pycocotools' ``rleToString`` (COCO API, maskApi.c).

The first run is of pixels outside, so it may be 0.  From the fourth on each count is told as the difference to that two before it; numbers
are in groups of five bits, lowest first, each plus 32 if more follow, plus 48 as a character.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from scene_description.annotations import Mask

_CHARACTERS_A_COUNT = 8


@entry
def _write_counts(counts: NDArray[np.int64], text: NDArray[np.uint8]) -> int:
    """Write the characters of run lengths (n,); return how many there are."""
    size = 0
    for i in range(len(counts)):
        value = counts[i] - (counts[i - 2] if i > 2 else 0)
        more = True
        while more:
            group = value & 31
            value >>= 5
            more = value != -1 if group & 16 else value != 0
            text[size] = group + (32 if more else 0) + 48
            size += 1
    return size


def mask_of(columns: NDArray[np.uint16], key: int, first: int, last: int) -> Mask:
    """Return the mask of an id.

    ``columns``: (width, height) uint16, an instance image transposed, contiguous; it has no pixel before ``first`` and after ``last``.
    """
    width, height = columns.shape
    inside = columns[first : last + 1].ravel() == key
    turns = np.flatnonzero(inside[1:] != inside[:-1]) + 1
    ends = [len(inside)] if inside[-1] else []
    starts = np.concatenate([[0] if inside[0] else [], turns, ends]).astype(np.int64) + first * height
    counts = np.diff(np.concatenate([[0], starts, [width * height]]))
    counts = counts[:-1] if counts[-1] == 0 else counts
    text = np.empty(_CHARACTERS_A_COUNT * len(counts), np.uint8)
    size = _write_counts(counts, text)
    return Mask(size=(height, width), counts=text[:size].tobytes().decode("ascii"))
