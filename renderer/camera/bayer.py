"""The Bayer mosaic, one colour a pixel, and how the others are interpolated.

Both ways are linear filters of 5 x 5 pixels at most.  *Bilinear* takes the mean of the nearest pixels of the colour.  *Malvar* adds to it
the Laplacian of the colour that the pixel has, and so follows edges better (H. S. Malvar, L. He and R. Cutler, "High-quality linear
interpolation for demosaicing of Bayer-patterned color images", ICASSP 2004; the coefficients are those of its figure 2, in eighths).
"""

import numpy as np
from numpy.typing import NDArray

PATTERNS = {"rggb": (0, 1, 1, 2), "bggr": (2, 1, 1, 0), "grbg": (1, 0, 2, 1), "gbrg": (1, 2, 0, 1)}
"""Channels of the upper left four pixels, row by row."""

Filter = dict[tuple[int, int], float]
"""Coefficients, in eighths, by row and column against the pixel."""


def _symmetric(taps: Filter) -> Filter:
    """Return a filter from its upper left quarter and middle, the same in all four."""
    return {(i * y, j * x): weight for (y, x), weight in taps.items() for i in (-1, 1) for j in (-1, 1)}


def _turned(taps: Filter) -> Filter:
    return {(x, y): weight for (y, x), weight in taps.items()}


_BESIDE = {"bilinear": _symmetric({(0, 1): 4.0}), "malvar": _symmetric({(0, 0): 5.0, (0, 1): 4.0, (1, 1): -1.0, (0, 2): -1.0, (2, 0): 0.5})}
"""Red or blue at a green pixel whose neighbours in the row have it."""
_CROSS = {
    "bilinear": _symmetric({(0, 1): 2.0, (1, 0): 2.0}),
    "malvar": _symmetric({(0, 0): 4.0, (0, 1): 2.0, (1, 0): 2.0, (0, 2): -1.0, (2, 0): -1.0}),
}
"""Green at a red or blue pixel."""
_DIAGONAL = {"bilinear": _symmetric({(1, 1): 2.0}), "malvar": _symmetric({(0, 0): 6.0, (1, 1): 2.0, (0, 2): -1.5, (2, 0): -1.5})}
"""Red at a blue pixel, blue at a red one."""


def mosaic(light: NDArray[np.float32], pattern: str) -> NDArray[np.float32]:
    """Return what the pixels behind a Bayer filter see (height, width) of light (height, width, 3)."""
    seen = np.empty(light.shape[:2], np.float32)
    for corner, channel in enumerate(PATTERNS[pattern]):
        at = slice(corner // 2, None, 2), slice(corner % 2, None, 2)
        seen[at] = light[..., channel][at]
    return seen


def demosaic(seen: NDArray[np.float32], pattern: str, method: str) -> NDArray[np.float32]:
    """Return linear colour (height, width, 3) from a mosaic; beyond its edges it is mirrored.  Nothing of it is negative.

    ``seen``: (height, width), linear; ``pattern``: a key of ``PATTERNS``; ``method``: ``bilinear`` or ``malvar``.
    """
    height, width = seen.shape
    padded = np.pad(seen, 2, mode="reflect") if min(height, width) > 1 else np.pad(seen, 2, mode="edge")
    channels = PATTERNS[pattern]
    color = np.empty((height, width, 3), np.float32)
    for corner, own in enumerate(channels):
        row, column = corner // 2, corner % 2
        beside = channels[corner ^ 1]
        for channel in range(3):
            at = (slice(row, None, 2), slice(column, None, 2), channel)
            if channel == own:
                color[at] = seen[at[:2]]
            elif own == 1:
                taps = _BESIDE[method] if channel == beside else _turned(_BESIDE[method])
                color[at] = _filtered(padded, row, column, taps, color[at].shape)
            else:
                color[at] = _filtered(padded, row, column, (_CROSS if channel == 1 else _DIAGONAL)[method], color[at].shape)
    return np.maximum(color, np.float32(0.0), out=color)


def _filtered(padded: NDArray[np.float32], row: int, column: int, taps: Filter, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return a filter's answer at every second pixel from (row, column) on, an image of this shape."""
    total = np.zeros(shape, np.float32)
    for (y, x), weight in taps.items():
        top, left = 2 + row + y, 2 + column + x
        total += np.float32(weight / 8.0) * padded[top : top + 2 * shape[0] : 2, left : left + 2 * shape[1] : 2]
    return total
