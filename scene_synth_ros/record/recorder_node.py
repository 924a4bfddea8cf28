"""The node that records the run into an MCAP bag and accounts for every message."""

from __future__ import annotations

import fnmatch
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future, TimeoutError
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.subscription import Subscription
from std_msgs.msg import String
from std_srvs.srv import Trigger

from scene_description import FieldError, Limits
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.bags.run_info import JPEG_QUALITY, PARAMETERS_NAME, RECORD_NAME, parameters_file, run_record
from scene_synth_ros.messages.image_codec import ImageCompression
from scene_synth_ros.messages.message_definitions import MessageDefinitionError, message_class
from scene_synth_ros.messages.timed_pose import read_pose
from scene_synth_ros.record.accounting import Accounting
from scene_synth_ros.record.bag_output import RecordingOptions
from scene_synth_ros.record.parameter_collector import ParameterCollector
from scene_synth_ros.record.recorder_qos import complete_qos, matching_qos
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.record.shared_frames import stand_ins
from scene_synth_ros.record.split_policy import SplitPolicy
from scene_synth_ros.suite.connections import Connections, publishers_of
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.suite.parameters import ParameterError, Parameters
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json, status_to_json
from scene_synth_ros.suite.suite_node import STEADY, SuiteNode
from scene_synth_ros.suite.trim_heap import give_back_memory

_BAG_FIXED = "a bag is opened once"
QUEUE_DEPTH = 200
ANSWER_TIMEOUT_S = 20.0
_Answer = Callable[[Trigger.Request, Trigger.Response], Trigger.Response]


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
    extra_topics: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(max_length=100, description="Patterns of topics to record besides, of whatever node and type", fixed=_BAG_FIXED),
    ] = ()
    exclude: Annotated[
        tuple[Annotated[str, Limits(max_length=300)], ...],
        Limits(max_length=100, description="Patterns of topics to leave out", fixed=_BAG_FIXED),
    ] = ()
    compression: Annotated[Literal["zstd", "lz4", "none"], Limits(description="Compression of the chunks", fixed=_BAG_FIXED)] = "zstd"
    compression_level: Annotated[int, Limits(ge=1, le=22, description="Level of zstd or lz4; higher is smaller", fixed=_BAG_FIXED)] = 1
    metadata_version: Annotated[
        Literal[9, 5], Limits(description="Version of metadata.yaml: 9 for Jazzy, 5 for Humble", fixed=_BAG_FIXED)
    ] = 9
    custom_data: Annotated[
        tuple[Annotated[str, Limits(max_length=20_000)], ...],
        Limits(max_length=100, description="KEY=VALUE notes kept with the bag", fixed=_BAG_FIXED),
    ] = ()
    loss_timeout_s: Annotated[
        float, Limits(ge=0.1, le=1e6, unit="s", description="Wait for messages that were published before they count as lost")
    ] = 10.0
    start_recording: Annotated[bool, Limits(description="Open the bag at the start, not at ~/start", fixed=_BAG_FIXED)] = True
    snapshot_s: Annotated[
        float, Limits(ge=0.0, le=3600.0, unit="s", description="Simulated time that ~/snapshot writes; 0 keeps none", fixed=_BAG_FIXED)
    ] = 0.0
    snapshot_mb: Annotated[
        float, Limits(ge=1.0, le=1e6, unit="MB", description="Memory for snapshots; the oldest frames go first", fixed=_BAG_FIXED)
    ] = 256.0
    autostart: Annotated[bool, Limits(description="Configure and activate at the start", fixed="it is used at the start only")] = True
    exit_when_done: Annotated[bool, Limits(description="Close the bag and end the process when the grammar node has finished")] = False


