"""The layers in a bag: which topic holds each, the pixels of a message, compressed or not, and their picture for people."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from renderer.film.layer import Layer
from scene_synth_ros.bags.bag_reader import BagMessage
from scene_synth_ros.messages.image_reader import read_image
from scene_synth_ros.messages.streams import find_images

Item = TypeVar("Item")


def layer_topics(types: Mapping[str, str]) -> dict[str, str]:
    """Return layer -> topic of the first camera."""
    first: dict[str, str] = {}
    for image, topic in find_images(types).items():
        first.setdefault(image.layer, topic)
    return {layer: first[layer] for layer in LAYERS if layer in first}


def read_pixels(message: BagMessage) -> NDArray[Any]:
    """Return the image of a message, compressed or not.

    Raises:
        CodecError: it cannot be read.
    """
    return read_image(message.type_name, message.data, message.topic).pixels


def has_channels(pixels: NDArray[Any], layer: str) -> bool:
    """Return whether an image has the channels of its layer."""
    return (pixels.shape[2] if pixels.ndim == 3 else 1) == LAYERS[layer].channels


def layer_picture(layer: Layer, pixels: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return the picture of a layer, uint8, of pixels as they come out of a bag: distances may be whole millimetres."""
    if layer.dtype == "float32" and pixels.dtype == np.uint16:
        pixels = pixels.astype(np.float32) / np.float32(1000.0)
    picture: NDArray[np.uint8] = np.minimum(layer.picture.of(pixels.astype(layer.dtype, copy=False)), 255).astype(np.uint8)
    return picture


def spread(items: Sequence[Item], count: int) -> list[Item]:
    """Return ``count`` of the items, evenly spread and away from both ends; all of them where they are no more."""
    shown = min(count, len(items))
    return [items[int((i + 0.5) * len(items) / shown)] for i in range(shown)]
