"""Periodic noise on tiles: bands of frequencies by FFT, and cells about scattered points.

Tiles are (h, w) float32 arrays; column x and row y of a texel stand for u = (x + 0.5) / w and v = (y + 0.5) / h of the tile.
"""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.kernel import entry

Field = NDArray[np.floating[Any]]
Shape = tuple[int, int]


class Cells(NamedTuple):
    """Cells about scattered points: for each texel the nearest point's ``number``, and the distances to the two nearest, in cell sizes."""

    number: NDArray[np.int32]
    nearest: Field
    second: Field


def coordinates(shape: Shape) -> tuple[Field, Field]:
    """Return u (1, w) and v (h, 1) of the texels' centres in [0, 1)."""
    height, width = shape
    u = ((np.arange(width) + 0.5) / width).astype(np.float32)
    v = ((np.arange(height) + 0.5) / height).astype(np.float32)
    return u[None, :], v[:, None]


def noise(
    rng: np.random.Generator, shape: Shape, low: float, high: float, slope: float = 1.0, stretch: tuple[float, float] = (1.0, 1.0)
) -> Field:
    """Return periodic Gaussian noise of mean 0 and standard deviation 1.

    Args:
        rng: source of randomness.
        shape: (h, w).
        low: lowest frequency, cycles per tile.
        high: highest frequency, cycles per tile, fading out softly beyond.
        slope: amplitude falls as frequency ** -slope.
        stretch: how much longer features are along u and v.
    """
    small = tuple(min(count, _power_of_two(8.0 * high / long)) for count, long in zip(shape, stretch[::-1], strict=True))
    if small != tuple(shape):
        return _enlarged(noise(rng, (small[0], small[1]), low, high, slope, stretch), shape)
    height, width = shape
    gain = _gain((height, width), low, high, slope, stretch)
    spectrum = rng.standard_normal((*gain.shape, 2), np.float32).view(np.complex64)[..., 0]
    spectrum *= gain
    # In double precision: numpy before 2.0 knows no other, and what the last digits of versions differ by is rounded off.
    field: Field = np.fft.irfft2(spectrum.astype(np.complex128), s=shape).astype(np.float32)
    return field


@lru_cache(maxsize=32)
def _gain(shape: Shape, low: float, high: float, slope: float, stretch: tuple[float, float]) -> NDArray[np.float32]:
    """Return the amplitudes (h, w // 2 + 1) that make noise of standard deviation 1; see :func:`noise`."""
    height, width = shape
    fx = np.fft.rfftfreq(width, 1.0 / width).astype(np.float32)[None, :] * np.float32(stretch[0])
    fy = np.fft.fftfreq(height, 1.0 / height).astype(np.float32)[:, None] * np.float32(stretch[1])
    square = fx * fx + fy * fy
    square[0, 0] = 1e6
    gain = el.exp(-square / np.float32(high * high)) * el.power(square, np.float32(-0.5 * slope))
    gain[square < low * low] = 0.0
    gain[0, 0] = 0.0
    power = float((gain.astype(np.float64) ** 2).sum())
    scaled: NDArray[np.float32] = gain * np.float32(height * width / math.sqrt(max(4.0 * power, 1e-30)))
    return scaled


def _power_of_two(least: float) -> int:
    """Return the smallest power of two >= ``least``, at least 16."""
    return 1 << max(4, math.ceil(math.log2(least)))


def _enlarged(field: Field, shape: Shape) -> Field:
    """Return a periodic field with more texels, linear in between."""
    for axis in (0, 1):
        old, new = field.shape[axis], shape[axis]
        if old == new:
            continue
        place = (np.arange(new) + 0.5) * (old / new) - 0.5
        first = np.floor(place).astype(np.int64)
        part = (place - first).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        before, after = np.take(field, first % old, axis), np.take(field, (first + 1) % old, axis)
        field = before + part * (after - before)
    return field


def cells(rng: np.random.Generator, shape: Shape, across: int, down: int, jitter: float = 0.9) -> Cells:
    """Return cells about one point in each square of an (across x down) lattice, moved by up to ``jitter`` / 2 of a square; periodic."""
    points = (rng.random((2, down, across), np.float32) - np.float32(0.5)) * np.float32(jitter) + np.float32(0.5)
    number, nearest, second = np.empty(shape, np.int32), np.empty(shape, np.float32), np.empty(shape, np.float32)
    _find_cells(points, number, nearest, second)
    return Cells(number, nearest, second)


@entry
def _find_cells(points: NDArray[np.float32], number: NDArray[np.int32], nearest: NDArray[np.float32], second: NDArray[np.float32]) -> None:
    """Fill the fields of :class:`Cells`; ``points`` (2, down, across): place of each point in its square, x and y."""
    height, width = number.shape
    _, down, across = points.shape
    for row in range(height):
        y = np.float32((row + 0.5) * down / height)
        iy = int(y)
        for column in range(width):
            x = np.float32((column + 0.5) * across / width)
            ix = int(x)
            best, other, owner = np.float32(9.0), np.float32(9.0), 0
            for step in range(3):
                cy = iy + (step if step < 2 else -1)
                off = max(np.float32(cy) - y, y - np.float32(cy + 1), np.float32(0.0))
                if off * off >= other:
                    continue
                line = (cy + down) % down
                for cx in range(ix - 1, ix + 2):
                    place = (cx + across) % across
                    dx, dy = points[0, line, place] + np.float32(cx) - x, points[1, line, place] + np.float32(cy) - y
                    square = dx * dx + dy * dy
                    if square < best:
                        best, other, owner = square, best, line * across + place
                    elif square < other:
                        other = square
            number[row, column], nearest[row, column], second[row, column] = owner, np.sqrt(best), np.sqrt(other)


def smooth_step(low: float | Field, high: float | Field, value: Field) -> Field:
    """Return 0 below ``low``, 1 above ``high``, and the cubic ramp between; ``low`` > ``high`` turns it round."""
    if np.ndim(low) == np.ndim(high) == 0:
        ramp = np.empty(np.shape(value), np.float32)
        _fill_ramp(np.float32(low), np.float32(high), np.ascontiguousarray(value, np.float32).reshape(-1), ramp.reshape(-1))
        return ramp
    t = np.clip((value - low) / (np.asarray(high, np.float32) - np.asarray(low, np.float32)), 0.0, 1.0).astype(np.float32)
    cubic: Field = t * t * (np.float32(3.0) - np.float32(2.0) * t)
    return cubic


@entry
def _fill_ramp(low: np.float32, high: np.float32, value: NDArray[np.float32], ramp: NDArray[np.float32]) -> None:
    scale = np.float32(1.0) / (high - low)
    for k in range(len(value)):
        t = min(max((value[k] - low) * scale, np.float32(0.0)), np.float32(1.0))
        ramp[k] = t * t * (np.float32(3.0) - np.float32(2.0) * t)


def covered(distance: Field, half_width: float, texel: float) -> Field:
    """Return which share of a texel lies within ``half_width`` of a line, given the distance of its middle, all in one unit."""
    share: Field = np.clip((half_width - distance) / texel + 0.5, 0.0, min(1.0, 2.0 * half_width / texel)).astype(np.float32)
    return share


def per_cell(rng: np.random.Generator, index: NDArray[np.integer], count: int) -> Field:
    """Return one even random number in [0, 1) per cell, spread over its texels."""
    table = rng.random(count, np.float32)
    spread: Field = table[index]
    return spread
