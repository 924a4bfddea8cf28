"""The node that records the run into MCAP bags and accounts for every message."""

import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.waitable import Waitable
from std_msgs.msg import String

from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.record.bag_output import BagNumbers
from scene_synth_ros.record.bag_services import BagServices
from scene_synth_ros.record.recorder_config import RECORDER_GROUPS, RecorderConfig, read_pairs
from scene_synth_ros.record.recording import Recording, describe_run, make_writer, recording_options
from scene_synth_ros.record.room_progress import Accounting, RoomProgress
from scene_synth_ros.record.topic_inputs import TopicInputs
from scene_synth_ros.suite.connections import Connections, publishers_of
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.suite.faults import FAULT_STATUS
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.parameter_collector import ParameterCollector
from scene_synth_ros.suite.parameters import ParameterError, Parameters
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeState, NodeStatus, status_to_json
from scene_synth_ros.suite.suite_node import SuiteNode

_TICKS_AN_EVENT = 10
"""Events of subscriptions, losses and publishers that do not fit, are waited for after each so many ticks of the timer, until the next."""


class RecorderNode(SuiteNode):
    """Records topics as raw CDR, ordered by stamp, into bags.

    Threads: callbacks run in the thread of the executor; what belongs to one life, from *configure* to *cleanup*, is made in ``open``, and
    the thread that writes is part of it (:class:`Recording`).  That one calls ``refuse`` too, which is for any thread.

    Subscribes: every topic that the parameters name, as soon as it appears, with the QoS that its publishers offer; ``status``.
    Publishes: ``status`` (latched), with which lock-step and back-pressure work; ``/diagnostics``.
    Services (std_srvs/Trigger): ``~/start`` (opens the next bag, ``<bag>``, then ``<bag>_2``), ``~/stop`` (closes it; the run goes on),
    ``~/split`` (a new file with the next frame), ``~/snapshot`` (the last ``snapshot_s`` as ``<bag>_snapshot_<n>``).
    Parameters: the fields of ``RecorderConfig``; ``split.`` SplitPolicy; ``images.`` ImageCompression.
    ``/tf`` and ``/tf_static`` are written from the camera poses, ``label_info`` from the labels, detections from the annotations, so
    that bags have them also where tf2_msgs and vision_msgs are not installed.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("recorder_node", **options)
        self._settings = Parameters(self, RECORDER_GROUPS)
        config: RecorderConfig = self._settings[""]
        if not config.bag:
            raise ParameterError("recorder_node: parameter bag: expected a folder that does not exist yet, got ''; set -p bag:=FOLDER")
        read_pairs(config.custom_data)
        self._numbers = BagNumbers()
        self._closed, self._ticks = True, 0
        self.begin(config.autostart)

    def open(self) -> None:
        """Make subscriptions, services and the thread that writes; no bag yet."""
        config: RecorderConfig = self._settings[""]
        self._state: NodeState = "starting"
        self._reason = self._last_status = ""
        self._finish_asked = ""
        with ExitStack() as undo:
            self._recording = Recording(
                partial(make_writer, self._settings), recording_options(self._settings), self.refuse, self._tell_fault, self._numbers
            )
            undo.callback(self._recording.close)
            self._accounting = Accounting()
            self._inputs = TopicInputs(self, config, self._recording, self._accounting.received)
            self._rooms = RoomProgress(self._recording, self._accounting, self._inputs.known, self.refuse)
            self._connections = Connections(lambda topic: publishers_of(self, topic))
            self._collector = ParameterCollector(self, self._describe_run)
            self._bag_services = BagServices(self, self._recording, Path(config.bag))
            self._status = self.create_publisher(String, "status", latched_qos(10))
            self.hear_status(self._on_status, self.refuse)
            self._diagnostics = Diagnostics(self, self._report)
            self._look()
            self.create_timer(0.1, self._look)
            self.create_timer(0.02, self._tick)
            self.create_timer(1.0, trim_heap)
            undo.pop_all()
        self._closed = False

    def resume(self) -> None:
        """Open a bag, unless that is left to the service."""
        self._state = "ready"
        if self._settings[""].start_recording and not self._recording.writing:
            self._bag_services.start()

    def pause(self) -> None:
        """Close the bag."""
        self._state = "starting"
        self._bag_services.stop()

    @property
    def waitables(self) -> Iterator[Waitable]:
        """The events of subscriptions, three of each: to wait for them at every message would take longer than to record it."""
        yield from () if self._ticks % _TICKS_AN_EVENT else super().waitables

    @property
    def arrivals(self) -> int:
        """How many messages have come to be recorded."""
        return 0 if self._closed else self._accounting.received.total()

    def close(self) -> None:
        """Write what has arrived, close the bag and end the thread that writes; harmless when repeated."""
        if self._closed:
            return
        self._closed = True
        try:
            self._recording.close()
        except BagWriteError as error:
            self._end_recording(str(error))
            self.exit_code = FAULT_STATUS if self.faults.count else 1
        if self._accounting.lost:
            self.get_logger().error(f"{sum(self._accounting.lost.values())} messages lost: {dict(self._accounting.lost)}")
        if self._recording.discarded:
            self.get_logger().info("nothing was recorded; no bag is left")
            return
        written = self._recording.written.copy()
        self.get_logger().info(f"bag closed: {sum(written.values())} messages on {len(written)} topics")

    def _describe_run(self, values: dict[str, dict[str, Any]]) -> None:
        describe_run(self._recording, self._settings, values)

    def _tell_fault(self, error: Exception) -> str:
        return self.faults.tell(error, f"{self.get_name()} wrote a bag")

    def _look(self) -> None:
        self._inputs.look()
        self._collector.step()

    def _on_status(self, status: NodeStatus) -> None:
        if status.role == "grammar" and self.token and status.token not in ("", self.token):
            self.warn(f"{status.node} of another run is in this namespace: what it says is left alone; end it, or run in another namespace")
            return
        self._inputs.take_status(status)
        if status.role in ("renderer", "grammar"):
            self._collector.ask(status.node)
            self._rooms.take_status(status)
        if status.role == "renderer":
            self._connections.take_status(status)
        elif status.role == "grammar" and status.state in ("finished", "failed") and self._ends_with_run and not self.leaving:
            self._finish_asked = status.state

    def _tick(self) -> None:
        self._ticks += 1
        if self._closed:
            return
        if self._recording.fault:
            self._end_recording(self._recording.fault)
        self._rooms.step(time.monotonic(), self._settings[""].loss_timeout_s)
        self._publish_status()
        if self._recording.fault or self._finish_asked:
            self.close()
            bad = self._state == "failed" or self._finish_asked == "failed" or bool(self._accounting.lost)
            self.exit_code = self.exit_code or (FAULT_STATUS if self.faults.count else int(bad))

    def _end_recording(self, fault: str) -> None:
        """Say once why nothing is written any more."""
        if self._reason != fault:
            self.get_logger().error(fault)
            self.fail(fault)

    def fail(self, reason: str) -> None:
        """Tell the peers that the node records nothing any more."""
        self._state, self._reason = "failed", reason
        self._diagnostics.publish()
        self._publish_status()

    def _publish_status(self) -> None:
        """Publish where the recorder stands, and which renderers may begin because none of their messages would be lost."""
        known = self._inputs.known
        topics = sorted(self._accounting.topics & known.keys())
        connected = self._connections.look(known)
        counts = {topic: -1 if known[topic] < 0 else self._recording.taken[topic] for topic in topics}
        status = NodeStatus(
            node=self.get_fully_qualified_name(),
            role="recorder",
            state=self._state,
            done_scene=self._rooms.done_scene,
            reason=self._reason[:1000],
            counts=counts,
            # The bag is to tell the parameters of those that begin.
            connected=() if self._collector.expects_answers else connected,
            run=self._rooms.run,
            token=self.token,
        )
        text = status_to_json(status)
        if text != self._last_status:
            self._last_status = text
            self._status.publish(String(data=text))

    def _report(self) -> Report:
        recording = self._recording
        values = {
            "bag": self._settings[""].bag,
            "state": self._state,
            "written": recording.written.total(),
            "waiting_bytes": recording.intake.waiting_bytes,
            "waiting_messages": recording.waiting_messages,
            "last_room": self._rooms.done_scene,
            "bags": self._numbers.bags,
            "repeats_left_out": recording.intake.repeats,
            "late": recording.intake.late,
            "refused": recording.intake.refused,
            "lost": dict(self._accounting.lost),
            "dds_lost": dict(self._inputs.dds_lost),
        }
        warning = self._reason or self.last_warning()
        if self._state == "failed" or self._accounting.lost:
            return ERROR, warning, values
        return (WARN, warning, values) if warning else (OK, "recording", values)


def main(args: list[str] | None = None) -> None:
    """Run the recorder node."""
    run_node(RecorderNode, args)


if __name__ == "__main__":
    main()
