"""The topics that are recorded: found as they appear, subscribed to, judged by who publishes them."""

from __future__ import annotations

import fnmatch
from collections import Counter
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node

from scene_synth_ros.messages.detections import AnnotationsReadError, annotations_topic, is_annotations, read_annotations
from scene_synth_ros.messages.image_codec import raw_topic
from scene_synth_ros.messages.label_info import LabelReadError, is_labels, labels_topic, read_labels
from scene_synth_ros.messages.message_definitions import MessageDefinitionError, message_class
from scene_synth_ros.messages.scan_messages import LASER, has_own_stamps
from scene_synth_ros.messages.stamps import sent_before
from scene_synth_ros.messages.timed_pose import PoseReadError, read_pose
from scene_synth_ros.record.recorder_config import RecorderConfig
from scene_synth_ros.record.recorder_qos import complete_qos, matching_qos
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.record.senders import Senders
from scene_synth_ros.suite.connections import publishers_of
from scene_synth_ros.suite.status import NodeStatus

QUEUE_DEPTH = 200
_LOOKS_A_JUDGEMENT = 10
"""Topics whose publishers are as many as before are judged again at every tenth look."""


class TopicInputs:
    """Subscriptions to everything that is recorded, as raw CDR with the QoS that its publishers offer.

    Threads: the thread of the node's executor only.

    Args:
        node: whose subscriptions they are.
        config: which topics.
        recording: takes the messages.
        received: counts what arrives, by topic.
        warn: called with one line for a topic that cannot be recorded.

    Attributes:
        known: every topic that was considered; 0, or -1 for those that are left out.
        dds_lost: messages that DDS says were lost on the way, by topic.
    """

    def __init__(
        self, node: Node, config: RecorderConfig, recording: Recording, received: Counter[str], warn: Callable[[str], None]
    ) -> None:
        self._node, self._config, self._recording, self._received, self._warn = node, config, recording, received, warn
        self._namespace = str(node.get_namespace().rstrip("/") + "/")
        self._senders = Senders(lambda topic: publishers_of(node, topic), self._namespace)
        self._publishers: dict[str, int] = {}
        self._looks = 0
        self.known: dict[str, int] = {}
        self.dds_lost: Counter[str] = Counter()

    def take_status(self, status: NodeStatus) -> None:
        """Take a node's status: what it publishes is the suite's."""
        before = self._senders.suite_is_present
        if not self._senders.take_status(status):
            return
        if self._senders.suite_is_present and not before:
            self._recording.begin_suite()
        self._judge_all()

    def look(self) -> None:
        """Subscribe to topics that have appeared, judge those whose publishers have changed; to be called now and then."""
        for topic, types in sorted(self._node.get_topic_names_and_types()):
            if topic not in self.known and self._node.get_publishers_info_by_topic(topic):
                self.known[topic] = 0 if self._is_recorded(topic) and self._subscribe(topic, types[0]) else -1
        self._looks += 1
        self._judge_all(changed_only=self._looks % _LOOKS_A_JUDGEMENT != 0)

    def _judge_all(self, changed_only: bool = False) -> None:
        for topic in self._publishers:
            count = self._node.count_publishers(topic)
            if not changed_only or count != self._publishers[topic]:
                self._publishers[topic] = count
                self._recording.set_origin(topic, self._senders.judge(topic))

    def _is_recorded(self, topic: str) -> bool:
        """Return whether the parameters ask for a topic.

        What comes next is left out, as it will come on ``scene``, and what the recorder makes itself: of the suite's images the form that
        ``images.*`` asks for, of labels the LabelInfo, of annotations the detections.
        """
        config = self._config
        if topic in ("/tf", "/tf_static") or topic == self._node.resolve_topic_name("status"):
            return False
        if not config.topics and (topic.endswith("/transition_event") or topic == self._node.resolve_topic_name("scene/next")):
            return False
        made_of = raw_topic(topic) or labels_topic(topic) or annotations_topic(topic)
        source = made_of if topic.startswith(self._namespace) else ""
        if source and self._node.count_publishers(source) and self._is_recorded(source):
            return False
        chosen = (*(config.topics or (f"{self._namespace}*", "/clock", "/diagnostics")), *config.extra_topics)
        return any(fnmatch.fnmatchcase(topic, pattern) for pattern in chosen) and not any(
            fnmatch.fnmatchcase(topic, pattern) for pattern in config.exclude
        )

    def _subscribe(self, topic: str, type_name: str) -> bool:
        offered = [complete_qos(info.qos_profile) for info in self._node.get_publishers_info_by_topic(topic)]
        try:
            message_type = message_class(type_name)
            self._recording.add_topic(topic, type_name, offered, self._senders.judge(topic))
        except (ImportError, AttributeError, MessageDefinitionError) as error:
            self._warn(f"{topic} is left out: {type_name} cannot be loaded ({error})")
            return False
        events = SubscriptionEventCallbacks(message_lost=lambda event: self.dds_lost.update({topic: event.total_count_change}))
        callback = self._make_callback(topic, type_name)
        self._node.create_subscription(message_type, topic, callback, matching_qos(offered, QUEUE_DEPTH), raw=True, event_callbacks=events)
        self._publishers[topic] = self._node.count_publishers(topic)
        return True

    def _make_callback(self, topic: str, type_name: str) -> Any:
        camera = topic.rsplit("/", 2)[-2] if type_name == "geometry_msgs/msg/PoseStamped" and topic.endswith("/pose") else ""
        own_stamps = has_own_stamps(topic)
        settings = topic.endswith("/settings") and type_name == "std_msgs/msg/String"
        labels = is_labels(topic, type_name)
        annotations = topic.startswith(self._namespace) and is_annotations(topic, type_name)

        def on_message(data: bytes) -> None:
            self._received[topic] += 1
            if settings and (sent := sent_before(data)) is not None:
                self._recording.add_sent(sent.stamp_ns, {self._namespace + name: stamp for name, stamp in sent.stamps_ns.items()})
            if self._recording.add(topic, data):
                derive(data)
            if own_stamps:
                self._recording.reach(topic, data)

        def derive(data: bytes) -> None:
            try:
                if camera == LASER:
                    self._recording.add_laser_pose(read_pose(data))
                elif camera:
                    self._recording.add_pose(read_pose(data), camera)
                if labels:
                    self._recording.add_labels(read_labels(data), topic)
                if annotations:
                    self._recording.add_annotations(read_annotations(data), topic)
            except PoseReadError as error:
                self._warn(f"{topic}: {error}; it has no transform")
            except LabelReadError as error:
                self._warn(f"{topic}: {error}; it has no LabelInfo")
            except AnnotationsReadError as error:
                self._warn(f"{topic}: {error}; it has no detections")

        return on_message
