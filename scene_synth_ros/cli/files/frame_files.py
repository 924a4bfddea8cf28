"""A frame as files: NPZ with every layer as it is, PNG of each for people, EXR of all of them as layers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS, Frame
from renderer.files.exr_files import write_exr
from renderer.files.image_io import write_png
from renderer.film.layers import check_layers, layers_in
from scene_description.label_standards import StandardName


def write_frame(base: Path, frame: Frame, *, exr: bool = False, standard: StandardName = "nyu40") -> None:
    """Write ``<base>.npz``, ``<base>_<layer>.png`` and, if asked, ``<base>.exr``; ``standard`` is that of the class ids.

    Raises:
        RenderError: a layer is unknown or not what its row of the layer table says, before anything is written; or a file cannot be made.
        OSError: a file cannot be written.
    """
    shown, channels = pictures(frame.layers, standard), exr_channels(frame) if exr else {}
    np.savez_compressed(base.with_suffix(".npz"), **frame.layers)
    for name, picture in shown.items():
        write_png(base.with_name(f"{base.name}_{name}.png"), picture)
    if exr:
        write_exr(base.with_suffix(".exr"), channels)


def pictures(layers: Mapping[str, NDArray[Any]], standard: StandardName = "nyu40") -> dict[str, NDArray[Any]]:
    """Return what people can look at, by layer: uint8 or uint16 (height, width), or uint8 (height, width, 3).

    Raises:
        RenderError: a layer is unknown or not what its row says.
    """
    check_layers(layers)
    rows = layers_in(standard)
    return {name: rows[name].picture.of(image) for name, image in layers.items()}


def exr_channels(frame: Frame) -> dict[str, NDArray[Any]]:
    """Return the channels of an EXR file, float32 or uint32: R, G, B are the linear radiance in cd/m2, layers have names of their own.

    Raises:
        RenderError: a layer is unknown or not what its row says.
    """
    layers: dict[str, NDArray[Any]] = {} if frame.radiance is None else {"radiance": frame.radiance}
    layers |= frame.layers
    check_layers(layers)
    channels: dict[str, NDArray[Any]] = {}
    for name, image in layers.items():
        row = LAYERS[name]
        values = image.astype(np.float32 if row.dtype == "float32" else np.uint32, copy=False).reshape(*image.shape[:2], row.channels)
        channels |= {channel: values[..., i] for i, channel in enumerate(row.exr)}
    return channels
