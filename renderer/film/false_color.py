"""Pictures for people of layers that hold numbers: depth, normals, ids."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

DEPTH_STOPS = np.array(
    [
        [0.19, 0.07, 0.23],
        [0.27, 0.51, 0.98],
        [0.10, 0.89, 0.71],
        [0.64, 0.99, 0.24],
        [0.98, 0.73, 0.22],
        [0.85, 0.22, 0.03],
        [0.48, 0.02, 0.01],
    ]
)
"""Colours from near to far, evenly spaced: a coarse rainbow of rising and falling lightness."""


def depth_to_color(depth_m: NDArray[np.float32], far_m: float) -> NDArray[np.uint8]:
    """Return depth as (height, width, 3) uint8: violet at 0, dark red at ``far_m`` and beyond, black where there is none."""
    valid = np.isfinite(depth_m)
    position = np.clip(np.where(valid, depth_m, 0.0) / far_m, 0.0, 1.0) * (len(DEPTH_STOPS) - 1)
    index = np.arange(len(DEPTH_STOPS))
    channels = [np.interp(position, index, DEPTH_STOPS[:, channel]) for channel in range(3)]
    color = np.rint(np.stack(channels, axis=-1) * 255.0).astype(np.uint8)
    color[~valid] = 0
    return color


def normals_to_color(normals: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return unit normals as (n / 2 + 1 / 2) * 255 per channel, black where there is none."""
    color: NDArray[np.uint8] = np.rint((normals * np.float32(0.5) + np.float32(0.5)) * np.float32(255.0)).astype(np.uint8)
    color[~normals.any(axis=2)] = 0
    return color


def ids_to_color(ids: NDArray[Any], palette: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an id image as (height, width, 3) uint8 by table look-up; the palette covers every id."""
    return np.take(palette, ids, axis=0)


def noise_to_grey(variance: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the deviation of the mean (height, width) as grey: white is the 99th percentile of the image; NaN is black."""
    deviation = np.sqrt(np.nan_to_num(variance.mean(axis=2, dtype=np.float64)))
    most = float(np.percentile(deviation, 99.0))
    return np.clip(np.rint(255.0 * deviation / most), 0, 255).astype(np.uint8) if most > 0.0 else np.zeros(deviation.shape, np.uint8)
