"""The node that records the run into an MCAP bag and accounts for every message."""

from __future__ import annotations

import fnmatch
import time
from collections import Counter
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from geometry_msgs.msg import PoseStamped
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from std_msgs.msg import String

from scene_description import FieldError, Limits
from scene_synth_ros.accounting import Accounting
from scene_synth_ros.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.message_definitions import MessageDefinitionError, message_class
from scene_synth_ros.parameters import ParameterError, Parameters
from scene_synth_ros.process import run_node
from scene_synth_ros.qos import latched_qos
from scene_synth_ros.recording import Recording, TimedPose
from scene_synth_ros.stamps import NANOSECONDS
from scene_synth_ros.status import NodeStatus, status_from_json, status_to_json

_BAG_FIXED = "a bag is opened once"
QUEUE_DEPTH = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class RecorderConfig:
    """What is recorded, and where to."""

    bag: Annotated[str, Limits(max_length=1000, description="Folder of the bag; must not exist", fixed=_BAG_FIXED)] = ""
    topics: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(
            max_length=100,
            description="Patterns of the topics to record; empty: all of the namespace, /clock, /diagnostics",
            fixed=_BAG_FIXED,
        ),
    ] = ()
    exclude: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(max_length=100, description="Patterns of topics to leave out", fixed=_BAG_FIXED),
    ] = ()
    compression: Annotated[Literal["zstd", "none"], Limits(description="Compression of the chunks", fixed=_BAG_FIXED)] = "zstd"
    metadata_version: Annotated[
        Literal[9, 5], Limits(description="Version of metadata.yaml: 9 for Jazzy, 5 for Humble", fixed=_BAG_FIXED)
    ] = 9
    custom_data: Annotated[
        tuple[Annotated[str, Limits(max_length=20_000)], ...],
        Limits(max_length=100, description="KEY=VALUE notes kept with the bag", fixed=_BAG_FIXED),
    ] = ()
    loss_timeout_s: Annotated[
        float, Limits(ge=0.1, le=1e6, unit="s", description="Wait for messages of a finished room before they count as lost")
    ] = 10.0
    exit_when_done: Annotated[bool, Limits(description="Close the bag and end the process when the grammar node has finished")] = False


