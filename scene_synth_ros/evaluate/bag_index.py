"""What a bag holds for an evaluation, told from one reading without keeping any image: rooms, stamps of topics, poses, names of classes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo

from evaluation.evaluation_file import TruthRecord
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.indexed_bag import IndexedBag
from scene_synth_ros.bags.run_info import PARAMETERS_NAME, read_parameters
from scene_synth_ros.dataset.rooms import RoomsByStart
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError
from scene_synth_ros.evaluate.readings import StampedPose, read_message
from scene_synth_ros.evaluate.task_streams import POSES
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.messages.cdr import json_object
from scene_synth_ros.messages.stamps import CdrBytes
from scene_synth_ros.messages.streams import SCENE, find_streams

_MAX_TEXT, _MOST_COEFFICIENTS = 400, 14


@dataclass(slots=True, kw_only=True)
class BagIndex:
    """What was found.

    Attributes:
        path: of the bag.
        rooms: by their first stamps; none, or one, where a bag has no scene descriptions.
        stamps: topic -> stamp -> how many messages have it.
        unstamped: topic -> messages that have no stamp, or cannot be read.
        poses: topic -> stamp -> pose, the newest of each stamp: a trajectory may be sent again, corrected.
        class_names: class id -> name, as the truth's labels say.
        truth: what the bag tells of camera, classes and run.
    """

    path: Path
    rooms: RoomsByStart = field(default_factory=RoomsByStart)
    stamps: dict[str, Counter[int]] = field(default_factory=dict)
    unstamped: Counter[str] = field(default_factory=Counter)
    poses: dict[str, dict[int, StampedPose]] = field(default_factory=dict)
    class_names: dict[int, str] = field(default_factory=dict)
    truth: TruthRecord = field(default_factory=TruthRecord)


def index_bag(bag: IndexedBag, path: Path, topics: Collection[TypedTopic], labels: str = "", info: str = "") -> BagIndex:
    """Find out what a bag holds; of images nothing is read where the bag's own index tells their stamps.

    ``labels``: topic of the JSON labels of classes; ``info``: of the camera's CameraInfo; empty for none.
    """
    index = BagIndex(path=path)
    scenes = list(find_streams(bag.types, SCENE))
    bag.prepare({*(topic.in_bag for topic in topics), *scenes, *filter(None, (labels, info))})
    for scene in scenes:
        for stamp, message in bag.messages(scene):
            index.rooms.add(message, stamp)
    told: dict[str, Any] = {}
    if labels:
        for _, message in bag.messages(labels):
            index.class_names = read_class_names(message)
            if index.class_names:
                told["label_standard"] = _text(json_object(message).get("standard", "nyu40"))
                break
    if info:
        told |= next((_camera_facts(message) for _, message in bag.messages(info)), {})
    if labels or info:
        index.truth = TruthRecord(**told, **_run_facts(path))
    for topic in topics:
        _take(index, topic, bag)
    return index


def _camera_facts(message: CdrBytes) -> dict[str, Any]:
    """Return what a CameraInfo tells; nothing of one that cannot be read or whose numbers are not finite."""
    try:
        info = deserialize_message(bytes(message), CameraInfo)
    except (RuntimeError, ValueError):
        return {}
    numbers = [round(float(info.k[place]), 2) for place in (0, 4, 2, 5)], [round(float(value), 6) for value in info.d[:_MOST_COEFFICIENTS]]
    if not all(map(math.isfinite, chain(*numbers))):
        return {}
    size = {"image_width": info.width, "image_height": info.height}
    return {**size, "camera_model": _text(info.distortion_model), "intrinsics": tuple(numbers[0]), "distortion": tuple(numbers[1])}


def _run_facts(path: Path) -> dict[str, Any]:
    """Return what the parameters in a bag tell of its rooms."""
    with BagReader(path) as reader:
        nodes = read_parameters(reader.summary.attachments.get(PARAMETERS_NAME, b""))
    grammar = next((values for name, values in sorted(nodes.items()) if name.rpartition("/")[2] == "grammar_node"), {})
    found: dict[str, Any] = {}
    if "scene.room_type" in grammar:
        found["room_types"] = _text(grammar["scene.room_type"])
    if "grammar_file" in grammar:  # folders differ between machines
        found["grammar"] = _text(Path(str(grammar["grammar_file"])).name) or "that of the program"
    if type(grammar.get("seed")) is int and grammar["seed"] >= 0:
        found["seed"] = grammar["seed"]
    return found


def _text(value: object) -> str:
    """Return a text of unknown origin as a file can hold it."""
    return "".join(letter if letter.isprintable() else "?" for letter in str(value)[:_MAX_TEXT])


def _take(index: BagIndex, topic: TypedTopic, bag: IndexedBag) -> None:
    index.unstamped[topic.name] = bag.unstamped[topic.in_bag]
    if topic.type_name not in POSES:
        index.stamps[topic.name] = Counter(bag.counts(topic.in_bag))
        return
    index.stamps[topic.name] = Counter()
    found = index.poses.setdefault(topic.name, {})
    for _, message in bag.messages(topic.in_bag):
        try:
            poses = read_message(topic.type_name, message, topic.name).value
        except EstimateError:
            index.unstamped[topic.name] += 1
            continue
        for pose in poses:
            index.stamps[topic.name][pose.stamp_ns] = 1
            found[pose.stamp_ns] = pose


def read_class_names(data: CdrBytes) -> dict[int, str]:
    """Return class id -> name of serialised JSON labels; empty if they are none."""
    labels = json_object(data).get("labels")
    rows = labels.items() if isinstance(labels, Mapping) else ()
    return {int(key): str(row["name"]) for key, row in rows if key.isdecimal() and isinstance(row, Mapping) and "name" in row}


def refuse_empty(index: BagIndex, topic: TypedTopic, what: str) -> None:
    """Refuse a topic without a single stamped message.

    Raises:
        EvaluateError: it has none.
    """
    if not index.stamps[topic.name]:
        frame = topic.name.partition("@")[2]
        what += f" with transforms of the frame '{frame}'" if frame else ""
        odd = f", but {index.unstamped[topic.name]} that cannot be read" if index.unstamped[topic.name] else ""
        raise EvaluateError(
            f"{index.path}: topic {topic.name}: expected {what}, got no message with a stamp{odd}; choose another topic, or record it again"
        )
