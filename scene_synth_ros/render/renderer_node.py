"""The node that renders the rooms it is sent and publishes the streams of one camera."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import String

from renderer import CameraConfig, RenderCancelled, RenderConfig, Renderer, RenderError, SensorConfig, warm_up
from renderer.exposure import exposed, meter, needs_meter, sensor_ev100
from renderer.film.frame import Frame
from renderer.film.tone import Exposure
from renderer.scene.flat_scene import FlatScene
from renderer.scene.flatten import FlattenError, flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, FieldError, Limits, SceneDescription, scene_from_json
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_to_json
from scene_synth_ros.render.camera_requests import MAX_WAITING, CameraRequests
from scene_synth_ros.render.peers import Peers
from scene_synth_ros.render.room_loop import Pace, RoomLoop
from scene_synth_ros.render.streams import StreamPublishers
from scene_synth_ros.render.teleop import DriveConfig
from scene_synth_ros.render.throughput import Throughput
from scene_synth_ros.suite.diagnostics import ERROR, OK, WARN, Diagnostics, Report
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.parameters import ParameterError, Parameters
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.qos import latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json, status_to_json
from scene_synth_ros.suite.suite_node import STEADY, SuiteNode

MAX_SCENES_WAITING = 16
COMPLAINT_S = 10.0
"""How long a complaint is the node's state in ``/diagnostics``; it stays among the values."""
_SHARE_FIXED = "the rooms of a run are shared once"


@dataclass(frozen=True, slots=True, kw_only=True)
class RendererNodeConfig:
    """How a renderer keeps pace, which rooms are its own, and where its user's models are."""

    realtime: Annotated[
        bool, Limits(description="Publish frames at their rate by the wall clock and skip late ones, instead of as fast as can be")
    ] = False
    expected_recorders: Annotated[
        int,
        Limits(ge=0, le=100, description="Recorders whose subscriptions it waits for before it says ready", fixed="peers are counted once"),
    ] = 0
    frames_ahead: Annotated[
        int,
        Limits(ge=1, le=1000, description="Frames that may be published beyond what the slowest recorder has taken, within the QoS depth"),
    ] = 8
    share_count: Annotated[int, Limits(ge=1, le=100, description="Renderers that share the rooms by index", fixed=_SHARE_FIXED)] = 1
    share_index: Annotated[
        int, Limits(ge=0, le=99, description="This one renders the rooms whose index leaves this remainder", fixed=_SHARE_FIXED)
    ] = 0
    frames_held: Annotated[
        int, Limits(ge=1, le=10_000, description="Frames of a shared room that may wait in memory until its turn comes")
    ] = 64
    catalog_dir: Annotated[
        str, Limits(max_length=1000, description="Folder of the user's models; empty: none", fixed="files are read from one folder")
    ] = ""
    autostart: Annotated[bool, Limits(description="Configure and activate at the start", fixed="it is used at the start only")] = True
    exit_when_done: Annotated[bool, Limits(description="End the process when the grammar node has finished")] = False