class RecorderNode(Node):
    """Records topics as raw CDR, ordered by stamp, into one bag.

    Subscribes: every topic that the parameters name, as soon as it appears, with the QoS that its publishers offer; ``status``.
    Publishes: ``status`` (latched), with which lock-step and back-pressure work; ``/diagnostics``.
    Parameters: the fields of ``RecorderConfig``.
    ``/tf`` and ``/tf_static`` are written from the camera poses, so that bags have them also where tf2_msgs is not installed.
    """

    def __init__(self) -> None:
        super().__init__("recorder_node", automatically_declare_parameters_from_overrides=True)
        self.exit_code: int | None = None
        self._settings = Parameters(self, {"": RecorderConfig})
        config: RecorderConfig = self._settings[""]
        if not config.bag:
            raise ParameterError("recorder_node: parameter bag: expected a folder that does not exist yet, got ''; set -p bag:=FOLDER")
        writer = BagWriter(
            config.bag, metadata_version=config.metadata_version, compression=config.compression, custom_data=_pairs(config.custom_data)
        )
        self._recording = Recording(writer)
        self._accounting = Accounting()
        self._known: dict[str, int] = {}
        self._inputs: dict[str, Subscription] = {}
        self._frame_topics: set[str] = set()
        self._dds_lost: Counter[str] = Counter()
        self._state, self._done_scene, self._missing_since = "ready", -1, 0.0
        self._complaint, self._closed, self._finish_asked = "", False, 0
        self._last_status = ""
        self._status = self.create_publisher(String, "status", latched_qos(10))
        self.create_subscription(String, "status", self._on_status, latched_qos(100))
        self._diagnostics = Diagnostics(self, self._report)
        self._look_for_topics()
        self.create_timer(0.1, self._look_for_topics)
        self.create_timer(0.02, self._tick)
        self.get_logger().info(f"recording to {config.bag}")

    def close(self) -> None:
        """Write what has arrived and close the bag; safe to call more than once."""
        if self._closed:
            return
        self._closed = True
        try:
            self._recording.close()
        except BagWriteError as error:
            self._fail(str(error))
            self.exit_code = 1
        if self._accounting.lost:
            self.get_logger().error(f"{sum(self._accounting.lost.values())} messages lost: {dict(self._accounting.lost)}")
        total = sum(self._recording.written.values())
        self.get_logger().info(f"bag closed: {total} messages on {len(self._recording.written)} topics")

    def _look_for_topics(self) -> None:
        config: RecorderConfig = self._settings[""]
        for topic, types in sorted(self.get_topic_names_and_types()):
            if topic in self._known or not self.get_publishers_info_by_topic(topic):
                continue
            self._known[topic] = 0 if self._is_recorded(config, topic) and self._subscribe(topic, types[0]) else -1

    def _is_recorded(self, config: RecorderConfig, topic: str) -> bool:
        if topic in ("/tf", "/tf_static") or topic == self.resolve_topic_name("status"):
            return False
        namespace = self.get_namespace().rstrip("/") + "/"
        chosen = config.topics or (f"{namespace}*", "/clock", "/diagnostics")
        return any(fnmatch.fnmatchcase(topic, pattern) for pattern in chosen) and not any(
            fnmatch.fnmatchcase(topic, pattern) for pattern in config.exclude
        )

    def _subscribe(self, topic: str, type_name: str) -> bool:
        offered = [_complete(info.qos_profile) for info in self.get_publishers_info_by_topic(topic)]
        try:
            message_type = message_class(type_name)
            self._recording.add_topic(topic, type_name, offered)
        except (ImportError, AttributeError, MessageDefinitionError) as error:
            self._complain(f"{topic} is left out: {type_name} cannot be loaded ({error})")
            return False
        except BagWriteError as error:
            self._fail(str(error))
            return False
        callback = self._make_callback(topic, type_name)
        events = SubscriptionEventCallbacks(message_lost=lambda event: self._dds_lost.update({topic: event.total_count_change}))
        self._inputs[topic] = self.create_subscription(
            message_type, topic, callback, _matching_qos(offered), raw=True, event_callbacks=events
        )
        return True

    def _make_callback(self, topic: str, type_name: str) -> Any:
        camera = topic.rsplit("/", 2)[-2] if type_name == "geometry_msgs/msg/PoseStamped" and topic.endswith("/pose") else ""

        def on_message(data: bytes) -> None:
            self._accounting.received[topic] += 1
            self._recording.add(topic, data)
            if camera:
                self._recording.add_pose(topic, _read_pose(data), camera)

        return on_message

    def _on_status(self, message: String) -> None:
        try:
            status = status_from_json(message.data)
        except FieldError as error:
            self._complain(f"ignored a status that does not fit: {error}")
            return
        if status.role == "renderer":
            self._accounting.take_status(status)
            self._frame_topics |= {topic for topic in status.counts if not topic.startswith("/tf")}
        elif status.role == "grammar" and status.state in ("finished", "failed") and self._settings[""].exit_when_done:
            self._finish_asked = 1 if status.state == "finished" else 2

    def _tick(self) -> None:
        if self._closed:
            return
        if self._recording.fault and self._state != "failed":
            self._fail(self._recording.fault)
        recorded = {topic for topic in self._frame_topics if self._known.get(topic, -1) >= 0}
        self._recording.expect(recorded | ({"/tf"} if any(topic.endswith("/pose") for topic in recorded) else set()))
        self._check_rooms()
        self._publish_status()
        if self._state == "failed" or self._finish_asked:
            self.close()
            bad = self._state == "failed" or self._finish_asked == 2 or bool(self._accounting.lost)
            self.exit_code = 1 if bad else 0

    def _check_rooms(self) -> None:
        done = self._accounting.done_scene()
        if done <= self._done_scene:
            return
        missing = self._accounting.missing(self._known)
        now = time.monotonic()
        if not missing:
            self._missing_since = 0.0
            self._recording.flush()
            self._done_scene = done
        elif not self._missing_since:
            self._missing_since = now
        elif now - self._missing_since > self._settings[""].loss_timeout_s:
            self._accounting.give_up(missing)
            self._complain(f"room {done}: {sum(missing.values())} messages lost: {missing}")

    def _fail(self, reason: str) -> None:
        self._state, self._complaint = "failed", reason
        self.get_logger().error(reason)
        self._diagnostics.publish()
        self._publish_status()

    def _publish_status(self) -> None:
        """Publish where the recorder stands; a topic is told of when it is connected both ways, so that its first message is not lost."""
        connected = {topic for topic, count in self._known.items() if count < 0 or self._inputs[topic].get_publisher_count()}
        counts = {topic: -1 if self._known[topic] < 0 else self._recording.written[topic] for topic in sorted(connected)}
        status = NodeStatus(
            node=self.get_fully_qualified_name(),
            role="recorder",
            state=self._state,
            done_scene=self._done_scene,
            reason=self._complaint[:1000] if self._state == "failed" else "",
            counts=counts,
        )
        text = status_to_json(status)
        if text != self._last_status:
            self._last_status = text
            self._status.publish(String(data=text))

    def _complain(self, text: str) -> None:
        self._complaint = text
        self.get_logger().error(text, throttle_duration_sec=1.0)

    def _report(self) -> Report:
        values = {
            "bag": self._settings[""].bag,
            "state": self._state,
            "written": sum(self._recording.written.values()),
            "waiting_bytes": self._recording.waiting_bytes,
            "last_room": self._done_scene,
            "lost": dict(self._accounting.lost),
            "dds_lost": dict(self._dds_lost),
        }
        if self._state == "failed" or self._accounting.lost:
            return ERROR, self._complaint, values
        return (WARN, self._complaint, values) if self._complaint else (OK, "recording", values)


