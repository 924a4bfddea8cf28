"""Equirectangular maps of the whole sphere: zenith in the first row, +x in the middle column, columns clockwise as seen from above."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array


def pixel_solid_angles(height: int, width: int) -> NDArray[np.float64]:
    """Return the solid angle in steradian of the pixels of each row (height,) of an equirectangular map."""
    edges = el.sin(np.linspace(0.5 * np.pi, -0.5 * np.pi, height + 1))
    return np.asarray((edges[:-1] - edges[1:]) * (2.0 * np.pi / width))


def map_directions(height: int, width: int) -> Array:
    """Return the unit directions (height, width, 3) of the pixels of an equirectangular map: zenith above, +x in the middle, clockwise."""
    elevation = math.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    yaw = math.pi - 2.0 * math.pi * (np.arange(width) + 0.5) / width
    level = el.cos(elevation)
    return np.stack(np.broadcast_arrays(level * el.cos(yaw), level * el.sin(yaw), el.sin(elevation)), axis=-1)
