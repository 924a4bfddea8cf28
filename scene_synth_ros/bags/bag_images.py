"""The layers in a bag: which topic holds each, the pixels of a message, compressed or not, and their picture for people."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from renderer.film.layer import Layer
from scene_synth_ros.bags.bag_reader import BagMessage
from scene_synth_ros.messages.image_reader import COMPRESSED_TYPE, IMAGE_TYPE, read_image

Item = TypeVar("Item")

FORMS: tuple[tuple[str, Callable[[str], tuple[str, ...]]], ...] = (
    (IMAGE_TYPE, lambda layer: (f"/{layer}/image_raw",)),
    (COMPRESSED_TYPE, lambda layer: (f"/{layer}/image_raw/compressed", f"/{layer}/image_raw/compressedDepth")),
)
"""Type of a layer's topic -> ends of its name, the first that is found is drawn."""


def layer_topics(types: Mapping[str, str]) -> dict[str, str]:
    """Return layer -> topic of the first camera."""
    found = {
        layer: next((name for kind, ends in FORMS for name in sorted(types) if types[name] == kind and name.endswith(ends(layer))), None)
        for layer in LAYERS
    }
    return {layer: topic for layer, topic in found.items() if topic is not None}


def read_pixels(message: BagMessage) -> NDArray[Any]:
    """Return the image of a message, compressed or not.

    Raises:
        CodecError: it cannot be read.
    """
    return read_image(message.type_name, message.data, message.topic).pixels


def layer_picture(layer: Layer, pixels: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return the picture of a layer, uint8, of pixels as they come out of a bag: distances may be whole millimetres."""
    if layer.dtype == "float32" and pixels.dtype == np.uint16:
        pixels = pixels.astype(np.float32) / np.float32(1000.0)
    return np.minimum(layer.picture.of(pixels.astype(layer.dtype, copy=False)), 255).astype(np.uint8)


def spread(items: Sequence[Item], count: int) -> list[Item]:
    """Return ``count`` of the items, evenly spread and away from both ends; all of them where they are no more."""
    shown = min(count, len(items))
    return [items[int((i + 0.5) * len(items) / shown)] for i in range(shown)]