def _pairs(items: tuple[str, ...]) -> dict[str, str]:
    pairs = {}
    for item in items:
        key, equals, value = item.partition("=")
        if not equals:
            raise ParameterError(f"recorder_node: parameter custom_data: expected KEY=VALUE, got '{item}'")
        pairs[key] = value
    return pairs


def _complete(offered: QoSProfile) -> QoSProfile:
    """Fill in history and depth, which discovery does not tell, as latched and stream publishers of this package have them."""
    depth = 1 if offered.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL else 10
    return QoSProfile(history=QoSHistoryPolicy.KEEP_LAST, depth=depth, reliability=offered.reliability, durability=offered.durability)


def _matching_qos(offered: list[QoSProfile]) -> QoSProfile:
    """Return the strongest QoS that every publisher meets, as ``ros2 bag record`` chooses it."""
    reliable = all(qos.reliability == QoSReliabilityPolicy.RELIABLE for qos in offered)
    latched = all(qos.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL for qos in offered)
    return QoSProfile(
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=QUEUE_DEPTH,
        reliability=QoSReliabilityPolicy.RELIABLE if reliable else QoSReliabilityPolicy.BEST_EFFORT,
        durability=QoSDurabilityPolicy.TRANSIENT_LOCAL if latched else QoSDurabilityPolicy.VOLATILE,
    )


def _read_pose(data: bytes) -> TimedPose:
    message = deserialize_message(data, PoseStamped)
    stamp, position, q = message.header.stamp, message.pose.position, message.pose.orientation
    return TimedPose(
        stamp.sec * NANOSECONDS + stamp.nanosec, message.header.frame_id, (position.x, position.y, position.z), (q.x, q.y, q.z, q.w)
    )


def main(args: list[str] | None = None) -> None:
    """Run the recorder node."""
    run_node(RecorderNode, args)


if __name__ == "__main__":
    main()
