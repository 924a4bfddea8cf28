"""Periodic noise on tiles: bands of frequencies by FFT, and cells about scattered points.

Tiles are (h, w) float32 arrays; column x and row y of a texel stand for u = (x + 0.5) / w and v = (y + 0.5) / h of the tile.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
    height, width = shape
    fx = np.fft.rfftfreq(width, 1.0 / width).astype(np.float32)[None, :] * np.float32(stretch[0])
    fy = np.fft.fftfreq(height, 1.0 / height).astype(np.float32)[:, None] * np.float32(stretch[1])
    square = fx * fx + fy * fy
    square[0, 0] = 1e6
    gain = np.exp(-square / np.float32(high * high)) * square ** np.float32(-0.5 * slope)
    gain[square < low * low] = 0.0
    gain[0, 0] = 0.0
    power = float((gain.astype(np.float64) ** 2).sum())
    spectrum = rng.standard_normal((*gain.shape, 2), np.float32).view(np.complex64)[..., 0]
    spectrum *= gain * np.float32(height * width / math.sqrt(max(4.0 * power, 1e-30)))
    field: Field = np.fft.irfft2(spectrum, s=shape).astype(np.float32)
    return field


def cells(rng: np.random.Generator, shape: Shape, across: int, down: int, jitter: float = 0.9) -> Cells:
    """Return cells about one point in each square of an (across x down) lattice, moved by up to ``jitter`` / 2 of a square; periodic."""
    px, py = (((rng.random((down, across), np.float32) - np.float32(0.5)) * np.float32(jitter)) + np.float32(0.5) for _ in range(2))
    u, v = coordinates(shape)
    x, y = u * np.float32(across), v * np.float32(down)
    ix, iy = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    nearest = np.full(shape, 9.0, np.float32)
    second = np.full(shape, 9.0, np.float32)
    index = np.zeros(shape, np.int32)
    for sy in (-1, 0, 1):
        for sx in (-1, 0, 1):
            cx, cy = ix + sx, iy + sy
            row, column = cy % down, cx % across
            dx = px[row, column] + (cx - x)
            dy = py[row, column] + (cy - y)
            square = dx * dx + dy * dy
            closer = square < nearest
            second = np.where(closer, nearest, np.minimum(second, square))
            nearest = np.where(closer, square, nearest)
            index = np.where(closer, row * across + column, index)
    return Cells(index, np.sqrt(nearest), np.sqrt(second))


def smooth_step(low: float | Field, high: float | Field, value: Field) -> Field:
    """Return 0 below ``low``, 1 above ``high``, and the cubic ramp between; ``low`` > ``high`` turns it round."""
    t = np.clip((value - low) / (np.asarray(high, np.float32) - np.asarray(low, np.float32)), 0.0, 1.0).astype(np.float32)
    ramp: Field = t * t * (np.float32(3.0) - np.float32(2.0) * t)
    return ramp


def per_cell(rng: np.random.Generator, index: NDArray[np.integer], count: int) -> Field:
    """Return one even random number in [0, 1) per cell, spread over its texels."""
    table = rng.random(count, np.float32)
    spread: Field = table[index]
    return spread
