"""Images of chosen frames, taken from bags: by their stamps, from the topics of layers or from topics that are named."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from scene_synth_ros.bags.bag_images import layer_topics, read_pixels
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.messages.image_codec import CodecError
from scene_synth_ros.messages.stamps import stamp_ns

Images = dict[int, dict[str, NDArray[Any]]]
"""Stamp -> layer -> pixels."""

_UNREADABLE = (CodecError, RuntimeError, ValueError, KeyError, IndexError, TypeError, OverflowError)
"""What a message that was damaged, or made to do harm, may raise while it is read."""


def frame_images(bag: Path, layers: Collection[str], stamps: Collection[int], topics: Mapping[str, str]) -> tuple[Images, list[str]]:
    """Return the images of some frames, and lines for people about what is missing.

    Args:
        bag: folder of the bag or one of its files.
        layers: names of the table of layers.
        stamps: of the frames, nanoseconds.
        topics: layer -> topic, in place of the layer's topic of the first camera.
    """
    found: Images = {stamp: {} for stamp in stamps}
    notes: list[str] = []
    try:
        with BagReader(bag) as reader:
            types = {topic.name: topic.type_name for topic in reader.summary.topics}
            layer_of = {topic: layer for layer, topic in (layer_topics(types) | topics).items() if layer in layers and topic in types}
            left = {(stamp, layer) for stamp in stamps for layer in layer_of.values()}
            for message in reader.messages(layer_of.keys()) if left else ():
                stamp, layer = stamp_ns(message.type_name, message.data), layer_of[message.topic]
                if (stamp, layer) not in left or stamp is None:
                    continue
                left.remove((stamp, layer))
                try:
                    pixels = read_pixels(message)
                    if not pixels.size or pixels.dtype.kind not in "uif":
                        raise ValueError("an image without numbers")
                    found[stamp][layer] = pixels
                except _UNREADABLE as error:
                    notes.append(f"{bag}: {message.topic}: an image cannot be shown ({' '.join(str(error).split())[:100]})")
                if not left:
                    break
    except (BagReadError, OSError) as error:
        notes.append(" ".join(str(error).split())[:300])
    return found, notes


def fits(pixels: NDArray[Any] | None, layer: str) -> bool:
    """Return whether there is an image, and it has the channels of its layer."""
    return pixels is not None and (pixels.shape[2] if pixels.ndim == 3 else 1) == LAYERS[layer].channels


def reduced(pixels: NDArray[Any], max_size: int) -> NDArray[Any]:
    """Return an image whose longer side has at most so many pixels; whole rows and columns are left out, evenly."""
    step = max(1.0, max(pixels.shape[:2]) / max_size)
    rows, columns = (np.minimum(((np.arange(max(1, round(n / step))) + 0.5) * step).astype(np.int64), n - 1) for n in pixels.shape[:2])
    return pixels[rows][:, columns]
