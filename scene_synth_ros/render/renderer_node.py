"""The node that renders the rooms it is sent and publishes the streams of one camera."""

import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Any

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import String

from renderer.exposure import sensor_ev100
from scene_description import FieldError, error_line
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.senses import senses_of
from scene_synth_ros.render.camera_requests import MAX_WAITING, CameraRequests
from scene_synth_ros.render.frame_report import IN_THE_ROOM
from scene_synth_ros.render.inbox import MAX_ROOMS_WAITING, Inbox
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS, RendererNodeConfig, refuse_contradictions
from scene_synth_ros.render.rendering import Rendering, room_name
from scene_synth_ros.render.streams import StreamPublishers
from scene_synth_ros.suite.daemon_job import start_daemon_job
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.suite.faults import FAULT_STATUS
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.qos import latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus
from scene_synth_ros.suite.suite_node import REFUSALS, SuiteNode

WARNING_S = 10.0
"""How long a warning is the node's state; it stays among the values."""


_STOP_S, _DELIVERY_S = 0.6, 0.3
"""How long a life that ends may take to leave the kernel at work, and its last messages to arrive."""
ONE_CLOCK = "let one publish it (streams.publish_clock:=false in the others), or all follow the wall clock (grammar_node clock:=wall)"

_TICK_S = 0.25
"""How often the node looks whether its rendering thread is warm or has ended; a status makes it look at once."""


