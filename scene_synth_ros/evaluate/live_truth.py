"""What the truth's camera, classes and run are, heard while an algorithm is judged."""

from collections.abc import Mapping
from typing import Any

from sensor_msgs.msg import CameraInfo
from std_msgs.msg import String

from evaluation.evaluation_file import TruthRecord, common_truth
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.evaluate.truth_facts import camera_facts, label_facts, read_class_names, run_facts
from scene_synth_ros.messages.streams import IMAGE_FORMS, INFO, LABELS, Stream, parse
from scene_synth_ros.suite.parameter_collector import ParameterCollector
from scene_synth_ros.suite.qos import PROFILES, latched_qos
from scene_synth_ros.suite.status import NodeStatus
from scene_synth_ros.suite.suite_node import SuiteNode


class LiveTruth:
    """Gathers the facts of a ``TruthRecord`` as a bag of the same run would tell them.

    Subscribes: the camera_info beside the truth, the labels of classes, ``status``, which names the grammar node: its parameters are asked
    for.
    Threads: that of the node's executor only.

    ``camera``: whose labels count where no topic of the truth says one.

    Attributes:
        class_names: class id -> name, as the labels say; empty until they have come.
    """

    def __init__(self, node: SuiteNode, truth: Mapping[str, TypedTopic], camera: str) -> None:
        self.class_names: dict[int, str] = {}
        self._told: dict[str, Any] = {}
        self._collector = ParameterCollector(node, self._take_parameters)
        self.step = self._collector.step
        streams = [stream for stream in (parse(topic.name) for topic in truth.values()) if stream is not None]
        images = [stream for stream in streams if stream.role in IMAGE_FORMS]
        base = streams[0].base if streams else camera
        if images:
            node.create_subscription(CameraInfo, images[0].beside(INFO).topic, self._take_info, PROFILES["sensor_data"], raw=True)
        node.create_subscription(String, Stream(base, LABELS, "semantic").topic, self._take_labels, latched_qos(), raw=True)
        node.hear_status(self._take_status, node.refuse)

    def record(self) -> TruthRecord | None:
        """Return what is known; None where that is nothing."""
        return common_truth([TruthRecord(**self._told)])

    def _take_info(self, message: bytes) -> None:
        self._told |= camera_facts(message)

    def _take_labels(self, message: bytes) -> None:
        names = read_class_names(message)
        if names:
            self.class_names, self._told = names, self._told | label_facts(message)

    def _take_status(self, status: NodeStatus) -> None:
        if status.role == "grammar":
            self._collector.ask(status.node)

    def _take_parameters(self, nodes: dict[str, dict[str, Any]]) -> None:
        for values in nodes.values():
            self._told |= run_facts({"grammar_node": values})
