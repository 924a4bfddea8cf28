"""The node that synthesises rooms and publishes their descriptions."""

from __future__ import annotations

import math
import time
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from nav_msgs.msg import OccupancyGrid
from rclpy.duration import Duration
from std_msgs.msg import String
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from grammar import SceneRequest
from grammar.checks.metrics import SamplingCost
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import FieldError, Limits, SceneSynthError
from scene_description.strict import shorten
from scene_synth_ros.generate.catalogs import with_catalog
from scene_synth_ros.generate.frame_times import FrameTimes
from scene_synth_ros.generate.lock_step import Expectation, finished_by_all, last_done, missing_peers, peer_failures, waiting_for
from scene_synth_ros.generate.room_job import Prepared, RoomJob
from scene_synth_ros.messages.conversions import occupancy_to_msg, scene_to_markers
from scene_synth_ros.suite.connections import publishers_of
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.process import Worker, run_node
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json, status_to_json
from scene_synth_ros.suite.suite_node import STEADY, SuiteNode

_PATIENCE = 3
_PEERS_FIXED = "the run's peers are counted once"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunConfig:
    """How many rooms and frames a run has, and how it keeps step."""

    seed: Annotated[int, Limits(ge=0, le=2**63 - 1, description="Seed of the run; room i depends on it, on i and on the settings")] = 1
    rooms: Annotated[int, Limits(ge=0, le=10**9, description="Rooms of the run; 0 goes on for ever")] = 0
    grammar_file: Annotated[
        str,
        Limits(
            max_length=4096,
            description="Grammar file in place of its room type's; empty: those that come with the program",
            fixed="grammars are read once",
        ),
    ] = ""
    first_index: Annotated[int, Limits(ge=0, le=2**40, description="Index of the first room", fixed="rooms are counted from it")] = 0
    frames_per_room: Annotated[int, Limits(ge=1, le=100_000, description="Frames of each room's camera path")] = 30
    rate_hz: Annotated[float, Limits(ge=0.1, le=1000.0, unit="Hz", description="Simulated frame rate")] = 10.0
    start_time_s: Annotated[
        float, Limits(ge=0.0, le=4e9, unit="s", description="Simulated time of the first frame of room 0", fixed="time cannot jump")
    ] = 1.0
    lock_step: Annotated[bool, Limits(description="Send a room only when all peers have finished the one before")] = True
    expected_renderers: Annotated[int, Limits(ge=0, le=100, description="Renderers that a lock-step run waits for", fixed=_PEERS_FIXED)] = 1
    expected_recorders: Annotated[int, Limits(ge=0, le=100, description="Recorders that a lock-step run waits for", fixed=_PEERS_FIXED)] = 0
    rooms_ahead: Annotated[
        int,
        Limits(
            ge=1,
            le=16,
            description="Rooms of a lock-step run that may be unfinished at once; renderers that share need as many",
            fixed="queues of scenes are as deep",
        ),
    ] = 1
    peer_timeout_s: Annotated[float, Limits(ge=1.0, le=1e6, unit="s", description="Wait for peers before a warning")] = 30.0
    world_frame: Annotated[str, Limits(min_length=1, max_length=100, description="Frame of the scene", fixed="frames of a run stay")] = (
        "map"
    )
    catalog_dir: Annotated[
        str, Limits(max_length=1000, description="Folder of the user's models, with catalog.yaml; empty: none", fixed="it is read once")
    ] = ""
    autostart: Annotated[bool, Limits(description="Configure and activate at the start", fixed="it is used at the start only")] = True
    exit_when_done: Annotated[bool, Limits(description="End the process after the last room")] = False