class RendererNode(SuiteNode):
    """Renders every room that arrives on ``scene`` along its camera path.

    Threading: callbacks run in the executor's thread and only hand over to ``Inbox`` and ``CameraRequests``, which guard themselves.
    Each *configure* starts a life of the rendering thread, a :class:`Rendering`, which begins when the one before has ended, be that after
    a minute of compiling.  A life that is cleaned up publishes nothing any more.  ``_tick`` notices one that ends by itself.

    Subscribes: ``scene`` (std_msgs/String, latched, JSON ``scene_synth/1``), ``scene/next`` (the same, of the room that will come next: in
    real time it is made ahead), ``scene/map``; ``status`` of the other nodes;
    ``<camera>/request`` (PoseStamped: the frame of a pose in the present room, with the stamp of the request, or the next free nanosecond
    if that is 0); ``cmd_vel`` (Twist: moves the camera, where ``drive.enabled``). Publishes: the topics of ``StreamPublishers``, ``status``
    (latched), ``/diagnostics``. Parameters: the fields of ``RendererNodeConfig``; ``camera.`` CameraConfig; ``render.`` RenderConfig;
    ``sensor.`` SensorConfig; ``depth_sensor.`` DepthSensorConfig; ``streams.`` StreamConfig; ``compressed.`` LiveCompression; ``drive.``
    DriveConfig; ``scan.`` ScanConfig.  Live changes of the exposure and of ``compressed.`` take effect with the next frame, others with the
    next room.  A scene or pose that does not fit is refused with one line; the node keeps running.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("renderer_node", **options)
        self._settings = Parameters(self, RENDERER_GROUPS, self._on_change, lambda values: sensor_ev100(values["camera"], values["sensor"]))
        config: RendererNodeConfig = self._settings[""]
        refuse_contradictions(self.get_name(), {prefix: self._settings[prefix] for prefix in RENDERER_GROUPS})
        self._life: Future[None] | None = None
        self._former_life: Future[None] | None = None
        self.begin(config.autostart)

    def open(self) -> None:
        """Make publishers and subscriptions, and let a new life begin."""
        streams: StreamConfig = self._settings["streams"]
        senses = senses_of(self._settings)
        self._output = StreamPublishers(self, streams, self._settings["camera"], lambda: self._settings["compressed"], senses, self.token)
        self._inbox = Inbox(self.get_fully_qualified_name(), self._output.frame_topic, self._settings[""].share_count, self.token)
        self._requests = CameraRequests(streams.world_frame, self._settings["drive"])
        self._output.tell()
        self._rendering = Rendering(self, self._settings, self._inbox, self._output, self._requests)
        self._clock_conflict = ""
        self.hear_status(self._on_status, self.refuse)
        self.create_subscription(String, "scene", lambda message: self._inbox.put_room(message.data), latched_qos(MAX_ROOMS_WAITING))
        self.create_subscription(String, "scene/next", lambda message: self._inbox.announce(message.data), latched_qos())
        self.create_subscription(OccupancyGrid, "scene/map", lambda message: self._ask(self._requests.take_map, message), latched_qos())
        request = f"{streams.camera}/request"
        self.create_subscription(PoseStamped, request, lambda message: self._ask(self._requests.ask, message), stream_qos(MAX_WAITING))
        self.create_subscription(Twist, "cmd_vel", self._requests.take_twist, stream_qos(1))
        self._diagnostics = Diagnostics(self, self._report)
        self.create_timer(_TICK_S, self._tick)
        self.create_timer(1.0, self._look_for_clocks)
        self._life = start_daemon_job("render", self._rendering.run, after=self._former_life)

    def close(self) -> None:
        """End this life; the kernel at work ends its pass, kernels that compile are not waited for."""
        if self._life is None:
            return
        life, self._life, self._former_life = self._life, None, self._life
        self._inbox.stop()
        if not life.cancel():
            wait([life], _STOP_S)
        life.add_done_callback(self._look_at_end)
        self._output.close(_DELIVERY_S)

    def pause(self) -> None:
        """Say that no more rooms are taken; the frame at work is finished."""
        self._output.tell(state="starting")

    def resume(self) -> None:
        """Go on with what waits."""
        self._inbox.wake()

    def fail(self, reason: str) -> None:
        """Say that the node renders nothing any more."""
        if self._life is not None:
            self._output.tell(state="failed", reason=reason[:1000])
            self._diagnostics.publish()

    def at_work(self) -> str:
        """Return the room at work."""
        return room_name(self._rendering.scene) if self._life is not None else ""

    def _on_change(self, prefixes: set[str]) -> None:
        if "drive" in prefixes and self._life is not None:
            self._requests.drive_config = self._settings["drive"]

    def _ask(self, take: Callable[[Any], None], message: Any) -> None:
        try:
            take(message)
        except FieldError as error:
            self.refuse(f"refused: {error}")
        self._inbox.wake()

    def _on_status(self, status: NodeStatus) -> None:
        was_expected = self._inbox.is_expected
        self._inbox.take_status(status, self._output.published)
        if not self._inbox.is_expected:
            if was_expected:
                self.refuse("the run of another command is in this namespace; its rooms are left alone")
            return
        if status.role == "grammar" and status.run != self._output.status.run:
            self._output.tell(run=status.run, done_scene=-1, refused_scene=-1, begun_scene=-1, shown_ns=-1)
        if status.role == "grammar" and status.state in ("finished", "failed") and self._ends_with_run:
            self.exit_code = 0 if status.state == "finished" else 1
        self._tick()

    def _tick(self) -> None:
        """Say when rooms may come; notice the end of the rendering thread's work, which nobody has asked for."""
        if self._life is None:
            return
        if self._life.done() and self.exit_code is None:
            error = self._life.exception() or RuntimeError("the rendering thread has ended by itself")
            self.exit_code = 1 if isinstance(error, REFUSALS) else FAULT_STATUS
            self.fail(self._tell_end(error))
        elif self._output.status.state == "starting" and self.active and self._rendering.warm:
            self._look_for_clocks()
            if self._recorders_are_connected():
                self._output.tell(state="ready")
                self._inbox.wake()

    def _look_for_clocks(self) -> None:
        """Take ``/clock`` or leave it; say that another suite or simulator publishes it: nodes would see a time that jumps."""
        if not self._rendering.warm:
            return
        wanted = not self._inbox.wall_clock
        others = self._output.settle_clock(wanted=wanted) if wanted or self._output.has_clock else []
        done = "time jumps for who listens" if self._output.has_clock else "this camera leaves it alone"
        before = self._clock_conflict
        self._clock_conflict = f"/clock is published by {', '.join(others)[:200]} too: {done}; {ONE_CLOCK}" if others else ""
        if self._clock_conflict not in ("", before):
            self.refuse(self._clock_conflict)

    def _recorders_are_connected(self) -> bool:
        recorders = self._inbox.recorders
        return len(recorders) >= self._settings[""].expected_recorders and self._output.reach(recorders, self._output.status.start)

    def _look_at_end(self, life: Future[None]) -> None:
        """Tell what a life that was to end has raised instead; may be called in its thread."""
        error = None if life.cancelled() else life.exception()
        if error is not None:
            self._tell_end(error)

    def _tell_end(self, error: BaseException) -> str:
        """Tell why a life has ended; return it in one line."""
        if isinstance(error, REFUSALS):
            line = f"rendering ended: {error_line(error)}"
            self.refuse(line)
            return line
        return self.faults.tell(error, f"{self.get_name()} rendered; its thread has ended")

    def _report(self) -> Report:
        """Return what ``/diagnostics`` says; it reads what the rendering thread replaces as a whole."""
        rendering, life, status, scene = self._rendering, self._rendering.life, self._output.status, self._rendering.scene
        rates, (rate, late_line), shown = life.throughput.rates(time.monotonic()), life.rate.now(), life.meter.known_exposure()
        values = {
            "state": status.state,
            "frames_rendered": self._output.frames,
            "frames_skipped": life.skipped,
            "scenes_refused": rendering.refused,
            "rooms_made_ahead": rendering.made_ahead,
            "room": scene.index if scene is not None else -1,
            "last_room": status.done_scene,
            "rate_wanted_hz": f"{rate.wanted_hz:g}" if rate else "",
            "rate_held_hz": f"{rate.held_hz:.2f}" if rate else "",
            "frames_per_second": f"{rates.frames:.2f}",
            "samples_per_second": f"{rates.samples:.3g}",
            "rays_per_second": f"{rates.rays:.3g}",
            "layers": ", ".join(sorted(self._output.wanted_layers())),
            "exposure_ev100": shown.ev100,
            "white_xy": "{:.3f} {:.3f}".format(*shown.white_xy),
            "camera_place": life.place.now,
            "driven": self._requests.driven,
            "waits_for": life.waiting,
            "last_complaint": self.last_warning(),
        }
        newest_warning = self.last_warning(WARNING_S) or self._clock_conflict
        if status.state == "failed" or newest_warning:
            return ERROR, status.reason if status.state == "failed" else newest_warning, values
        if not rendering.warm:
            return WARN, "compiling kernels", values
        if life.waiting:
            return OK, f"time waits for {life.waiting}", values
        if late_line:
            return WARN, late_line, values
        if life.place.now != IN_THE_ROOM:
            return WARN, f"the camera is {life.place.now}", values
        return OK, "rendering", values


def main(args: list[str] | None = None) -> None:
    """Run the renderer node."""
    run_node(RendererNode, args)


if __name__ == "__main__":
    main()
