"""What a bag holds for an evaluation, told from one reading without keeping any image: rooms, stamps of topics, poses, names of classes."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from evaluation.evaluation_file import TruthRecord
from scene_description import CameraPose
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.indexed_bag import IndexedBag
from scene_synth_ros.bags.run_info import PARAMETERS_NAME, read_parameters
from scene_synth_ros.dataset.rooms import RoomsByStart
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError
from scene_synth_ros.evaluate.readings import read_message
from scene_synth_ros.evaluate.task_streams import POSES
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.evaluate.truth_facts import camera_facts, label_facts, read_class_names, run_facts
from scene_synth_ros.messages.streams import SCENE, find_streams


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
    poses: dict[str, dict[int, CameraPose]] = field(default_factory=dict)
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
                told |= label_facts(message)
                break
    if info:
        told |= next((camera_facts(message) for _, message in bag.messages(info)), {})
    if labels or info:
        with BagReader(path) as reader:
            nodes = read_parameters(reader.summary.attachments.get(PARAMETERS_NAME, b""))
        index.truth = TruthRecord(**told, **run_facts(nodes))
    for topic in topics:
        _take(index, topic, bag)
    return index


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
