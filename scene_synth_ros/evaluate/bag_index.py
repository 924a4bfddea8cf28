"""What a bag holds for an evaluation, told from one reading without keeping any image: rooms, stamps of topics, poses, names of classes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.camera_streams import is_scene
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError
from scene_synth_ros.evaluate.readings import StampedPose, read_message
from scene_synth_ros.evaluate.rooms import Rooms, json_object
from scene_synth_ros.evaluate.task_streams import POSES
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.messages.stamps import stamp_ns


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
        faults: of the bag; lines for people.
    """

    path: Path
    rooms: Rooms = field(default_factory=Rooms)
    stamps: dict[str, Counter[int]] = field(default_factory=dict)
    unstamped: Counter[str] = field(default_factory=Counter)
    poses: dict[str, dict[int, StampedPose]] = field(default_factory=dict)
    class_names: dict[int, str] = field(default_factory=dict)
    faults: tuple[str, ...] = ()


def bag_types(path: Path) -> dict[str, str]:
    """Return the topics of a bag, with their types.

    Raises:
        BagReadError: the bag cannot be read at all.
    """
    with BagReader(path) as reader:
        return {topic.name: topic.type_name for topic in reader.summary.topics}


def index_bag(path: Path, topics: Collection[TypedTopic], labels: str = "") -> BagIndex:
    """Read a bag once.

    Args:
        path: of the bag.
        topics: whose stamps are asked for.
        labels: topic of the JSON labels of classes; empty for none.

    Raises:
        BagReadError: the bag cannot be read at all.
    """
    index = BagIndex(path=path)
    by_name: dict[str, list[TypedTopic]] = {}
    for topic in topics:
        by_name.setdefault(topic.in_bag, []).append(topic)
        index.stamps[topic.name] = Counter()
    with BagReader(path) as reader:
        scenes = {topic.name for topic in reader.summary.topics if is_scene(topic.name, topic.type_name)}
        for message in reader.messages({*by_name, *scenes, *((labels,) if labels else ())}):
            if message.topic in scenes:
                index.rooms.add(message.data, message.log_ns)
            elif message.topic == labels and not index.class_names:
                index.class_names = read_class_names(message.data)
            for topic in by_name.get(message.topic, ()):
                _take(index, topic, message.data)
        index.faults = tuple(reader.faults)
    return index


def _take(index: BagIndex, topic: TypedTopic, data: bytes) -> None:
    if topic.type_name in POSES:
        try:
            reading = read_message(topic.type_name, data, topic.name)
        except EstimateError:
            index.unstamped[topic.name] += 1
            return
        found = index.poses.setdefault(topic.name, {})
        for pose in reading.value:
            index.stamps[topic.name][pose.stamp_ns] = 1
            found[pose.stamp_ns] = pose
        return
    stamp = stamp_ns(topic.type_name, data)
    if stamp is None:
        index.unstamped[topic.name] += 1
    else:
        index.stamps[topic.name][stamp] += 1


def read_class_names(data: bytes) -> dict[int, str]:
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
