"""Lone dark pixels: those of which few points are sampled, and of which these have missed what is around."""

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE
from renderer.core.kernel import entry, inlined

LONE = np.float32(0.6)
"""Light of a gap, or of a pixel that is much darker than all around, over what is around, at most."""
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)


@inlined
def is_lone(image: NDArray[np.float32], x: int, y: int) -> bool:
    """Return whether a pixel has much less light than its eight neighbours, all but one of them at least; none of the rim has."""
    height, width, _ = image.shape
    if x == 0 or y == 0 or x + 1 == width or y + 1 == height:
        return False
    others = 0
    for v in range(y - 1, y + 2):
        for u in range(x - 1, x + 2):
            others += image[y, x, 1] >= LONE * image[v, u, 1]
    # It is no darker than itself.
    return others <= 2


@entry
def lift_lone(image: NDArray[np.float32], first: int, step: int) -> None:
    """Lift pixels of rows ``first``, ``first + step``, ... that are still much darker than each of their neighbours; none of the rim.

    What is so small hides little of a pixel: its few points have missed what is around.  It takes a share of the darkest neighbour's light,
    as filters by rank do.  Of two pixels beside each other one at most is lifted, so the order in
    which that is done changes nothing.
    """
    height, width, _ = image.shape
    for y in range(first, height, step):
        for x in range(1, width - 1 if 0 < y < height - 1 else 1):
            u, v = _darkest_beside(image, x, y)
            if u >= 0:
                for channel in range(3):
                    image[y, x, channel] = LONE * image[v, u, channel]


@inlined
def _darkest_beside(image: NDArray[np.float32], x: int, y: int) -> tuple[int, int]:
    """Return the darkest of the eight pixels around one (column, row); (-1, -1) if one of them is not much lighter than it."""
    here, least, column, row = _luminance(image, x, y), np.float32(np.inf), -1, -1
    for v in range(y - 1, y + 2):
        for u in range(x - 1, x + 2):
            if u == x and v == y:
                continue
            there = _luminance(image, u, v)
            if here >= LONE * there:
                return -1, -1
            if there < least:
                least, column, row = there, u, v
    return column, row


@inlined
def _luminance(image: NDArray[np.float32], x: int, y: int) -> np.float32:
    luminance: np.float32 = _RED * image[y, x, 0] + _GREEN * image[y, x, 1] + _BLUE * image[y, x, 2]
    return luminance
