"""All buffers of one view, and the table that says what each layer holds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Layer(NamedTuple):
    """What a buffer holds: numpy dtype, channels (0: none), unit or meaning, value of pixels without a hit."""

    dtype: str
    channels: int
    meaning: str
    no_hit: str


LAYERS: dict[str, Layer] = {
    "color": Layer("uint8", 3, "sRGB display colour", "background luminance"),
    "depth": Layer("float32", 0, "metres along the optical z axis", "+inf"),
    "range": Layer("float32", 0, "metres along the ray", "+inf"),
    "normals": Layer("float32", 3, "geometric unit normal, optical frame, towards the camera", "0"),
    "semantic": Layer("uint8", 0, "NYU40 class id", "0"),
    "instance": Layer("uint16", 0, "object id, 0 for the room's shell", "0"),
    "color_noisy": Layer("uint8", 3, "color before denoising", "background luminance"),
    "albedo": Layer("float32", 3, "linear base colour of what is seen first, 1 for glass and lit lamps, mean of the colour's samples", "0"),
    "radiance": Layer("float32", 3, "linear colour, RGB luminance in cd/m2, neither exposed nor balanced", "background luminance"),
    "variance": Layer("float32", 3, "variance of the linear colour before denoising, (cd/m2)^2; NaN after one sample", "as elsewhere"),
    "samples": Layer("uint16", 0, "samples per pixel that colour is the mean of", "as elsewhere"),
}
"""Every layer that a frame can hold, by name; depth and range are NaN, all else 0, where the lens sees nothing."""

COLOR_LAYERS = ("color", "color_noisy", "radiance", "variance", "samples")
"""Layers for which light is traced."""

SAMPLED_LAYERS = (*COLOR_LAYERS, "albedo")
"""Layers that are means of samples: they carry noise, and the blur of whatever the lens or the shutter blurs."""

GEOMETRIC_LAYERS = ("depth", "range", "normals", "semantic", "instance")


class Frame(NamedTuple):
    """One view: layer name -> image, (height, width) or (height, width, 3), C-contiguous, dtype as ``LAYERS`` says.

    ``radiance`` is the linear colour behind ``color``: (height, width, 3) float32, RGB luminance in cd/m2; None where colour was
    not asked for.  ``samples``: how many samples per pixel colour and albedo took, 0 where they were not asked for.
    ``rays``: how many rays were traced for all layers, shadow rays among them.
    """

    layers: dict[str, NDArray[np.generic]]
    radiance: NDArray[np.float32] | None
    samples: int = 0
    rays: int = 0
