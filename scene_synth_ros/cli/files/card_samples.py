"""Frames of a dataset that stand for all: one of each of some rooms, evenly spread, with the numbers that a card tells of their images."""

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from scene_description import SceneDescription, scene_from_json
from scene_synth_ros.bags.bag_images import layer_topics, read_pixels, spread
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.dataset_files import shard_folder
from scene_synth_ros.messages.streams import LABELS, SCENE, find_streams
from scene_synth_ros.shards.completion import Manifest, ShardError
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.synthesize.room_schedule import FrameTimes

ROOMS_SAMPLED = 48


class SampledFrame(NamedTuple):
    """The middle frame of a room: its images by layer, of the first camera, and the names of its semantic ids."""

    scene: SceneDescription
    images: Mapping[str, NDArray[Any]]
    classes: Mapping[int, str]


def sampled_frames(
    plan: DatasetPlan, manifest: Manifest, bag_of: Callable[[int], AbstractContextManager[Path]], count: int = ROOMS_SAMPLED
) -> Iterator[SampledFrame]:
    """Yield the middle frame of at most ``count`` rooms all over a dataset; ``bag_of`` gives the folder of a shard's bag.

    Raises:
        ShardError: a shard cannot be read, or has lost a room since it was made.
    """
    run = plan.settings_of(0).run
    times = FrameTimes(round(run.start_time_s * 1e9), run.rate_hz)
    rooms = spread([(completion["shard"], row["index"]) for completion in manifest["shards"] for row in completion["rooms"]], count)
    for shard, of_shard in groupby(rooms, lambda room: room[0]):
        with bag_of(shard) as bag, _opened(bag, shard) as reader:
            for _, room in of_shard:
                first = room * plan.frames
                frame = _frame(reader, times.stamp_ns(first), times.stamp_ns(first + plan.frames // 2))
                if frame is None:
                    raise _damaged(shard, f"expected the description of room {room}, got none")
                yield frame


def _opened(bag: Path, shard: int) -> BagReader:
    try:
        return BagReader(bag)
    except BagReadError as error:
        raise _damaged(shard, str(error)) from None


def _damaged(shard: int, fault: str) -> ShardError:
    return ShardError(f"{shard_folder(shard)}: {fault}; scene_synth generate --resume --check makes a damaged shard again")


def _frame(reader: BagReader, start_ns: int, stamp_ns: int) -> SampledFrame | None:
    """Return the frame at a stamp of the room that begins at another; None if the bag has no description of the room."""
    layers = {topic: layer for layer, topic in layer_topics(reader.types).items()}
    scenes = find_streams(reader.types, SCENE)
    labels = [topic for topic, stream in find_streams(reader.types, LABELS).items() if stream.layer == "semantic"]
    text = next((message.data for message in reader.messages(scenes, start_ns) if message.log_ns == start_ns), None)
    if text is None:
        return None
    images, classes = {}, {}
    for message in reader.messages({*layers, *labels}, stamp_ns):
        if message.log_ns > stamp_ns:
            break
        if message.topic in layers:
            images[layers[message.topic]] = read_pixels(message)
        else:
            told = json.loads(deserialize_message(message.data, String).data)["labels"]
            classes = {int(key): str(value["name"]) for key, value in told.items()}
    return SampledFrame(scene_from_json(deserialize_message(text, String).data), images, classes)


class ImageNumbers:
    """Sums up frames: shares of classes, distances, brightness."""

    def __init__(self) -> None:
        self.frames = 0
        self.pixels: Counter[str] = Counter()
        self.seen: Counter[str] = Counter()
        self._series: dict[str, list[float]] = {}

    def take(self, frame: SampledFrame) -> None:
        """Take a frame."""
        self.frames += 1
        semantic = frame.images.get("semantic")
        if semantic is not None:
            ids, counts = np.unique(semantic, return_counts=True)
            names = [frame.classes.get(int(number), "void") for number in ids]
            for name, count in zip(names, counts, strict=True):
                self.pixels[name] += int(count)
            self.seen.update(names)
            self._add("classes in a frame", float(len(ids)))
        if (instance := frame.images.get("instance")) is not None:
            self._add("objects in a frame", float(len(np.unique(instance[instance > 0]))))
        if (depth := frame.images.get("depth")) is not None:
            metres = depth / 1000.0 if depth.dtype == np.uint16 else depth.astype(np.float64)
            hit = metres[np.isfinite(metres) & (metres > 0.0)]
            self._add("pixels without depth (%)", 100.0 * (1.0 - hit.size / metres.size))
            for name, share in (("nearest 5 % of depth (m)", 5), ("median depth (m)", 50), ("farthest 5 % of depth (m)", 95)):
                if hit.size:
                    self._add(name, float(np.percentile(hit, share)))
        if (color := frame.images.get("color")) is not None:
            self._add("mean of red, green, blue (0 to 255)", float(color.mean()))
            self._add("contrast: standard deviation (0 to 255)", float(color.mean(axis=2).std()))
            self._add("pixels at the white end (%)", 100.0 * float((color >= 255).all(axis=2).mean()))
            self._add("pixels at the black end (%)", 100.0 * float((color <= 0).all(axis=2).mean()))

    def _add(self, name: str, value: float) -> None:
        self._series.setdefault(name, []).append(value)

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Return name, least, median, mean and most of each number over the frames."""
        return [spread_row(name, values) for name, values in self._series.items()]


def spread_row(name: str, values: Sequence[float]) -> tuple[str, str, str, str, str]:
    """Return a row of a table: the name, then least, median, mean and most."""
    numbers = (min(values), float(np.median(values)), float(np.mean(values)), max(values))
    least, median, mean, most = (f"{number:.2f}".rstrip("0").rstrip(".") for number in numbers)
    return name, least, median, mean, most
