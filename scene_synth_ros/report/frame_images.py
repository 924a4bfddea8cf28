"""Images of chosen frames, taken from bags by their stamps, and the topics that hold truth and estimates."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from renderer import LAYERS
from scene_synth_ros.bags.bag_images import layer_topics
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.indexed_bag import IndexedBag, MessageReadError, open_bag
from scene_synth_ros.mcap.contents import McapReadError
from scene_synth_ros.messages.image_reader import CodecError, read_image
from scene_synth_ros.messages.streams import ESTIMATES, IMAGE_FORMS, LABELS, RAW, find_streams

Images = dict[int, dict[str, NDArray[Any]]]
"""Stamp -> layer -> pixels."""
TopicsOf = Callable[[Mapping[str, str]], Mapping[str, str]]
"""Topic -> type of a bag -> layer -> the topic to take it from."""

_UNREADABLE = (CodecError, MessageReadError, RuntimeError, ValueError, KeyError, IndexError, TypeError, OverflowError)
"""What a message that was damaged, or made to do harm, may raise while it is read."""


def truth_topics(camera: str) -> TopicsOf:
    """Return what finds the topics of the truth, of a camera by its name; empty: of the first."""

    def find(types: Mapping[str, str]) -> Mapping[str, str]:
        images = {name: stream for name, stream in find_streams(types, *IMAGE_FORMS).items() if stream.base != ESTIMATES}
        return layer_topics({name: types[name] for name, stream in images.items() if not camera or stream.is_of(camera)})

    return find


def estimate_topics(chosen: str, layer: str, camera: str, *, same_bag: bool) -> TopicsOf:
    """Return what finds the topic of the estimates of a layer: the chosen one, else that of estimates.

    Else it is, in a bag of estimates, the layer's own name; in the bag of the truth what the camera's modelled sensor has read.
    """

    def find(types: Mapping[str, str]) -> Mapping[str, str]:
        if chosen:
            return {layer: chosen}
        named = layer_topics({name: types[name] for name, stream in find_streams(types, *IMAGE_FORMS).items() if stream.base == ESTIMATES})
        if layer in named or not same_bag:
            return named if layer in named else layer_topics(types)
        own = sorted((name, stream) for name, stream in find_streams(types, RAW).items() if stream.layer == f"{layer}_sensed")
        return {layer: next((name for name, stream in own if not camera or stream.is_of(camera)), "")}

    return find


def frame_images(bag: Path, layers: Collection[str], stamps: Collection[int], topics_of: TopicsOf) -> tuple[Images, list[str]]:
    """Return the images of some frames, and lines for people about what is missing.

    Args:
        bag: folder of the bag or one of its files.
        layers: names of the table of layers.
        stamps: of the frames, nanoseconds.
        topics_of: finds the topics of the layers.
    """
    found: Images = {stamp: {} for stamp in stamps}
    notes: list[str] = []
    try:
        opened = open_bag(bag)
        topics = {layer: topic for layer, topic in topics_of(opened.types).items() if layer in layers and topic in opened.types}
        opened.prepare(topics.values())
        for layer, topic in topics.items():
            for stamp in stamps:
                try:
                    if (topic, stamp) in opened:
                        found[stamp][layer] = _image(opened, topic, stamp)
                except _UNREADABLE as error:
                    notes.append(f"{bag}: {topic}: an image cannot be shown ({' '.join(str(error).split())[:100]})")
    except (BagReadError, McapReadError, OSError) as error:
        notes.append(" ".join(str(error).split())[:300])
    return found, notes


def _image(bag: IndexedBag, topic: str, stamp: int) -> NDArray[Any]:
    pixels = read_image(bag.types[topic], bag.read(topic, stamp), topic).pixels
    if not pixels.size or pixels.dtype.kind not in "uif":
        raise ValueError("an image without numbers")
    return pixels


def class_names(bag: Path) -> dict[int, str]:
    """Return the names of the classes as the labels of a bag tell them, nothing where it has none."""
    try:
        with BagReader(bag) as reader:
            topics = [topic for topic, stream in find_streams(reader.types, LABELS).items() if stream.layer == "semantic"]
            message = next(reader.messages(topics), None) if topics else None
            labels = json.loads(deserialize_message(message.data, String).data)["labels"] if message else {}
            return {int(key): str(row["name"])[:100].replace("_", " ") for key, row in labels.items()}
    except (BagReadError, OSError, AttributeError, *_UNREADABLE):
        return {}


def fits(pixels: NDArray[Any] | None, layer: str) -> bool:
    """Return whether there is an image, and it has the channels of its layer."""
    return pixels is not None and (pixels.shape[2] if pixels.ndim == 3 else 1) == LAYERS[layer].channels


def reduced(pixels: NDArray[Any], max_size: int) -> NDArray[Any]:
    """Return an image whose longer side has at most so many pixels; whole rows and columns are left out, evenly."""
    step = max(1.0, max(pixels.shape[:2]) / max_size)
    rows, columns = (np.minimum(((np.arange(max(1, round(n / step))) + 0.5) * step).astype(np.int64), n - 1) for n in pixels.shape[:2])
    smaller: NDArray[Any] = pixels[rows][:, columns]
    return smaller
