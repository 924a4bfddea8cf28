"""From fields to bytes: slopes of a relief, texels packed, the next smaller level of a tile."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import srgb_from_linear
from renderer.core.kernel import entry, inlined
from renderer.textures.noise import Field

Texel = TypeVar("Texel", bound=np.generic)
CHANNELS = 8
SLOPE_U, SLOPE_V, SQUARE = 5, 6, 7
"""Places of a texel's slopes, and of the mean square of the slopes below it, while it is a float."""

_STEPS = 1 << 14
SRGB_BYTES = np.floor(255.0 * srgb_from_linear(np.arange(_STEPS + 1) / _STEPS) + 0.5).astype(np.uint8)
"""sRGB byte of linear luminance 0, 1/16384, ... 1: where the curve is steepest a step is a fifth of a byte."""


_EDGE_LOG = 3
"""Texels lie in blocks of 8 x 8, row by row within them: rows of a power of two would share cache lines' places and spread over pages."""


def in_blocks(texels: NDArray[Texel]) -> NDArray[Texel]:
    """Return texels (h, w), powers of two, in the order of :func:`texel_place`, (h * w,)."""
    height, width = texels.shape
    down, across = min(height, 1 << _EDGE_LOG), min(width, 1 << _EDGE_LOG)
    return texels.reshape(height // down, down, width // across, across).swapaxes(1, 2).reshape(-1)


@inlined
def texel_place(column: int, line: int, log_w: int, log_h: int) -> int:
    """Return where the texel of a column and a line lies, which repeat beyond the sides; ``log_w``, ``log_h``: logarithms of these."""
    column, line = column & ((1 << log_w) - 1), line & ((1 << log_h) - 1)
    across, down = min(log_w, _EDGE_LOG), min(log_h, _EDGE_LOG)
    block = ((line >> down) << (log_w + down)) + ((column >> across) << (across + down))
    return block + ((line & ((1 << down) - 1)) << across) + (column & ((1 << across) - 1))


def fill_slopes(fields: NDArray[np.float32], height: Field, units: tuple[float, float]) -> None:
    """Write the central differences of a periodic height (h, w) into a tile's fields (8, h, w); ``units``: the tile's sides."""
    steps = [np.float32(fields.shape[axis] / (2.0 * unit)) for unit, axis in zip(units, (2, 1), strict=True)]
    _fill_slopes(np.ascontiguousarray(height, np.float32), steps[0], steps[1], fields)


@entry
def _fill_slopes(height: NDArray[np.float32], per_u: np.float32, per_v: np.float32, fields: NDArray[np.float32]) -> None:
    rows, columns = height.shape
    for row in range(rows):
        over, under, here = (row + 1) % rows, row - 1 if row else rows - 1, row
        for column in range(1, columns - 1):
            fields[SLOPE_U, row, column] = (height[here, column + 1] - height[here, column - 1]) * per_u
        fields[SLOPE_U, row, 0] = (height[here, 1 % columns] - height[here, columns - 1]) * per_u
        fields[SLOPE_U, row, columns - 1] = (height[here, 0] - height[here, columns - 2]) * per_u
        for column in range(columns):
            fields[SLOPE_V, row, column] = (height[over, column] - height[under, column]) * per_v


@entry
def scale_slopes(fields: NDArray[np.float32]) -> np.float32:
    """Divide the slopes of a tile's fields (8, h, w) by the steepest, which is returned, and write their squares."""
    steepest = np.float32(1e-6)
    for row in range(fields.shape[1]):
        for column in range(fields.shape[2]):
            steepest = max(steepest, abs(fields[SLOPE_U, row, column]), abs(fields[SLOPE_V, row, column]))
    scale = np.float32(1.0) / steepest
    for row in range(fields.shape[1]):
        for column in range(fields.shape[2]):
            u, v = fields[SLOPE_U, row, column] * scale, fields[SLOPE_V, row, column] * scale
            fields[SLOPE_U, row, column], fields[SLOPE_V, row, column], fields[SQUARE, row, column] = u, v, u * u + v * v
    return steepest


@entry
def pack_texels(fields: NDArray[np.float32], picture: bool, srgb: NDArray[np.uint8], packed: NDArray[np.uint8]) -> None:
    """Write the fields (8, h, w) of one level as texels (h, w, 8); see ``tile`` for what their bytes mean."""
    zero, half, most, level, reach = np.float32(0.0), np.float32(0.5), np.float32(255.0), np.float32(128.5), np.float32(127.0)
    one, steps = np.float32(1.0), np.float32(len(srgb) - 1)
    for row in range(fields.shape[1]):
        for column in range(fields.shape[2]):
            for k in range(3):
                value = min(max(fields[k, row, column], zero), one)
                packed[row, column, k] = srgb[int(value * steps + half)] if picture else np.uint8(value * most + half)
            for k in range(3, 5):
                packed[row, column, k] = np.uint8(min(max(fields[k, row, column] * most + half, zero), most))
            u, v = fields[SLOPE_U, row, column], fields[SLOPE_V, row, column]
            packed[row, column, SLOPE_U] = np.uint8(min(max(level + reach * u, zero), most))
            packed[row, column, SLOPE_V] = np.uint8(min(max(level + reach * v, zero), most))
            rest = np.sqrt(half * max(fields[SQUARE, row, column] - u * u - v * v, zero))
            packed[row, column, SQUARE] = np.uint8(min(rest * most + half, most))


@entry
def halve_fields(fields: NDArray[np.float32], halved: NDArray[np.float32]) -> None:
    """Write the means of 2 x 2 texels, or of two where a side is one texel already, (8, h, w) each."""
    down, across = fields.shape[1] // halved.shape[1], fields.shape[2] // halved.shape[2]
    share = np.float32(0.25)
    for k in range(CHANNELS):
        for row in range(halved.shape[1]):
            first, second = down * row, down * row + down - 1
            for column in range(halved.shape[2]):
                left, right = across * column, across * column + across - 1
                halved[k, row, column] = share * (
                    fields[k, first, left] + fields[k, first, right] + fields[k, second, left] + fields[k, second, right]
                )
