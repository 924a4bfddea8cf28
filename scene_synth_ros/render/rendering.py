"""One life of the rendering thread: it loads the kernels, then renders room after room until it is stopped."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Collection
from contextlib import closing
from pathlib import Path

from renderer import WARM_LAYERS, RenderCancelled, RenderConfig, annotations, warm_up
from renderer.film.frame import Frame
from renderer.film.layers import PHOTOGRAPHS
from renderer.film.tone import Exposure
from renderer.lidar.config import ScanConfig
from renderer.lidar.scanner import Scanner
from renderer.scene.scene_key import scene_key
from renderer.standpoint import standpoint
from scene_description import CameraPose, SceneDescription, SceneSynthError, error_line, scene_from_json
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_to_json
from scene_synth_ros.render.camera_requests import CameraRequests
from scene_synth_ros.render.frame_report import CameraPlace, RateReport, Throughput
from scene_synth_ros.render.inbox import Inbox
from scene_synth_ros.render.next_room import NextRoom
from scene_synth_ros.render.renderer_config import RendererNodeConfig
from scene_synth_ros.render.room import Room, RoomMeter, RoomRenderer, RoomSettings, room_settings
from scene_synth_ros.render.room_loop import Pace, RoomLoop
from scene_synth_ros.render.room_scans import RoomScans
from scene_synth_ros.render.streams import Output
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.suite_node import SuiteNode

_RECORDER_PATIENCE_S = 10.0


class Rendering:
    """Renders the rooms of an inbox and publishes their frames; the host of each room's loop.

    Threading: :meth:`run` is the rendering thread, and every other method is called in it.  The executor's thread makes this object and
    reads its attributes: ``warm``, ``scene`` and the counts are replaced as a whole; ``meter``, ``throughput`` and ``rate`` guard
    themselves, as do ``inbox``, ``output``, ``requests`` and ``place``.

    Args:
        node: whose ``warn``, ``refuse``, ``faults`` and ``active`` are used.
        settings: the node's parameters.
        inbox: rooms and peers.
        output: frames and status.
        requests: poses asked for, and the driven camera.

    Attributes:
        warm: whether the kernels are loaded.
        scene: the room at work, None while there is none.
        skipped: frames left out because they would have been late.
        refused: scenes and rooms that could not be rendered.
        made_ahead: rooms that were made while the one before was shown.
        meter: knows the exposure.
        throughput: frames, samples and rays a second.
        rate: whether frames keep up with their rate, in real time.
        place: whether frames are seen from within the room.
    """

    def __init__(self, node: SuiteNode, settings: Parameters, inbox: Inbox, output: Output, requests: CameraRequests) -> None:
        self._node, self._settings, self._inbox, self._output, self._requests = node, settings, inbox, output, requests
        config: RendererNodeConfig = settings[""]
        self._catalog_dir = Path(config.catalog_dir) if config.catalog_dir else None
        if self._catalog_dir is not None and not self._catalog_dir.is_dir():
            raise FileNotFoundError(f"{node.get_name()}: catalog_dir: expected a folder, got '{config.catalog_dir}'")
        self.warm, self.skipped, self.refused, self.made_ahead = False, 0, 0, 0
        self.scene: SceneDescription | None = None
        self.meter, self.throughput = RoomMeter(settings), Throughput()
        self.rate, self.place = RateReport(node, settings), CameraPlace(node.get_logger())
        self._standpoint: Callable[[CameraPose], str] = lambda pose: ""
        self._render_config: RenderConfig = settings["render"]
        self._scan_config: ScanConfig = settings["scan"]
        self._scans: RoomScans | None = None
        self._next = NextRoom(node.faults)
        self._room: Room | None = None
        self._sent: dict[str, int] = {}
        self._first_room, self._on_path, self._shown, self._newest_room, self._room_began_s = True, False, False, -1, 0.0

    def run(self) -> None:
        """Load the kernels, then render what comes until the inbox is stopped.

        Raises:
            RenderError: Embree is missing.
        """
        began = time.perf_counter()
        self._node.get_logger().info("loading kernels (the first run compiles them)")
        render: RenderConfig = self._settings["render"]
        warm_up({*WARM_LAYERS, *self._output.streams.messages.layers}, self._settings["depth_sensor"], render.integrator)
        if self._settings["streams"].annotations:
            annotations.warm_up()
        self._node.get_logger().info(f"kernels are ready ({time.perf_counter() - began:.1f} s)")
        self.warm = True
        try:
            while (text := self._inbox.next_room()) is not None:
                self._take_room(text)
                trim_heap()
        finally:
            self._next.drop()

    def _take_room(self, text: str) -> None:
        """Render a room; what is wrong with it, or with the program, ends this room only."""
        try:
            self.scene = scene_from_json(text)
            if self._is_own(self.scene):
                self._render_room(self.scene)
        except RenderCancelled:
            pass
        except (SceneSynthError, OSError) as error:
            reason = f"refused {f'room {self.scene.index}' if self.scene else 'a scene'}: {error_line(error)}"
            self._node.refuse(reason)
            self._give_up(reason)
        except Exception as error:
            self._give_up(self._node.faults.tell(error, f"{self._node.get_name()} rendered {room_name(self.scene) or 'a scene'}"))
        finally:
            self._on_path, self.scene = False, None

    def _give_up(self, reason: str) -> None:
        """Tell the peers not to wait for the room at work."""
        self.refused += 1
        if self.scene is not None:
            self._output.tell(refused_scene=self.scene.index, reason=reason[:1000])

    def _is_own(self, scene: SceneDescription) -> bool:
        """Return whether this renderer renders a room; those of others, and rooms that were never sent, count as finished."""
        config: RendererNodeConfig = self._settings[""]
        status, newest, self._newest_room = self._output.status, self._newest_room, scene.index
        if config.share_count > 1:
            if scene.index % config.share_count != config.share_index or scene.index <= self._inbox.finished_scene:
                self._output.tell(done_scene=scene.index)
                return False
            if 0 <= newest < scene.index - 1:
                self._output.tell(done_scene=scene.index - 1)
        if max(status.done_scene, status.refused_scene) >= scene.index:  # the run begins again
            self._output.tell(done_scene=scene.index - 1, refused_scene=-1)
        return True

    def _render_room(self, scene: SceneDescription) -> None:
        self._render_config, self._scan_config = self._settings["render"], self._settings["scan"]
        settings = self._room_settings()
        ahead = self._next.take(scene, settings, lambda: self._inbox.must_leave(on_path=True))
        self.made_ahead += ahead is not None
        self._room = ahead or Room(scene, settings, self._room)
        with closing(self._room) as room:
            renderer = RoomRenderer(lambda: room.renderer, lambda: room.annotator)
            if not self._pace().realtime:  # else a room that nobody looks at is not even made
                renderer.prepare()
            self._on_path, self._shown, self._room_began_s = True, False, time.perf_counter()
            self._output.streams.begin_room(scene)
            self._requests.begin_room()
            self.place.begin_room()
            self._standpoint = lambda pose: standpoint(room.renderer.tree, room.flat, scene, pose.position_m)
            self.meter.begin_room(self._render_config, lambda: room.metered)
            scan = self._scan_config
            self._scans = RoomScans(
                scan, scene.camera_path, functools.cache(lambda: Scanner(room.renderer.tree, room.flat, scan, scene_key(scene)))
            )
            RoomLoop(scene, renderer, settings.camera, self, self._requests, self._pace).run()

    def _room_settings(self) -> RoomSettings:
        return room_settings(self._settings, self._catalog_dir)

    def _look_ahead(self) -> None:
        """Begin with the next room if it is known, in real time and while somebody looks; else nothing would wait for it."""
        config: RendererNodeConfig = self._settings[""]
        layers = self.wanted_layers()
        if self._room is None or not layers or not self._pace().realtime or config.share_count > 1:
            return
        text = self._inbox.take_announced()
        if text is not None:
            self._next.begin(text, self._room, self._room_settings(), layers)

    def _pace(self) -> Pace:
        config: RendererNodeConfig = self._settings[""]
        wall_clock = self._inbox.wall_clock
        frames_held = config.frames_held if config.share_count > 1 else 1
        return Pace(realtime=config.realtime or wall_clock, wall_clock=wall_clock, frames_held=frames_held)

    def interrupted(self) -> bool:
        """Return whether the room must be left: for the end, or for the next room, unless that waits until the path is done."""
        config: RendererNodeConfig = self._settings[""]
        return self._inbox.must_leave(self._on_path, self._shown or config.share_count > 1 or self.paused())

    def paused(self) -> bool:
        """Return whether frames must wait: for *activate*, or for recorders that would lose them."""
        return not self._node.active or self._output.status.state == "starting"

    def wait(self, seconds: float) -> None:
        """Wait for so long, or until a message has come."""
        self._inbox.wait(seconds, unless=lambda: self.interrupted() or self._requests.waiting)

    def wanted_layers(self) -> Collection[str]:
        """Return the layers that somebody wants."""
        return self._output.wanted_layers()

    def exposure(self) -> Exposure:
        """Return the exposure of the next frame; the room is metered for the first one with colour."""
        return self.meter.exposure(any(layer in PHOTOGRAPHS for layer in self.wanted_layers()))

    def is_turn(self) -> bool:
        """Return whether the room's frames may be published now."""
        return self.scene is not None and self._inbox.is_turn(self.scene.index, self._first_room)

    def publish(self, frame: Frame, pose: CameraPose, index: int, exposure: Exposure) -> None:
        """Publish a frame with its settings, when the recorders have room for it."""
        assert self.scene is not None
        began = time.perf_counter()
        self._wait_for_recorders()
        self.rate.waiting_s = time.perf_counter() - began
        began = time.perf_counter()
        if frame.layers:
            self.place.take(self.scene, pose, self._standpoint)
        self._publish_scans(pose.stamp_ns)
        settings = FrameSettings(
            stamp_ns=pose.stamp_ns,
            scene=self.scene.id,
            frame=index,
            exposure_ev100=exposure.ev100,
            sensor=self._settings["sensor"],
            depth_sensor=self._settings["depth_sensor"],
            white_xy=exposure.white_xy,
            camera=self._settings["camera"],
            render=self._render_config,
            streams=self._settings["streams"],
            scan=self._scan_config,
            sent=self._sent,
        )
        self._output.publish_frame(frame, pose, settings_to_json(settings), with_clock=not self._inbox.wall_clock)
        self._shown = True
        self.rate.publishing_s = time.perf_counter() - began
        self.throughput.take(time.monotonic(), frame.samples * settings.camera.width * settings.camera.height, frame.rays)
        if not self._on_path:
            self._output.tell()
        self._look_ahead()

    def go(self, pose: CameraPose) -> None:
        """Take where the rig is."""
        if self._scans is not None and self._scan_config.enabled:
            self._scans.go(pose)

    def _publish_scans(self, stamp_ns: int) -> None:
        """Publish the scans that begin up to a frame's stamp, and remember the stamps of the last ones."""
        if self._scans is not None:
            for poses, scan in self._scans.due(stamp_ns, self._output.wants_scans):
                self._sent = self._sent | self._output.publish_scan(poses, scan)

    def rendered(self, frame: Frame, seconds: float, period_s: float) -> None:
        """Take how long a frame took, in real time."""
        self.rate.take(frame, seconds, period_s)

    def skip(self) -> None:
        """Count a frame that is left out because it would be late."""
        self.skipped += 1

    def path_done(self, published: int) -> None:
        """Say that the room is finished."""
        assert self.scene is not None
        self._on_path = self._first_room = False
        self._output.tell(done_scene=self.scene.index)
        seconds = time.perf_counter() - self._room_began_s
        self._node.get_logger().info(f"room {self.scene.index}: {published} frames rendered in {seconds:.1f} s")

    def _wait_for_recorders(self) -> None:
        """Hold back while a recorder is ``frames_ahead`` frames behind, or as many as are kept for it, so that no queue overflows.

        Meanwhile the status says what has been published, so that a recorder that waits for what was lost hears of it.
        """
        config: RendererNodeConfig = self._settings[""]
        if config.expected_recorders == 0:
            return
        published, began = self._output.published, time.monotonic()
        ahead = min(config.frames_ahead, self._output.streams.depth)
        while not self._inbox.wait_for_recorders(published, ahead, 1.0):
            self._output.tell()
            if time.monotonic() - began > _RECORDER_PATIENCE_S:
                self._node.warn(f"a recorder has taken no frame for {_RECORDER_PATIENCE_S:g} s; waiting")


def room_name(scene: SceneDescription | None) -> str:
    """Return a room as a fault's report names it; empty if there is none."""
    return f"room {scene.index} of seed {scene.seed}" if scene is not None else ""
