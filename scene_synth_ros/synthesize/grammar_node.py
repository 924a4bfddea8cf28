"""The node that synthesises rooms and publishes their descriptions."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rclpy.duration import Duration
from std_msgs.msg import String

from grammar import SceneRequest
from grammar.checks.metrics import SamplingCost
from grammar.synthesize import SceneSynthesizer
from scene_description import SceneSynthError, error_line
from scene_description.strict import shorten
from scene_synth_ros.simulation.services import SimulationServices
from scene_synth_ros.simulation.world import UNCHANGED
from scene_synth_ros.suite.connections import identity_of, publishers_of
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.rclpy_internals import overrides_of
from scene_synth_ros.suite.status import NodeState, NodeStatus, status_to_json
from scene_synth_ros.suite.suite_node import SuiteNode, serve_trigger
from scene_synth_ros.synthesize.catalogs import with_catalog
from scene_synth_ros.synthesize.room_ahead import Prepared, RoomAhead, RoomJob
from scene_synth_ros.synthesize.room_schedule import ROOM_CHANGE_S, RoomSchedule, Step, waiting_line
from scene_synth_ros.synthesize.run_config import GRAMMAR_GROUPS, RunConfig
from scene_synth_ros.synthesize.scene_messages import SCENE_TOPICS, scene_to_msgs
from scene_synth_ros.synthesize.simulated_run import SimulatedRun

_LAST_WORDS_S = 0.3
_TICK_S = 0.1
"""How often the node looks at the clock for the next step; a status, or a room that is prepared, makes it look at once."""


class GrammarNode(SuiteNode):
    """Synthesises furnished rooms and publishes their descriptions, one ahead of what the renderers work on.

    Threading: everything here runs in the executor's thread; :class:`RoomAhead` owns the thread that synthesises.

    Publishes (all latched): ``scene`` (std_msgs/String, JSON ``scene_synth/1``), ``scene/next`` (the same, of the room that will come next,
    as soon as it is synthesised), ``scene/markers`` (MarkerArray), ``scene/map`` (OccupancyGrid of the free floor), ``status``
    (std_msgs/String); ``/diagnostics``; ``simulation/response`` (std_msgs/String, JSON).
    Subscribes: ``status`` of renderers and recorders; ``simulation/request`` (std_msgs/String, JSON).
    Services (std_srvs/Trigger): ``~/next_room`` (in lock-step once the peers have finished theirs), ``~/pause`` and ``~/resume`` (no rooms
    go out in between), ``~/reset`` (the run begins again with its first room, in lock-step when the present one is finished; simulated time
    goes on); ``~/play``, ``~/hold``, ``~/stop`` and ``~/step`` (one frame), and the services of simulation_interfaces where that is
    installed: see :class:`SimulationServices`.
    Parameters: the fields of ``RunConfig``, of ``SceneRequest`` under ``scene.``, of ``MotionConfig`` under ``motion.``; those that change
    live take effect with the next room that is synthesised: the one prepared ahead is made again.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("grammar_node", **options)
        self._present: RoomSchedule | None = None
        self._ahead = RoomAhead(self.faults, self.create_guard_condition(self._tick).trigger)
        own = self._override("grammar_file")
        self._synthesizer = with_catalog(SceneSynthesizer.from_config([Path(own)] if own else []), self._override("catalog_dir"))
        self._settings = Parameters(self, GRAMMAR_GROUPS, self._on_change, self._check)
        self.begin(self.config.autostart)

    @property
    def config(self) -> RunConfig:
        """The node's own parameters."""
        config: RunConfig = self._settings[""]
        return config

    @property
    def run(self) -> RoomSchedule:
        """The run of this life of the node, between *configure* and *cleanup*."""
        assert self._present is not None
        return self._present

    def _check(self, values: Mapping[str, Any]) -> None:
        values[""].check()
        self._synthesizer.check(values["scene"])

    def _override(self, name: str) -> str:
        """Return a text parameter that is needed before the others are declared; empty if it is not set."""
        value = overrides_of(self).get(name, "")
        return value if isinstance(value, str) else ""

    def open(self) -> None:
        """Make publishers and services; the run begins with its first room."""
        self._state: NodeState = "ready"
        self.obstacle = ""
        self.newest_room: Prepared | None = None
        self._announced: Prepared | None = None
        depth = latched_qos(self.config.rooms_ahead)
        self._room = {name: self.create_publisher(kind, name, depth) for name, kind in SCENE_TOPICS.items()}
        self._next = self.create_publisher(String, "scene/next", latched_qos())
        self._status = self.create_publisher(String, "status", latched_qos(10))
        self._present = RoomSchedule(self.config, time.monotonic(), identity_of(self, self._status))
        self.hear_status(self._on_status, self.warn)
        for name, work in {"next_room": self._next_room, "pause": self._hold, "resume": self._go_on, "reset": self._reset}.items():
            serve_trigger(self, name, work)
        self._simulated = SimulatedRun(self, self._ahead, self._synthesizer)
        self._steering = SimulationServices(self, self._simulated)
        self._diagnostics = Diagnostics(self, self._report)
        self._tell("ready")
        self.get_logger().info("synthesising the first room (the first run compiles kernels)")
        self.create_timer(_TICK_S, self._tick)
        self.create_timer(1.0, self._look_for_peers)

    def close(self) -> None:
        """End the run; a room that is being synthesised is dropped when it is ready."""
        self._present = None
        self._ahead.drop()

    def pause(self) -> None:
        """Let no more rooms out."""
        self.run.pause(time.monotonic())

    def resume(self) -> None:
        """Let rooms out again."""
        self.run.resume(time.monotonic())

    def fail(self, reason: str) -> None:
        """Tell the peers why the run ends."""
        if self._present is not None:
            self.obstacle = reason
            self._diagnostics.publish()
            self._tell("failed", reason)
            self._status.wait_for_all_acked(Duration(seconds=1.0))

    def at_work(self) -> str:
        """Return the room that is prepared or goes out next."""
        return _room_name(self.run.next_index, self.config.seed) if self._present is not None else ""

    def _next_room(self) -> str:
        index = self.run.next_index
        return f"room {index} goes out{_after(self.run.ask_for_one())}"

    def _hold(self) -> str:
        self.pause()
        return f"paused before room {self.run.next_index}"

    def _go_on(self) -> str:
        self.resume()
        return f"going on with room {self.run.next_index}"

    def _reset(self) -> str:
        again = f"the run begins again with room {self.config.first_index} of seed {self.config.seed}"
        return again + _after(self.run.ask_for_reset())

    def _on_change(self, _prefixes: set[str]) -> None:
        if self._present is not None:
            self.run.change(self.config)
            self.obstacle = ""
            self._tell(self._state)

    def _on_status(self, status: NodeStatus) -> None:
        if status.role != "grammar":
            if self.run.take_status(status) or self.run.until_ns != self._told_until_ns:
                self._tell(self._state, self.obstacle)
            self._tick()

    def tell_change(self) -> None:
        """Tell the peers how the run is steered, and do what is due."""
        self._tell(self._state, self.obstacle)
        self._tick()

    def end_soon(self) -> None:
        """End the run, and the process, in a moment: answers that were sent are on their way till then."""
        self.create_timer(_LAST_WORDS_S, self._end)

    def _end(self) -> None:
        """End the run, and the process."""
        self._tell("finished")
        self._status.wait_for_all_acked(Duration(seconds=2.0))
        self.exit_code = 0

    def _look_for_peers(self) -> None:
        """Notice nodes that have died: they publish no status any more; say once whom the next room waits for."""
        present = {endpoint.node for endpoint in publishers_of(self, self.resolve_topic_name("status"))}
        for name in self.run.drop_missing(present):
            self.warn(f"{name} is gone")
        line = self.run.long_wait(time.monotonic())
        if line:
            self.warn(line)

    def _tick(self) -> None:
        """Do the run's next step, and keep one room prepared."""
        if self._present is None:
            return
        for line in self.run.peer_failures():
            if self.config.exit_when_done:
                self._end_in_failure(line)
                return
            self.warn(line)
        now_s = time.monotonic()
        step = self.run.step(now_s, self.active)
        if step is Step.BEGIN_AGAIN:
            self.obstacle = ""
            self._tell("ready")
        elif step is Step.FINISH:
            self._finish()
        order = self.run.order(now_s) if self._ahead.idle and not self.obstacle else None
        if order is not None:
            rules = replace(self._synthesizer, motion=self._settings["motion"])
            world = self._simulated.world if order.index == self.config.first_index else UNCHANGED
            job = RoomJob(rules, self._settings["scene"], self.config.seed, order.index, order.times, order.generation, world)
            self._ahead.prepare(job)
        if step is Step.SEND or (self.run.stopped and self._ahead.is_useless(self.run.generation)):
            self._send_prepared()
        self._announce_prepared()
        self._steering.look()

    def _announce_prepared(self) -> None:
        """Tell once of the room that is prepared, so that renderers can begin with it while the one before is shown."""
        prepared = self._ahead.ready
        if prepared is not None and prepared is not self._announced and prepared.generation == self.run.generation:
            self._announced = prepared
            self._next.publish(String(data=prepared.text))

    def _send_prepared(self) -> None:
        """Send the room that is prepared, if it is ready and still wanted; say what came instead."""
        ended = self._ahead.take()
        if ended is None:
            return
        job, future = ended
        wanted = job.generation == self.run.generation
        try:
            prepared = future.result()
            if wanted:
                self._send(prepared)
        except (SceneSynthError, OSError) as error:
            if wanted:
                self._refuse_room(f"room {job.index} could not be synthesised: {error_line(error)}")
        except Exception as error:
            self.faults.tell(error, f"{_room_name(job.index, job.seed)} was prepared")
            if wanted:
                self.run.skip(time.monotonic())

    def _refuse_room(self, reason: str) -> None:
        """Wait for other settings; a run that shall end does so."""
        if self.config.exit_when_done:
            self._end_in_failure(reason)
            return
        self.obstacle = reason
        self.get_logger().error(reason)
        self._diagnostics.publish()

    def _send(self, prepared: Prepared) -> None:
        config = self.config
        if config.clock == "wall":
            prepared = prepared.starting_at(time.time_ns() + round(ROOM_CHANGE_S * 1e9))
        scene = prepared.scene
        floor = self._synthesizer.floor_map(scene)
        for name, message in scene_to_msgs(scene, prepared.text, floor, config.world_frame).items():
            self._room[name].publish(message)
        self.run.sent(len(scene.camera_path), time.monotonic())
        self.newest_room = prepared
        of = f"/{config.rooms}" if config.rooms else ""
        self.get_logger().info(
            f"room {scene.index - config.first_index + 1}{of}: {scene.category}, {len(scene.objects)} objects, "
            f"{len(scene.camera_path)} frames (synthesised in {prepared.seconds:.2f} s)"
        )

    def _finish(self) -> None:
        self.get_logger().info(f"all {self.config.rooms} rooms are done")
        if self.config.exit_when_done:
            self._end()
        else:
            self._tell("finished")

    def _end_in_failure(self, reason: str) -> None:
        self.get_logger().error(reason)
        self.fail(reason)
        self.exit_code = 1

    def _tell(self, state: NodeState, reason: str = "") -> None:
        """Publish the status."""
        self._state, self._told_until_ns = state, self.run.until_ns
        status = NodeStatus(
            node=self.get_fully_qualified_name(),
            role="grammar",
            state=state,
            done_scene=self.run.finished_by_all,
            reason=reason[:1000],
            lock_step=self.config.lock_step,
            clock=self.config.clock,
            until_ns=self._told_until_ns,
            run=self.run.name,
            token=self.token,
        )
        self._status.publish(String(data=status_to_json(status)))

    def _report(self) -> Report:
        """Return what ``/diagnostics`` says."""
        run, config, room = self.run, self.config, self.newest_room
        request: SceneRequest = self._settings["scene"]
        cost = room.cost if room is not None else SamplingCost(attempts=0, proposals=0, chain_s=0.0)
        warning = self.last_warning()
        values = {
            "seed": config.seed,
            "room_type": request.room_type,
            "rooms_sent": run.next_index - config.first_index,
            "rate_hz": config.rate_hz,
            "lock_step": config.lock_step,
            "simulation": self._simulated.phase,
            "seconds_per_room": f"{room.seconds if room is not None else 0.0:.3f}",
            "layouts_per_room": cost.attempts,
            "proposals_per_room": cost.proposals,
            "proposals_per_second": f"{cost.proposals / cost.chain_s:.3g}" if cost.chain_s else "0",
            "waiting_for": "resume" if run.paused else run.waiting,
            "peers": ", ".join(f"{peer.node} {peer.state} {peer.done_scene}" for peer in run.peers),
            "last_complaint": warning,
        }
        if self.obstacle:
            return ERROR, shorten(self.obstacle) if len(self.obstacle) > 500 else self.obstacle, values
        waited_s = time.monotonic() - run.last_sent_s
        if run.waiting and waited_s > config.peer_timeout_s:
            return WARN, waiting_line(waited_s, run.waiting), values
        return (WARN, warning, values) if warning else (OK, "synthesising rooms", values)


def _after(what: str) -> str:
    """Return what to add to the answer of a service that must wait."""
    return f", after {what}" if what else ""


def _room_name(index: int, seed: int) -> str:
    return f"room {index} of seed {seed}"


def main(args: list[str] | None = None) -> None:
    """Run the grammar node."""
    run_node(GrammarNode, args)


if __name__ == "__main__":
    main()