class RecorderNode(SuiteNode):
    """Records topics as raw CDR, ordered by stamp, into bags.

    Subscribes: every topic that the parameters name, as soon as it appears, with the QoS that its publishers offer; ``status``.
    Publishes: ``status`` (latched), with which lock-step and back-pressure work; ``/diagnostics``.
    Services (std_srvs/Trigger): ``~/start`` (opens the next bag, ``<bag>``, then ``<bag>_2``), ``~/stop`` (closes it; the run goes on),
    ``~/split`` (a new file with the next frame), ``~/snapshot`` (the last ``snapshot_s`` as ``<bag>_snapshot_<n>``).
    Parameters: the fields of ``RecorderConfig``; ``split.`` SplitPolicy; ``images.`` ImageCompression.
    ``/tf`` and ``/tf_static`` are written from the camera poses, so that bags have them also where tf2_msgs is not installed.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("recorder_node", **options)
        self._settings = Parameters(self, {"": RecorderConfig, "split": SplitPolicy, "images": ImageCompression})
        config: RecorderConfig = self._settings[""]
        if not config.bag:
            raise ParameterError("recorder_node: parameter bag: expected a folder that does not exist yet, got ''; set -p bag:=FOLDER")
        self._custom_data = _pairs(config.custom_data)
        self._closed = True
        self.begin(config.autostart)

    def open(self) -> None:
        """Make subscriptions, services and the thread that writes; no bag yet."""
        config: RecorderConfig = self._settings[""]
        options = RecordingOptions(
            split=self._settings["split"],
            compression=self._settings["images"],
            snapshot_s=config.snapshot_s,
            snapshot_bytes=round(config.snapshot_mb * 1e6),
        )
        self._recording = Recording(self._make_writer, options, self._warn, self.get_logger().fatal)
        self._accounting = Accounting()
        self._connections = Connections(lambda topic: publishers_of(self, topic))
        self._known: dict[str, int] = {}
        self._inputs: dict[str, Subscription] = {}
        self._frame_topics: dict[str, frozenset[str]] = {}
        self._dds_lost: Counter[str] = Counter()
        self._state, self._done_scene, self._missing_since = "starting", -1, 0.0
        self._complaint, self._closed, self._finish_asked = "", False, 0
        self._last_status = ""
        self._collector = ParameterCollector(self, self._describe_run)
        self._status = self.create_publisher(String, "status", latched_qos(10))
        self.create_subscription(String, "status", self._on_status, latched_qos(100))
        services: tuple[tuple[str, _Answer], ...] = (
            ("start", self._start),
            ("stop", self._stop),
            ("split", self._split),
            ("snapshot", self._snapshot),
        )
        for name, answer in services:
            self.create_service(Trigger, f"~/{name}", answer)
        self._diagnostics = Diagnostics(self, self._report)
        self._look_for_topics()
        self.create_timer(0.1, self._look_for_topics)
        self.create_timer(0.02, self._tick)
        self.create_timer(1.0, give_back_memory)

    def resume(self) -> None:
        """Open a bag, unless that is left to the service."""
        self._state = "ready"
        if self._settings[""].start_recording and not self._recording.writing:
            self._begin_bag()

    def pause(self) -> None:
        """Close the bag."""
        self._state = "starting"
        _wait(self._recording.end())

    @property
    def arrivals(self) -> int:
        """How many messages have come to be recorded."""
        return 0 if self._closed else self._accounting.received.total()

    def close(self) -> None:
        """Write what has arrived and close the bag; safe to call more than once."""
        if self._closed:
            return
        self._closed = True
        try:
            self._recording.close()
        except BagWriteError as error:
            if self._state != "failed":
                self._fail(str(error))
            self.exit_code = 1
        if self._accounting.lost:
            self.get_logger().error(f"{sum(self._accounting.lost.values())} messages lost: {dict(self._accounting.lost)}")
        written = self._recording.written.copy()
        self.get_logger().info(f"bag closed: {sum(written.values())} messages on {len(written)} topics")

    def _make_writer(self, folder: Path) -> BagWriter:
        config: RecorderConfig = self._settings[""]
        return BagWriter(
            folder,
            metadata_version=config.metadata_version,
            compression=config.compression,
            compression_level=config.compression_level,
            custom_data=self._custom_data,
        )

    def _begin_bag(self) -> str:
        folder = _wait(self._recording.begin(Path(self._settings[""].bag)))
        self.get_logger().info(f"recording to {folder}")
        return folder

    def _start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return _answer(self._begin_bag, response)

    def _stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return _answer(lambda: _wait(self._recording.end()), response)

    def _split(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._recording.split()
        response.success, response.message = self._recording.writing, "the next frame begins a new file"
        return response

    def _snapshot(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        base = Path(f"{self._settings[''].bag}_snapshot")
        return _answer(lambda: _wait(self._recording.snapshot(base)), response)

    def _describe_run(self, values: dict[str, dict[str, Any]]) -> None:
        record = run_record(values) | {JPEG_QUALITY: str(self._settings["images"].jpeg_quality)}
        self._recording.describe_run(RECORD_NAME, record, PARAMETERS_NAME, parameters_file(values))

    def _look_for_topics(self) -> None:
        config: RecorderConfig = self._settings[""]
        for topic, types in sorted(self.get_topic_names_and_types()):
            if topic in self._known or not self.get_publishers_info_by_topic(topic):
                continue
            self._known[topic] = 0 if self._is_recorded(config, topic) and self._subscribe(topic, types[0]) else -1
        self._collector.step()

    def _is_recorded(self, config: RecorderConfig, topic: str) -> bool:
        if topic in ("/tf", "/tf_static") or topic == self.resolve_topic_name("status"):
            return False
        if not config.topics and topic.endswith("/transition_event"):
            return False
        chosen = (*(config.topics or (f"{self._own_namespace}*", "/clock", "/diagnostics")), *config.extra_topics)
        return any(fnmatch.fnmatchcase(topic, pattern) for pattern in chosen) and not any(
            fnmatch.fnmatchcase(topic, pattern) for pattern in config.exclude
        )

    @property
    def _own_namespace(self) -> str:
        return str(self.get_namespace().rstrip("/") + "/")

    def _subscribe(self, topic: str, type_name: str) -> bool:
        offered = [complete_qos(info.qos_profile) for info in self.get_publishers_info_by_topic(topic)]
        try:
            message_type = message_class(type_name)
            foreign = not topic.startswith(self._own_namespace) and topic != "/clock"
            self._recording.add_topic(topic, type_name, offered, foreign=foreign)
        except (ImportError, AttributeError, MessageDefinitionError) as error:
            self._warn(f"{topic} is left out: {type_name} cannot be loaded ({error})")
            return False
        callback = self._make_callback(topic, type_name)
        events = SubscriptionEventCallbacks(message_lost=lambda event: self._dds_lost.update({topic: event.total_count_change}))
        self._inputs[topic] = self.create_subscription(
            message_type, topic, callback, matching_qos(offered, QUEUE_DEPTH), raw=True, event_callbacks=events
        )
        return True

    def _make_callback(self, topic: str, type_name: str) -> Any:
        camera = topic.rsplit("/", 2)[-2] if type_name == "geometry_msgs/msg/PoseStamped" and topic.endswith("/pose") else ""

        def on_message(data: bytes) -> None:
            self._accounting.received[topic] += 1
            if self._recording.add(topic, data) and camera:
                self._recording.add_pose(read_pose(data), camera)

        return on_message

    def _on_status(self, message: String) -> None:
        try:
            status = status_from_json(message.data)
        except FieldError as error:
            self._warn(f"ignored a status that does not fit: {error}")
            return
        if status.role in ("renderer", "grammar"):
            self._collector.ask(status.node)
        if status.role == "renderer":
            self._accounting.take_status(status)
            self._connections.take_status(status)
            self._frame_topics[status.node] = frozenset(topic for topic in status.counts if not topic.startswith("/tf"))
        elif status.role == "grammar" and status.state in ("finished", "failed") and self._settings[""].exit_when_done:
            self._finish_asked = 1 if status.state == "finished" else 2

    def _tick(self) -> None:
        if self._closed:
            return
        if self._recording.fault and self._state != "failed":
            self._fail(self._recording.fault)
        recorded = {topic for topics in self._frame_topics.values() for topic in topics if self._known.get(topic, -1) >= 0}
        transforms = {"/tf"} if any(topic.endswith("/pose") for topic in recorded) else set()
        self._recording.expect(recorded | transforms, stand_ins(self._frame_topics))
        self._check_rooms()
        self._publish_status()
        if self._state == "failed" or self._finish_asked:
            self.close()
            bad = self._state == "failed" or self._finish_asked == 2 or bool(self._accounting.lost)
            self.exit_code = 1 if bad else 0

    def _check_rooms(self) -> None:
        done = self._accounting.done_scene()
        self._done_scene = min(self._done_scene, done)  # a renderer has started again, or the run has
        missing = self._accounting.missing(self._known)
        now = time.monotonic()
        if not missing:
            self._missing_since = 0.0
            if done != self._done_scene:
                self._recording.flush(done)
                self._done_scene = done
        elif not self._missing_since:
            self._missing_since = now
        elif now - self._missing_since > self._settings[""].loss_timeout_s:
            self._accounting.give_up(missing)
            self._recording.flush()  # frames that wait for what is lost
            self._warn(f"{sum(missing.values())} messages lost after room {self._done_scene}: {missing}")

    def _fail(self, reason: str) -> None:
        self._state, self._complaint = "failed", reason
        self.get_logger().error(reason)
        self._diagnostics.publish()
        self._publish_status()

    def _publish_status(self) -> None:
        """Publish where the recorder stands, and which renderers may begin because none of their messages would be lost."""
        counts = {topic: -1 if count < 0 else self._recording.taken[topic] for topic, count in sorted(self._known.items())}
        status = NodeStatus(
            node=self.get_fully_qualified_name(),
            role="recorder",
            state=self._state,
            done_scene=self._done_scene,
            reason=self._complaint[:1000] if self._state == "failed" else "",
            counts=counts,
            connected=self._connections.look(self._known),
        )
        text = status_to_json(status)
        if text != self._last_status:
            self._last_status = text
            self._status.publish(String(data=text))

    def _warn(self, text: str) -> None:
        self._complaint = text
        self.get_logger().error(text, throttle_duration_sec=1.0, throttle_time_source_type=STEADY)

    def _report(self) -> Report:
        values = {
            "bag": self._settings[""].bag,
            "state": self._state,
            "written": self._recording.written.total(),
            "waiting_bytes": self._recording.waiting_bytes,
            "waiting_messages": self._recording.waiting_messages,
            "last_room": self._done_scene,
            "bags": self._recording.bags,
            "repeats_left_out": self._recording.repeats,
            "late": self._recording.late,
            "refused": self._recording.refused,
            "lost": dict(self._accounting.lost),
            "dds_lost": dict(self._dds_lost),
        }
        if self._state == "failed" or self._accounting.lost:
            return ERROR, self._complaint, values
        return (WARN, self._complaint, values) if self._complaint else (OK, "recording", values)


def _wait(future: Future[str]) -> str:
    """Return what the thread that writes answers.

    Raises:
        BagWriteError: it refuses, or the disk has not answered in time.
    """
    try:
        return future.result(ANSWER_TIMEOUT_S)
    except TimeoutError:
        raise BagWriteError(f"the disk has not answered for {ANSWER_TIMEOUT_S:g} s") from None


def _answer(work: Callable[[], str], response: Trigger.Response) -> Trigger.Response:
    """Fill in what has become of a request."""
    try:
        response.message, response.success = work(), True
    except BagWriteError as error:
        response.message = str(error)
    return response


def _pairs(items: tuple[str, ...]) -> dict[str, str]:
    pairs = {}
    for item in items:
        key, equals, value = item.partition("=")
        if not equals:
            raise ParameterError(f"recorder_node: parameter custom_data: expected KEY=VALUE, got '{item}'")
        pairs[key] = value
    return pairs


def main(args: list[str] | None = None) -> None:
    """Run the recorder node."""
    run_node(RecorderNode, args)


if __name__ == "__main__":
    main()
