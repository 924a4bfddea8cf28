"""Pictures for people of layers that hold numbers: distances, directions, ids, light, noise."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from scene_description.labels import instance_palette, label_palette, occlusion_labels

FAR_M = 6.0
"""Where the colours of distances end."""
NO_SHARE = (40, 60, 140)
"""Colour of pixels that have no share: sRGB."""
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
    x, y, z = np.moveaxis(normals, 2, 0)
    color[(x == 0.0) & (y == 0.0) & (z == 0.0)] = 0
    return color


def classes_to_color(ids: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return NYU40 class ids as (height, width, 3) uint8 in the standard's colours."""
    return np.take(_class_palette(), ids, axis=0)


def objects_to_color(ids: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return object ids as (height, width, 3) uint8: a colour for each id, black for 0."""
    return np.take(_object_palette(), ids, axis=0)


def reflectance_to_color(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return linear colour (height, width, 3), 1 for white, as sRGB."""
    from renderer.film.tone import encode_srgb  # a kernel: who only knows the layers, as a recorder does, needs no numba

    return encode_srgb(linear)


def exposed_to_color(radiance: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return linear colour (height, width, 3) as sRGB by the filmic curve, so exposed that its mean is ``MIDDLE_GREY``."""
    from renderer.film.tone import encode_srgb

    return encode_srgb(radiance * np.float32(MIDDLE_GREY / max(float(radiance.mean()), 1e-9)), "filmic")


def noise_to_grey(variance: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the deviation of the mean (height, width) as grey: white is the 99th percentile of the image; NaN is black."""
    deviation = np.sqrt(np.nan_to_num(variance.mean(axis=2, dtype=np.float64)))
    most = float(np.percentile(deviation, 99.0))
    return np.clip(np.rint(255.0 * deviation / most), 0, 255).astype(np.uint8) if most > 0.0 else np.zeros(deviation.shape, np.uint8)


def metres_to_color(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return lengths (height, width, 2 or 3) as red, green, blue, dark at even metres, full at odd ones; black where there is none."""
    return unit_to_color(np.float32(1.0) - np.abs(values % np.float32(2.0) - np.float32(1.0)))


def unit_to_color(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return numbers (height, width, 2 or 3) from 0 to 1 as red, green, blue; black where there is none."""
    color = np.zeros((*values.shape[:2], 3), np.uint8)
    known = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    color[..., : values.shape[2]] = np.rint(np.clip(known, 0.0, 1.0) * 255.0)
    return color


def share_to_grey(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return numbers (height, width) from 0 to 1 as grey, (height, width, 3) uint8: black to white, ``NO_SHARE`` where there is none."""
    grey = np.rint(np.clip(np.nan_to_num(values), 0.0, 1.0) * 255.0).astype(np.uint8)
    return np.where(np.isnan(values)[..., None], np.array(NO_SHARE, np.uint8), grey[..., None])


def angle_to_grey(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return angles (height, width) from 0 to a right angle as grey, black to white, ``NO_SHARE`` where there is none."""
    return share_to_grey(values * np.float32(2.0 / np.pi))


def states_to_color(ids: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return states of occlusion as (height, width, 3) uint8 in the colours of their labels."""
    return np.take(np.array([row["color"] for row in occlusion_labels().values()], np.uint8), np.minimum(ids, 3), axis=0)


def flow_to_color(flow_px: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return flow (height, width, 2) as (height, width, 3) uint8: hue is direction, saturation length, full at the 99th percentile.

    Red goes right, further hues clockwise; what does not move is white, what has no flow black.
    """
    known = np.isfinite(flow_px).all(axis=2)
    u, v = (np.where(known, flow_px[..., axis], 0.0) for axis in (0, 1))
    length = np.hypot(u, v)
    most = max(float(np.percentile(length[known].astype(np.float64), 99.0)), 1e-6) if known.any() else 1.0
    sector = (el.arctan2(v, u) / (2.0 * np.pi) % 1.0)[..., None] * 6.0 + np.array([5.0, 3.0, 1.0])
    hue = 1.0 - np.clip(np.minimum(sector % 6.0, 4.0 - sector % 6.0), 0.0, 1.0)
    color: NDArray[np.uint8] = np.rint(255.0 * (1.0 - np.clip(length / most, 0.0, 1.0)[..., None] * (1.0 - hue))).astype(np.uint8)
    color[~known] = 0
    return color


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
REFLECTANCE = Picture("sRGB", reflectance_to_color)
EXPOSED = Picture(f"filmic curve, the mean at {MIDDLE_GREY:g} of white", exposed_to_color)
NOISE = Picture("standard error as grey, its 99th percentile white", noise_to_grey)
METRES = Picture("red, green, blue: dark at even metres, full at odd ones; no hit is black", metres_to_color)
UNIT_CUBE = Picture("0 to 1 as red, green, blue; no hit is black", unit_to_color)
SHARE = Picture("0 black to 1 white; NaN is blue", share_to_grey)
ANGLE = Picture("0 black to a right angle white; NaN is blue", angle_to_grey)
STATES = Picture("visible white, hidden red, outside blue, unknown black", states_to_color)
MOTION = Picture("direction as hue, length as saturation; none is black", flow_to_color)
