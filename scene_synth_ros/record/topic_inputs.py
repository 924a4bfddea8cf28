"""The topics that are recorded: found as they appear, subscribed to, judged by who publishes them."""

import fnmatch
from collections import Counter
from collections.abc import Callable, Sequence
from itertools import chain

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy

from scene_synth_ros.messages import streams
from scene_synth_ros.messages.message_definitions import MessageDefinitionError, message_class
from scene_synth_ros.record.frame_topics import made_of
from scene_synth_ros.record.recorder_config import RecorderConfig
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.record.senders import Senders
from scene_synth_ros.suite.connections import publishers_of
from scene_synth_ros.suite.qos import BURST_DEPTH
from scene_synth_ros.suite.rclpy_internals import waiting
from scene_synth_ros.suite.status import NodeStatus
from scene_synth_ros.suite.suite_node import SuiteNode


def complete_qos(offered: QoSProfile) -> QoSProfile:
    """Fill in history and depth, which discovery does not tell, as latched and stream publishers of this package have them."""
    depth = 1 if offered.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL else 10
    return QoSProfile(history=QoSHistoryPolicy.KEEP_LAST, depth=depth, reliability=offered.reliability, durability=offered.durability)


def matching_qos(offered: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """Return the strongest QoS that every publisher meets, as ``ros2 bag record`` chooses it."""
    reliable = all(qos.reliability == QoSReliabilityPolicy.RELIABLE for qos in offered)
    latched = all(qos.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL for qos in offered)
    return QoSProfile(
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=QoSReliabilityPolicy.RELIABLE if reliable else QoSReliabilityPolicy.BEST_EFFORT,
        durability=QoSDurabilityPolicy.TRANSIENT_LOCAL if latched else QoSDurabilityPolicy.VOLATILE,
    )


_PASSING = ("scene/next", "simulation/request", "simulation/response")
"""Topics of the suite that say nothing of a room."""


def is_chosen(topic: str, config: RecorderConfig, namespace: str, is_published: Callable[[str], object]) -> bool:
    """Return whether the parameters ask for a topic.

    What comes next is left out, as it will come on ``scene``, how the run is steered, and what the recorder makes itself: of the suite's
    images the form that ``images.*`` asks for, of labels the LabelInfo, of annotations the detections.
    """
    if topic in ("/tf", "/tf_static", f"{namespace}status"):
        return False
    if not config.topics and (topic.endswith("/transition_event") or topic.removeprefix(namespace) in _PASSING):
        return False
    source = made_of(topic) if topic.startswith(namespace) else ""
    if source and is_published(source) and is_chosen(source, config, namespace, is_published):
        return False
    chosen = (*(config.topics or (f"{namespace}*", "/clock", "/diagnostics")), *config.extra_topics)
    return any(fnmatch.fnmatchcase(topic, pattern) for pattern in chosen) and not any(
        fnmatch.fnmatchcase(topic, pattern) for pattern in config.exclude
    )


QUEUE_DEPTH = 200
_LARGE = (streams.IMAGE_TYPE, streams.COMPRESSED_TYPE, streams.CLOUD_TYPE)
"""Types of which no more than ``QUEUE_DEPTH`` messages wait; of others a whole burst may."""
_TAKEN_TOGETHER = 100
"""Messages of a topic that are taken before it is another's turn."""
_LOOKS_A_JUDGEMENT = 10
"""Topics whose publishers are as many as before are judged again at every tenth look."""


class TopicInputs:
    """Subscriptions to everything that is recorded, as raw CDR with the QoS that its publishers offer.

    Threads: the thread of the node's executor only.

    Attributes:
        known: every topic that was considered; 0, or -1 for those that are left out.
        dds_lost: messages that DDS says were lost on the way, by topic.
    """

    def __init__(self, node: SuiteNode, config: RecorderConfig, recording: Recording, received: Counter[str]) -> None:
        self._node, self._config, self._recording, self._received = node, config, recording, received
        self._namespace = str(node.get_namespace().rstrip("/") + "/")
        awaits_suite = config.exit_when_done  # with the grammar node of a run
        self._senders = Senders(lambda topic: publishers_of(node, topic), self._namespace, node.strangers, awaits_suite=awaits_suite)
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
        return is_chosen(topic, self._config, self._namespace, self._node.count_publishers)

    def _subscribe(self, topic: str, type_name: str) -> bool:
        offered = [complete_qos(info.qos_profile) for info in self._node.get_publishers_info_by_topic(topic)]
        try:
            message_type = message_class(type_name)
            self._recording.add_topic(topic, type_name, offered, self._senders.judge(topic))
        except (ImportError, AttributeError, MessageDefinitionError) as error:
            self._node.refuse(f"{topic} is left out: {type_name} cannot be loaded ({error})")
            return False
        qos = matching_qos(offered, QUEUE_DEPTH if type_name in _LARGE else BURST_DEPTH)
        events = SubscriptionEventCallbacks(message_lost=lambda event: self.dds_lost.update({topic: event.total_count_change}))
        take = self._recording.taker(topic, type_name, self._namespace)

        def on_message(data: bytes) -> None:
            for message in chain([data], waiting(subscription, _TAKEN_TOGETHER)):
                self._received[topic] += 1
                take(message)

        subscription = self._node.create_subscription(message_type, topic, on_message, qos, raw=True, event_callbacks=events)
        self._publishers[topic] = self._node.count_publishers(topic)
        return True
