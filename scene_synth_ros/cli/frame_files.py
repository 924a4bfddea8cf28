"""A frame as files: NPZ with every layer as it is, PNG of each for people, EXR of all of them as layers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer import Frame
from renderer.files.exr_files import write_exr
from renderer.files.image_io import write_png
from renderer.film.false_color import depth_to_color, ids_to_color, noise_to_grey, normals_to_color
from renderer.film.tone import encode_srgb
from scene_description.labels import instance_palette, label_palette

FAR_M = 6.0

_AXES = {"normals": "XYZ", "albedo": "RGB", "variance": "RGB"}
_SCALARS = {"depth": "depth.Z", "range": "range.Z", "semantic": "semantic.id", "instance": "instance.id", "samples": "samples.count"}


def write_frame(base: Path, frame: Frame, *, exr: bool = False) -> None:
    """Write ``<base>.npz``, ``<base>_<layer>.png`` and, if asked, ``<base>.exr``."""
    layers: dict[str, NDArray[Any]] = dict(frame.layers)
    np.savez_compressed(base.with_suffix(".npz"), **layers)
    for name, picture in pictures(layers).items():
        write_png(base.with_name(f"{base.name}_{name}.png"), picture)
    if exr:
        write_exr(base.with_suffix(".exr"), exr_channels(frame))


def pictures(layers: dict[str, NDArray[Any]]) -> dict[str, NDArray[np.uint8] | NDArray[np.uint16]]:
    """Return what people can look at, by layer."""
    made: dict[str, NDArray[np.uint8] | NDArray[np.uint16]] = {}
    for name, image in layers.items():
        if name in ("color", "color_noisy"):
            made[name] = image
        elif name == "albedo":
            made[name] = encode_srgb(image)
        elif name in ("depth", "range"):
            made[name] = depth_to_color(image, FAR_M)
        elif name == "normals":
            made[name] = normals_to_color(image)
        elif name == "semantic":
            made[name] = ids_to_color(image, label_palette())
        elif name == "instance":
            made[name] = ids_to_color(image, instance_palette(int(image.max()) + 1))
        elif name == "radiance":
            made[name] = encode_srgb(image * np.float32(0.18 / max(float(image.mean()), 1e-9)), "filmic")
        elif name == "variance":
            made[name] = noise_to_grey(image)
        else:
            made[name] = image.astype(np.uint16)
    return made


def exr_channels(frame: Frame) -> dict[str, NDArray[Any]]:
    """Return the channels of an EXR file: R, G, B are the linear radiance in cd/m2, layers have names of their own."""
    channels: dict[str, NDArray[Any]] = {}
    if frame.radiance is not None:
        channels |= {name: frame.radiance[..., i] for i, name in enumerate("RGB")}
    for name, image in frame.layers.items():
        if name in _AXES:
            channels |= {f"{name}.{axis}": np.asarray(image[..., i], np.float32) for i, axis in enumerate(_AXES[name])}
        elif name in _SCALARS:
            channels[_SCALARS[name]] = np.asarray(image, np.float32 if name in ("depth", "range") else np.uint32)
    return channels
