"""Pictures for people of layers that hold numbers: distances, directions, ids, light, noise."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.film.tone import encode_srgb
from scene_description.labels import instance_palette, label_palette

FAR_M = 6.0
"""Where the colours of distances end."""
MIDDLE_GREY = 0.18
"""Of white, what the mean of linear colour becomes in its picture."""

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


class Picture(NamedTuple):
    """How people see a layer: in words, and image -> uint8 or uint16 (height, width), or uint8 (height, width, 3)."""

    words: str
    of: Callable[[NDArray[Any]], NDArray[Any]]


def depth_to_color(depth_m: NDArray[np.float32], far_m: float = FAR_M) -> NDArray[np.uint8]:
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


def classes_to_color(ids: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return NYU40 class ids as (height, width, 3) uint8 in the standard's colours."""
    return np.take(_class_palette(), ids, axis=0)


def objects_to_color(ids: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return object ids as (height, width, 3) uint8: a colour for each id, black for 0."""
    return np.take(_object_palette(), ids, axis=0)


def exposed_to_color(radiance: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return linear colour (height, width, 3) as sRGB by the filmic curve, so exposed that its mean is ``MIDDLE_GREY``."""
    return encode_srgb(radiance * np.float32(MIDDLE_GREY / max(float(radiance.mean()), 1e-9)), "filmic")


def noise_to_grey(variance: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the deviation of the mean (height, width) as grey: white is the 99th percentile of the image; NaN is black."""
    deviation = np.sqrt(np.nan_to_num(variance.mean(axis=2, dtype=np.float64)))
    most = float(np.percentile(deviation, 99.0))
    return np.clip(np.rint(255.0 * deviation / most), 0, 255).astype(np.uint8) if most > 0.0 else np.zeros(deviation.shape, np.uint8)


@cache
def _class_palette() -> NDArray[np.uint8]:
    """Return the (256, 3) uint8 colours of the classes, black for ids that are none."""
    palette = np.zeros((256, 3), np.uint8)
    palette[: len(label_palette())] = label_palette()
    return palette


@cache
def _object_palette() -> NDArray[np.uint8]:
    return instance_palette(1 << 16)


AS_IT_IS = Picture("as it is", lambda image: image)
DISTANCE = Picture(f"violet at 0 to dark red at {FAR_M:g} m; no hit is black", depth_to_color)
DIRECTION = Picture("x, y, z from -1 to 1 as red, green, blue; no hit is black", normals_to_color)
CLASSES = Picture("the standard's colours", classes_to_color)
OBJECTS = Picture("a colour for each id; 0 is black", objects_to_color)
REFLECTANCE = Picture("sRGB", encode_srgb)
EXPOSED = Picture(f"filmic curve, the mean at {MIDDLE_GREY:g} of white", exposed_to_color)
NOISE = Picture("standard error as grey, its 99th percentile white", noise_to_grey)