class RendererNode(SuiteNode):
    """Renders every room that arrives on ``scene`` along its camera path; rendering runs in a thread of its own.

    Subscribes: ``scene`` (std_msgs/String, latched, JSON ``scene_synth/1``), ``scene/map``; ``status`` of the other nodes;
    ``<camera>/request`` (PoseStamped: the frame of a pose in the present room, with the stamp of the request, or the next free nanosecond
    if that is 0); ``cmd_vel`` (Twist: moves the camera, where ``drive.enabled``). Publishes: the topics of ``StreamPublishers``, ``status``
    (latched), ``/diagnostics``. Parameters: the fields of ``RendererNodeConfig``; ``camera.`` CameraConfig; ``render.`` RenderConfig;
    ``sensor.`` SensorConfig; ``streams.`` StreamConfig; ``drive.`` DriveConfig.  Live changes of the exposure take effect with the next
    frame, others with the next room.  A scene or pose that does not fit is refused with one line; the node keeps running.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("renderer_node", **options)
        groups = {"camera": CameraConfig, "render": RenderConfig, "streams": StreamConfig, "drive": DriveConfig, "sensor": SensorConfig}
        self._settings = Parameters(
            self, {"": RendererNodeConfig, **groups}, self._on_change, lambda values: sensor_ev100(values["camera"], values["sensor"])
        )
        config: RendererNodeConfig = self._settings[""]
        if config.share_index >= config.share_count:
            got = f"expected less than share_count = {config.share_count}, got {config.share_index}"
            raise ParameterError(f"{self.get_name()}: parameter share_index: {got}")
        self._thread: threading.Thread | None = None
        self.begin(config.autostart)

    def open(self) -> None:
        """Make publishers and subscriptions, start the rendering thread, which loads the kernels."""
        config: RendererNodeConfig = self._settings[""]
        self._catalog_dir = Path(config.catalog_dir) if config.catalog_dir else None
        if self._catalog_dir is not None and not self._catalog_dir.is_dir():
            raise FileNotFoundError(f"{self.get_name()}: catalog_dir: expected a folder, got '{config.catalog_dir}'")
        streams: StreamConfig = self._settings["streams"]
        self._streams = StreamPublishers(self, streams, self._settings["camera"])
        self._wake = threading.Condition()
        self._waiting: deque[str] = deque(maxlen=MAX_SCENES_WAITING)
        self._closed = self._on_path = False
        self._requests, self._throughput = CameraRequests(streams.world_frame, self._settings["drive"]), Throughput()
        self._peers = Peers(self.get_fully_qualified_name(), self._streams.frame_topic, config.share_count)
        self._scene: SceneDescription | None = None
        self._frames = self._skipped = self._skipped_before = self._refused = 0
        self._done_scene, self._refused_scene, self._first_room, self._room_began = -1, -1, True, 0.0
        self._flat: FlatScene | None = None
        self._metered: Exposure | None = None
        self._warm, self._fault, self._complaint, self._complained_at = False, "", "", 0.0
        self._status = self.create_publisher(String, "status", latched_qos(10))
        self._state, self._start = "starting", self._streams.start
        self._publish_status()
        self.create_subscription(String, "status", self._on_status, latched_qos(100))
        self.create_subscription(String, "scene", self._on_scene, latched_qos(MAX_SCENES_WAITING))
        self.create_subscription(OccupancyGrid, "scene/map", lambda message: self._ask(self._requests.take_map, message), latched_qos())
        camera = streams.camera
        self.create_subscription(
            PoseStamped, f"{camera}/request", lambda message: self._ask(self._requests.ask, message), stream_qos(MAX_WAITING)
        )
        self.create_subscription(Twist, "cmd_vel", self._requests.take_twist, stream_qos(1))
        self._diagnostics = Diagnostics(self, self._report)
        self.create_timer(0.05, self._tick)
        self._thread = threading.Thread(target=self._work, name="render", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop rendering; the kernel at work ends its pass."""
        if self._thread is None:
            return
        with self._wake:
            self._closed = True
            self._wake.notify_all()
        self._thread.join(timeout=0.6)
        self._thread = None
        self._streams.wait_until_delivered(0.3)

    def pause(self) -> None:
        """Say that no more rooms are taken; the frame at work is finished."""
        self._state = "starting"
        self._publish_status()

    def resume(self) -> None:
        """Go on with what waits."""
        with self._wake:
            self._wake.notify_all()

    def _on_change(self, prefixes: set[str]) -> None:
        if "drive" in prefixes and self._thread is not None:
            self._requests.drive_config = self._settings["drive"]

    def _ask(self, take: Any, message: Any) -> None:
        try:
            take(message)
        except FieldError as error:
            self._refuse(f"refused: {error}")
        with self._wake:
            self._wake.notify_all()

    def _on_scene(self, message: String) -> None:
        with self._wake:
            self._waiting.append(message.data)
            self._wake.notify_all()

    def _on_status(self, message: String) -> None:
        try:
            status = status_from_json(message.data)
        except FieldError as error:
            self._complain(f"ignored a status that does not fit: {error}")
            return
        with self._wake:
            self._peers.take(status, self._streams.counts[self._streams.frame_topic])
            self._wake.notify_all()
        if status.role == "grammar" and status.state in ("finished", "failed") and self._settings[""].exit_when_done:
            self.exit_code = 0 if status.state == "finished" else 1

    def _tick(self) -> None:
        if self._fault:
            self._state = "failed"
            self._publish_status()
            self.exit_code = 1
        elif self._state == "starting" and self.active and self._warm and self._recorders_are_connected():
            self._state = "ready"
            self._publish_status()
            with self._wake:
                self._wake.notify_all()

    def _recorders_are_connected(self) -> bool:
        recorders = self._peers.recorders
        return len(recorders) >= self._settings[""].expected_recorders and self._streams.reach(recorders, self._start)

    def _work(self) -> None:
        try:
            began = time.perf_counter()
            self.get_logger().info("loading kernels (the first run compiles them)")
            warm_up()
            self.get_logger().info(f"kernels are ready ({time.perf_counter() - began:.1f} s)")
            self._warm = True
            while (text := self._next_scene()) is not None:
                self._take_scene(text)
                trim_heap()
        except Exception as error:  # whatever it is, the run must hear of it rather than wait for ever
            self._fault = f"{type(error).__name__}: {error}"
            self.get_logger().fatal(f"rendering ended: {self._fault}")

    def _next_scene(self) -> str | None:
        with self._wake:
            self._wake.wait_for(lambda: self._closed or self._waiting)
            while len(self._waiting) > 1 and not self._peers.rooms_wait:
                self._waiting.popleft()
            return None if self._closed else self._waiting.popleft()

    def _take_scene(self, text: str) -> None:
        try:
            scene = scene_from_json(text)
        except FieldError as error:
            self._refuse(f"refused a scene: {error}")
            return
        config: RendererNodeConfig = self._settings[""]
        if config.share_count > 1 and (scene.index % config.share_count != config.share_index or scene.index <= self._peers.finished_scene):
            self._finish_room(scene.index)
            return
        if max(self._done_scene, self._refused_scene) >= scene.index:  # the run begins again
            self._refused_scene = -1
            self._finish_room(scene.index - 1)
        self._render_config: RenderConfig = self._settings["render"]
        try:
            flat = flatten(scene, self._catalog_dir)
            camera, sensor = self._settings["camera"], self._settings["sensor"]
            with Renderer(flat, camera, self._render_config, scene_key(scene), sensor=sensor) as renderer:
                self._show(scene, flat, renderer)
        except RenderCancelled:
            return
        except (FlattenError, RenderError) as error:
            self._refused_scene = scene.index
            self._refuse(f"refused room {scene.index}: {error}")
            self._publish_status()
        finally:
            self._on_path = False

    def _show(self, scene: SceneDescription, flat: FlatScene, renderer: Renderer) -> None:
        self._scene, self._on_path, self._room_began = scene, True, time.perf_counter()
        self._streams.begin_room(scene)
        self._requests.begin_room()
        self._flat, self._metered = flat, None
        trim_heap()
        RoomLoop(scene, renderer, self._settings["camera"], self, self._requests, self._pace).run()

    def _meter(self) -> Exposure | None:
        """Meter the room, once its colour is wanted: never while who wants it may not be connected yet."""
        assert self._scene is not None and self._flat is not None
        if not needs_meter(self._render_config) or "color" not in self._streams.wanted_layers():
            return None
        metered = meter(self._flat, self._settings["camera"], self._render_config, scene_key(self._scene), self._scene.camera_path)
        trim_heap()
        return metered

    def _pace(self) -> Pace:
        config: RendererNodeConfig = self._settings[""]
        return Pace(realtime=config.realtime, frames_held=config.frames_held if config.share_count > 1 else 1)

    def interrupted(self) -> bool:
        """Return whether the room must be left: for the end, or for the next room, unless that waits until the path is done."""
        return self._closed or (bool(self._waiting) and not (self._on_path and self._peers.rooms_wait))

    def paused(self) -> bool:
        """Return whether frames must wait: for *activate*, or for recorders that would lose them."""
        return not self.active or self._state == "starting"

    def wait(self, seconds: float) -> None:
        """Wait for so long, or until a message has come."""
        with self._wake:
            if not self.interrupted() and not self._requests.waiting:
                self._wake.wait(seconds)

    def wanted_layers(self) -> Collection[str]:
        """Return the layers that somebody wants."""
        return self._streams.wanted_layers()

    def exposure(self) -> Exposure:
        """Return the exposure of the next frame; the room is metered for the first one."""
        self._metered = self._metered or self._meter()
        return self._known_exposure()

    def _known_exposure(self) -> Exposure:
        fixed = sensor_ev100(self._settings["camera"], self._settings["sensor"])
        return exposed(self._settings["render"], self._metered, fixed)

    def is_turn(self) -> bool:
        """Return whether the room's frames may be published now."""
        return self._scene is not None and self._peers.is_turn(self._scene.index, self._first_room)

    def publish(self, frame: Frame, pose: CameraPose, index: int, exposure: Exposure) -> None:
        """Publish a frame with its settings, when the recorders have room for it."""
        assert self._scene is not None
        self._wait_for_recorders()
        settings = FrameSettings(
            stamp_ns=pose.stamp_ns,
            scene=self._scene.id,
            frame=index,
            exposure_ev100=exposure.ev100,
            sensor=self._settings["sensor"],
            white_xy=exposure.white_xy,
            camera=self._settings["camera"],
            render=self._render_config,
            streams=self._settings["streams"],
        )
        self._streams.publish(frame, pose, settings_to_json(settings))
        self._frames += 1
        self._throughput.take(time.monotonic(), frame.samples * settings.camera.width * settings.camera.height, frame.rays)
        if not self._on_path:
            self._publish_status()
        line = f"room {self._scene.index}: {self._frames} frames since the start"
        self.get_logger().info(line, throttle_duration_sec=2.0, throttle_time_source_type=STEADY)

    def skip(self) -> None:
        """Count a frame that is left out because it would be late."""
        self._skipped += 1

    def path_done(self, published: int) -> None:
        """Say that the room is finished."""
        assert self._scene is not None
        self._on_path = self._first_room = False
        self._finish_room(self._scene.index)
        seconds = time.perf_counter() - self._room_began
        self.get_logger().info(f"room {self._scene.index}: {published} frames rendered in {seconds:.1f} s")

    def _finish_room(self, index: int) -> None:
        self._done_scene = index
        self._publish_status()

    def _wait_for_recorders(self) -> None:
        """Hold back while a recorder is ``frames_ahead`` frames behind, or as many as are kept for it, so that no queue overflows.

        Meanwhile the status says what has been published, so that a recorder that waits for what was lost hears of it.
        """
        config: RendererNodeConfig = self._settings[""]
        if config.expected_recorders == 0:
            return
        published, began = self._streams.counts[self._streams.frame_topic], time.monotonic()
        ahead = min(config.frames_ahead, self._streams.depth)
        with self._wake:
            while not self._wake.wait_for(lambda: self._closed or self._peers.has_room(published, ahead), timeout=1.0):
                self._publish_status()
                if time.monotonic() - began > 10.0:
                    self._complain("a recorder has taken no frame for 10 s; waiting")

    def _publish_status(self) -> None:
        status = NodeStatus(
            node=self.get_fully_qualified_name(),
            role="renderer",
            state=self._state,
            done_scene=self._done_scene,
            refused_scene=self._refused_scene,
            reason=(self._fault or self._complaint)[:1000],
            counts=dict(self._streams.counts),
            start=self._start,
        )
        self._status.publish(String(data=status_to_json(status)))

    def _refuse(self, text: str) -> None:
        self._refused += 1
        self._complain(text)

    def _complain(self, text: str) -> None:
        self._complaint, self._complained_at = text, time.monotonic()
        self.get_logger().error(text, throttle_duration_sec=1.0, throttle_time_source_type=STEADY)

    def _report(self) -> Report:
        rates = self._throughput.rates(time.monotonic())
        late, self._skipped_before = self._skipped - self._skipped_before, self._skipped
        shown = self._known_exposure()
        values = {
            "state": self._state,
            "frames_rendered": self._frames,
            "frames_skipped": self._skipped,
            "scenes_refused": self._refused,
            "last_room": self._done_scene,
            "frames_per_second": f"{rates.frames:.2f}",
            "samples_per_second": f"{rates.samples:.3g}",
            "rays_per_second": f"{rates.rays:.3g}",
            "layers": ", ".join(sorted(self._streams.wanted_layers())),
            "exposure_ev100": shown.ev100,
            "white_xy": "{:.3f} {:.3f}".format(*shown.white_xy),
            "driven": self._requests.driven,
            "last_complaint": self._complaint,
        }
        if self._fault or (self._complaint and time.monotonic() - self._complained_at < COMPLAINT_S):
            return ERROR, self._fault or self._complaint, values
        if late or not self._warm:
            slow = f"{rates.frames:.1f} frames/s, fewer than asked for, {late} left out: lower render.samples_per_pixel or the image size"
            return WARN, slow if self._warm else "compiling kernels", values
        return OK, "rendering", values


def main(args: list[str] | None = None) -> None:
    """Run the renderer node."""
    run_node(RendererNode, args)


if __name__ == "__main__":
    main()