class GrammarNode(SuiteNode):
    """Synthesises furnished rooms and publishes their descriptions, one ahead of what the renderers work on.

    Publishes (all latched): ``scene`` (std_msgs/String, JSON ``scene_synth/1``), ``scene/markers`` (MarkerArray), ``scene/map``
    (OccupancyGrid of the free floor), ``status`` (std_msgs/String); ``/diagnostics``.
    Subscribes: ``status`` of renderers and recorders.
    Services (std_srvs/Trigger): ``~/next_room`` (in lock-step once the peers have finished theirs), ``~/pause`` and ``~/resume`` (no rooms
    go out in between), ``~/reset`` (the run begins again with its first room, in lock-step when the present one is finished; simulated time
    goes on).
    Parameters: the fields of ``RunConfig``, and of ``SceneRequest`` under ``scene.``; those that change live take effect with the next
    room that is synthesised: the one prepared ahead is made again.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("grammar_node", **options)
        self._generation = 0
        self._worker: Worker | None = None
        own = self._override("grammar_file")
        self._synthesizer = with_catalog(SceneSynthesizer.from_config([Path(own)] if own else []), self._override("catalog_dir"))
        groups = {"": RunConfig, "scene": SceneRequest}
        self._settings = Parameters(self, groups, self._on_change, lambda values: self._synthesizer.check(values["scene"]))
        self.begin(self._settings[""].autostart)

    def open(self) -> None:
        """Make publishers, services and the thread that synthesises; the run begins with its first room."""
        run: RunConfig = self._settings[""]
        self._times = FrameTimes(round(run.start_time_s * 1e9), run.rate_hz)
        self._next_index, self._next_frame = run.first_index, run.first_index * run.frames_per_room
        self._last_sent, self._last_sent_at, self._send_at = -1, time.monotonic(), 0.0
        self._peers: dict[str, NodeStatus] = {}
        self._peers_before: dict[str, int] = {}
        self._reset_asked = False
        self._absences: dict[str, int] = {}
        self._pending: Future[Prepared] | None = None
        self._fault, self._complaint, self._waiting = "", "", ""
        self._room_seconds, self._room_cost = 0.0, SamplingCost(attempts=0, proposals=0, chain_s=0.0)
        self._finished, self._single, self._state, self._told = False, False, "ready", -1
        self._paused_at: float | None = None
        self._worker = Worker("synthesis")
        self._scene = self.create_publisher(String, "scene", latched_qos(run.rooms_ahead))
        self._markers = self.create_publisher(MarkerArray, "scene/markers", latched_qos(run.rooms_ahead))
        self._map = self.create_publisher(OccupancyGrid, "scene/map", latched_qos(run.rooms_ahead))
        self._status = self.create_publisher(String, "status", latched_qos(10))
        self.create_subscription(String, "status", self._on_status, latched_qos(100))
        for name, answer in (("next_room", self._next_room), ("pause", self._pause), ("resume", self._resume), ("reset", self._reset)):
            self.create_service(Trigger, f"~/{name}", answer)
        self._diagnostics = Diagnostics(self, self._report)
        self._publish_status("ready")
        self.get_logger().info("synthesising the first room (the first run compiles kernels)")
        self.create_timer(0.02, self._tick)
        self.create_timer(1.0, self._look_for_peers)

    def _override(self, name: str) -> str:
        """Return a text parameter that is needed before the others are declared; empty if it is not set."""
        value = self.get_parameter(name).value if self.has_parameter(name) else ""
        return value if isinstance(value, str) else ""

    def close(self) -> None:
        """End the thread that synthesises."""
        if self._worker is not None:
            self._worker.close()
            self._worker = None

    def pause(self) -> None:
        """Let no more rooms out."""
        self._halt()

    def resume(self) -> None:
        """Let rooms out again."""
        self._go_on()

    def _next_room(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._single, self._send_at = True, 0.0
        response.success, response.message = (
            True,
            f"room {self._next_index} goes out" + (f", after {self._waiting}" if self._waiting else ""),
        )
        return response

    def _pause(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._halt()
        response.success, response.message = True, f"paused before room {self._next_index}"
        return response

    def _resume(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._go_on()
        response.success, response.message = True, f"going on with room {self._next_index}"
        return response

    def _reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        run: RunConfig = self._settings[""]
        self._reset_asked = True
        waiting = self._waiting_for(run, self._last_sent)
        response.success, response.message = (
            True,
            f"the run begins again with room {run.first_index} of seed {run.seed}" + (f", after {waiting}" if waiting else ""),
        )
        return response

    def _begin_again(self, run: RunConfig) -> None:
        """Go back to the first room; what peers say of rooms before counts no more."""
        self._reset_asked = False
        self._next_index, self._last_sent, self._told = run.first_index, -1, -1
        self._peers_before = {name: last_done(peer) for name, peer in self._peers.items() if last_done(peer) >= run.first_index}
        self._peers = {name: replace(peer, done_scene=-1, refused_scene=-1) for name, peer in self._peers.items()}
        self._generation += 1
        self._finished, self._fault, self._send_at = False, "", 0.0
        self._publish_status("ready")

    def _halt(self) -> None:
        if self._paused_at is None:
            self._paused_at = time.monotonic()

    def _go_on(self) -> None:
        """Let rooms out again; where they follow the wall clock, simulated time has gone on since the last room ended."""
        if self._paused_at is None:
            return
        run: RunConfig = self._settings[""]
        idle_s = time.monotonic() - max(self._paused_at, self._send_at)
        if not run.lock_step and self._last_sent >= 0 and idle_s > 0.0:
            self._next_frame += math.ceil(idle_s * run.rate_hz) + 1
            self._generation += 1
        self._paused_at = None

    def _look_for_peers(self) -> None:
        """Notice nodes that have died: they publish no status any more."""
        present = {endpoint.node for endpoint in publishers_of(self, self.resolve_topic_name("status"))}
        for name in missing_peers(self._peers, present, self._absences, _PATIENCE):
            del self._peers[name]
            self._peers_before.pop(name, None)
            self._complain(f"{name} is gone")

    def _on_change(self, prefixes: set[str]) -> None:
        if self._worker is None:
            return
        if "" in prefixes:
            rate = self._settings[""].rate_hz
            if rate != self._times.rate_hz:
                self._times = self._times.at_rate(rate, self._next_frame)
        self._generation += 1
        self._fault = ""
        self._publish_status(self._state)

    def _on_status(self, message: String) -> None:
        try:
            status = status_from_json(message.data)
        except FieldError as error:
            self._complain(f"ignored a status that does not fit: {error}")
            return
        if status.role != "grammar":
            before = self._peers_before.get(status.node)
            if before is not None and last_done(status) >= before:
                status = replace(status, done_scene=-1, refused_scene=-1)
            else:
                self._peers_before.pop(status.node, None)
            self._peers[status.node] = status
            finished = finished_by_all(self._peers)
            if finished != self._told:
                self._told = finished
                self._publish_status(self._state, self._fault)

    def _tick(self) -> None:
        run: RunConfig = self._settings[""]
        for line in peer_failures(self._peers, self._last_sent):
            if run.exit_when_done:
                self._fail(line)
                return
            self._complain(line)
        if self._reset_asked and not self._waiting_for(run, self._last_sent):
            self._begin_again(run)
        last = run.first_index + run.rooms - 1 if run.rooms else None
        self._waiting = self._waiting_for(run, self._last_sent - (run.rooms_ahead - 1 if last is None or self._next_index <= last else 0))
        if last is not None and self._next_index > last:
            if not self._waiting and not self._finished and (run.lock_step or self._last_room_is_over()):
                self._finish(run)
            return
        if self._pending is None and not self._fault and self._worker is not None:
            self._pending = self._worker.submit(self._make_job(run))
        held = self._reset_asked or not self.active or (self._paused_at is not None and not self._single)
        if held or self._waiting or time.monotonic() < self._send_at or self._pending is None or not self._pending.done():
            return
        self._take_prepared(run)

    def _waiting_for(self, run: RunConfig, must_be_done: int) -> str:
        """Return what the next room must wait for if all peers must have finished a room (none, if it is not of this run)."""
        expected = Expectation(renderers=run.expected_renderers, recorders=run.expected_recorders)
        return waiting_for(self._peers, expected, must_be_done if must_be_done >= run.first_index else -1) if run.lock_step else ""

    def _last_room_is_over(self) -> bool:
        """Return whether a run that follows the wall clock is over: its last room's time is up, and whoever is there has finished it."""
        there = [peer for peer in self._peers.values() if peer.state == "ready"]
        return time.monotonic() >= self._send_at and all(last_done(peer) >= self._last_sent for peer in there)

    def _make_job(self, run: RunConfig) -> RoomJob:
        times = CameraTimes(
            frames=run.frames_per_room,
            start_ns=self._times.origin_ns,
            rate_hz=self._times.rate_hz,
            first_index=self._next_frame - self._times.first_frame,
        )
        return RoomJob(self._synthesizer, self._settings["scene"], run.seed, self._next_index, times, self._generation)

    def _take_prepared(self, run: RunConfig) -> None:
        assert self._pending is not None
        pending, self._pending = self._pending, None
        try:
            prepared = pending.result()
        except SceneSynthError as error:
            self._fault = f"room {self._next_index} could not be synthesised: {error}"
            if run.exit_when_done:
                self._fail(self._fault)
            else:
                self.get_logger().error(self._fault)
                self._diagnostics.publish()
            return
        if prepared.generation == self._generation:
            self._send(prepared, run)

    def _send(self, prepared: Prepared, run: RunConfig) -> None:
        scene = prepared.scene
        self._room_seconds, self._room_cost = prepared.seconds, prepared.cost
        stamp_ns = scene.camera_path[0].stamp_ns
        grid = self._synthesizer.floor_map(scene)
        self._map.publish(occupancy_to_msg(grid.cells, grid.resolution_m, grid.origin_m, stamp_ns, run.world_frame))
        self._markers.publish(scene_to_markers(scene, stamp_ns, run.world_frame))
        self._scene.publish(String(data=prepared.text))
        of = f"/{run.rooms}" if run.rooms else ""
        self.get_logger().info(
            f"room {scene.index - run.first_index + 1}{of}: {scene.category}, {len(scene.objects)} objects, "
            f"{len(scene.camera_path)} frames (synthesised in {prepared.seconds:.2f} s)"
        )
        self._last_sent, self._last_sent_at = scene.index, time.monotonic()
        self._send_at = 0.0 if run.lock_step else self._last_sent_at + len(scene.camera_path) / run.rate_hz
        self._single = False
        self._next_index += 1
        self._next_frame += len(scene.camera_path)

    def _finish(self, run: RunConfig) -> None:
        self._finished = True
        self.get_logger().info(f"all {run.rooms} rooms are done")
        self._publish_status("finished")
        if run.exit_when_done:
            self._status.wait_for_all_acked(Duration(seconds=2.0))
            self.exit_code = 0

    def _fail(self, reason: str) -> None:
        self._fault = reason
        self.get_logger().error(reason)
        self._diagnostics.publish()
        self._publish_status("failed", reason)
        self._status.wait_for_all_acked(Duration(seconds=1.0))
        self.exit_code = 1

    def _publish_status(self, state: str, reason: str = "") -> None:
        self._state = state
        name, lock_step = self.get_fully_qualified_name(), self._settings[""].lock_step
        status = NodeStatus(node=name, role="grammar", state=state, done_scene=self._told, reason=reason[:1000], lock_step=lock_step)
        self._status.publish(String(data=status_to_json(status)))

    def _complain(self, text: str) -> None:
        self._complaint = text
        self.get_logger().warning(text, throttle_duration_sec=1.0, throttle_time_source_type=STEADY)

    def _report(self) -> Report:
        run: RunConfig = self._settings[""]
        scene: SceneRequest = self._settings["scene"]
        cost = self._room_cost
        values = {
            "seed": run.seed,
            "room_type": scene.room_type,
            "rooms_sent": self._next_index - run.first_index,
            "rate_hz": run.rate_hz,
            "lock_step": run.lock_step,
            "seconds_per_room": f"{self._room_seconds:.3f}",
            "layouts_per_room": cost.attempts,
            "proposals_per_room": cost.proposals,
            "proposals_per_second": f"{cost.proposals / cost.chain_s:.3g}" if cost.chain_s else "0",
            "waiting_for": "resume" if self._paused_at is not None else self._waiting,
            "peers": ", ".join(f"{peer.node} {peer.state} {peer.done_scene}" for peer in self._peers.values()),
            "last_complaint": self._complaint,
        }
        if self._fault:
            return ERROR, shorten(self._fault) if len(self._fault) > 500 else self._fault, values
        waited = time.monotonic() - self._last_sent_at
        if self._waiting and waited > run.peer_timeout_s:
            return WARN, f"waiting since {waited:.0f} s for {self._waiting}", values
        return (WARN, self._complaint, values) if self._complaint else (OK, "synthesising rooms", values)


def main(args: list[str] | None = None) -> None:
    """Run the grammar node."""
    run_node(GrammarNode, args)


if __name__ == "__main__":
    main()
