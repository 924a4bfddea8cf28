"""The loop of one room: its camera path, then what is asked for, until the next room comes."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from renderer.camera.rig import mounted, mounted_path, rig_path
from renderer.film.frame import Frame
from renderer.film.layers import PHOTOGRAPHS
from renderer.film.tone import Exposure
from scene_description import CameraPose
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_to_json
from scene_synth_ros.messages.room_body import RoomBody
from scene_synth_ros.messages.senses import senses_of
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.render.camera_requests import CameraRequests
from scene_synth_ros.render.driven_base import DrivenBase, can_be_driven
from scene_synth_ros.render.frame_report import CameraPlace, RateReport, Throughput
from scene_synth_ros.render.inbox import Inbox
from scene_synth_ros.render.renderer_config import RendererNodeConfig
from scene_synth_ros.render.room import RenderedRoom, RoomMeter, frame_index
from scene_synth_ros.render.room_scans import RoomScans
from scene_synth_ros.render.stream_topics import CLOCK
from scene_synth_ros.render.streams import StreamPublishers
from scene_synth_ros.suite.parameters import Parameters
from scene_synth_ros.suite.suite_node import SuiteNode

_IDLE_S = 0.2
_SOON_S = 1.0
"""A wall clock that is set back while a room is on its way does not hold the room up for longer."""
_RECORDER_PATIENCE_S = 10.0
BEGIN_PATIENCE_S = 20.0
"""In real time, a room begins without the cameras that have no first frame of it so long after this one."""


class Pace(NamedTuple):
    """How frames follow each other: at their rate or as fast as can be, each at its stamp where that is the time of day.

    ``frames_held`` may wait for their turn.
    """

    realtime: bool
    wall_clock: bool
    frames_held: int


@dataclass(slots=True, kw_only=True)
class Life:
    """What the rooms of one life of the rendering thread share.

    Threading: the rendering thread; the executor's thread reads, what it reads is replaced as a whole or guards itself.

    Attributes:
        node: whose ``warn``, ``active`` and logger are used.
        settings: the node's parameters.
        inbox: rooms and peers.
        output: frames and status.
        requests: poses asked for, and the driven camera.
        meter: knows the exposure.
        throughput: frames, samples and rays a second.
        rate: whether frames keep up with their rate, in real time.
        place: whether frames are seen from within the room.
        skipped: frames left out because they would have been late.
        waiting: what a room's time waits for, in words; empty if it goes on.
        given_up: other renderers that a room was begun without; they are not waited for again.
        sent: topics with stamps of their own -> stamp (ns) of the last message that went out.
        first_room: whether no room has been finished yet.
    """

    node: SuiteNode
    settings: Parameters
    inbox: Inbox
    output: StreamPublishers
    requests: CameraRequests
    meter: RoomMeter
    throughput: Throughput
    rate: RateReport
    place: CameraPlace
    skipped: int = 0
    waiting: str = ""
    given_up: set[str] = field(default_factory=set)
    sent: dict[str, int] = field(default_factory=dict)
    first_room: bool = True

    @property
    def config(self) -> RendererNodeConfig:
        """The node's own parameters."""
        config: RendererNodeConfig = self.settings[""]
        return config

    def pace(self) -> Pace:
        """Return how frames follow each other now."""
        config, wall_clock = self.config, self.inbox.wall_clock
        return Pace(config.realtime or wall_clock, wall_clock, config.frames_held if config.share_count > 1 else 1)


class RoomLoop:
    """Renders one room and publishes its frames.

    Threading: everything is called in the rendering thread.

    Args:
        shown: called after every frame that was published.
    """

    def __init__(self, room: RenderedRoom, life: Life, shown: Callable[[], None]) -> None:
        self._room, self._scene, self._camera = room, room.scene, room.settings.camera
        self._life, self._inbox, self._output, self._requests = life, life.inbox, life.output, life.requests
        self._shown, self._pace = shown, life.pace
        self._path = mounted_path(self._camera, self._scene.camera_path, self._scene.motion)
        self._senses = senses = senses_of(life.settings)
        self._scans = RoomScans(senses.scan, rig_path(self._scene.camera_path, self._scene.motion), lambda: room.scanner(senses.scan))
        self._body = RoomBody(self._scene, self._camera, life.settings["streams"], senses, room.lidar)
        drive, drives = life.requests.drive_config, can_be_driven(self._scene, senses) and life.config.share_count == 1
        streams = life.settings["streams"]
        self._base = DrivenBase(self._scene, lambda: room.flat.mesh, self._camera, streams, senses) if drive.enabled and drives else None
        self._held: deque[tuple[Frame, CameraPose, int, Exposure]] = deque()
        self._last_ns = self._answered_ns = -1
        self._published = 0
        self._on_path = True

    def run(self) -> None:
        """Render the path, say that it is done, then serve requests until the room must be left."""
        self._began_s = time.perf_counter()
        self._output.messages.begin_room(self._scene)
        start_ns = self._scene.camera_path[0].stamp_ns
        self._life.sent = {topic: sent_ns for topic, sent_ns in self._life.sent.items() if sent_ns < start_ns}  # time may have been reset
        self._requests.begin_room()
        self._life.place.begin_room()
        self._life.meter.begin_room(self._room.settings.render, lambda: self._room.metered)
        if self._show_path():
            self._idle()

    def _show_path(self) -> bool:
        """Render the camera path; return False if the room must be left."""
        path = self._scene.camera_path
        start_ns = path[0].stamp_ns
        began = self._at_time_of_day(start_ns)
        for index, pose in enumerate(path):
            waited_s = self._wait_while_paused(pose.stamp_ns)
            is_simulated = not self._pace().wall_clock
            began += waited_s if is_simulated else 0.0
            self._serve_requests()
            if self._interrupted():
                return False
            if self._is_too_late(index, began):
                self._life.skipped += 1
                continue
            spacing_s = (pose.stamp_ns - path[index - 1].stamp_ns) / NANOSECONDS if index else 0.0
            if self._pace().realtime and index == 0:
                self._life.waiting = f"the first frame of room {self._scene.index}"
            frame = self._render(self._go(pose, spacing_s), spacing_s)
            if index == 0:
                self._wait_for_cameras()
                began = time.perf_counter() if is_simulated else began
            if self._pace().realtime:
                self._sleep_until(began + (pose.stamp_ns - start_ns) / NANOSECONDS)
            self._hold(*frame)
        while self._held and not self._interrupted():
            if self._is_turn():
                self._release()
            else:
                self._wait(_IDLE_S)
        if self._held or self._interrupted():
            return False
        self._finish_path()
        return True

    def _wait_for_cameras(self) -> None:
        """Say that the room's first frame is there; in real time, wait until it is of the suite's other cameras, too, but not for ever.

        Where stamps are the time of day it does not wait for anybody.
        """
        life, room = self._life, self._scene.index
        self._output.tell(begun_scene=room)
        deadline = time.monotonic() + BEGIN_PATIENCE_S
        while self._pace().realtime and not self._pace().wall_clock and not self._interrupted():
            late = self._inbox.not_begun(room) - life.given_up
            if late and time.monotonic() > deadline:
                life.given_up |= late
                life.node.warn(f"room {room} begins without {', '.join(sorted(late))}: no first frame in {BEGIN_PATIENCE_S:g} s")
            elif late:
                life.waiting = f"the first frame of room {room} of {', '.join(sorted(late))}"
                self._inbox.wait(_IDLE_S, unless=lambda: False)
                continue
            break
        life.waiting = ""

    def _at_time_of_day(self, start_ns: int) -> float:
        """Return when the path begins, by the counter: now, or at its stamp where that is the time of day, but soon in any case."""
        ahead_s = (start_ns - time.time_ns()) / NANOSECONDS if self._pace().wall_clock else 0.0
        return time.perf_counter() + min(ahead_s, _SOON_S)

    def _idle(self) -> None:
        """Serve what is asked for, and go on driving at the path's rate."""
        path = self._scene.camera_path
        spacing_ns = path[-1].stamp_ns - path[-2].stamp_ns if len(path) > 1 else NANOSECONDS // 10
        due = time.perf_counter()
        while not self._interrupted():
            self._wait_while_paused()
            self._serve_requests()
            if not (self._pace().realtime and (self._requests.driven or self._base is not None)):
                self._wait(_IDLE_S)
                due = time.perf_counter()
                continue
            due = max(due + spacing_ns / NANOSECONDS, time.perf_counter())
            pose = replace(path[-1], stamp_ns=self._last_ns + spacing_ns)
            frame = self._render(self._go(pose, spacing_ns / NANOSECONDS), spacing_ns / NANOSECONDS)
            self._sleep_until(due)
            if not self._interrupted():
                self._publish(*frame)

    def _serve_requests(self) -> None:
        """Render the poses that wait, each once, if the room may be published."""
        while self._requests.waiting and self._is_turn() and not self._interrupted():
            self._release()
            pose = self._requests.next_pose()
            if pose is not None:
                now_ns = time.time_ns() if self._pace().wall_clock else 0
                free_ns = max(self._last_ns + 1, self._answered_ns + 1, self._scene.camera_path[0].stamp_ns + 1, now_ns)
                if not pose.stamp_ns:
                    self._answered_ns = free_ns
                self._publish(*self._render(replace(pose, stamp_ns=pose.stamp_ns or free_ns)), asked=True)

    def _render(self, pose: CameraPose, period_s: float = 0.0) -> tuple[Frame, CameraPose, int, Exposure]:
        """Render a pose; the first of a room and those asked for have no period."""
        exposure = self._life.meter.exposure(any(layer in PHOTOGRAPHS for layer in self._output.wanted_layers()))
        index = frame_index(self._scene, pose)
        layers = self._output.wanted_layers()
        placed = mounted(self._camera, pose)
        began = time.perf_counter()
        frame = self._room.render(placed, index, layers, exposure=exposure, path=self._path, cancelled=self._interrupted)
        if self._pace().realtime:
            self._life.rate.take(frame, time.perf_counter() - began, period_s)
        return frame, placed, index, exposure

    def _hold(self, frame: Frame, pose: CameraPose, index: int, exposure: Exposure) -> None:
        """Publish a frame when the room's turn has come; until then keep as many as may wait."""
        self._held.append((frame._replace(radiance=None), pose, index, exposure))
        while not self._is_turn() and not self._interrupted() and len(self._held) >= self._pace().frames_held:
            self._wait(_IDLE_S)
        if self._is_turn():
            self._release()

    def _release(self) -> None:
        while self._held and not self._interrupted():
            self._publish(*self._held.popleft())

    def _publish(self, frame: Frame, pose: CameraPose, index: int, exposure: Exposure, *, asked: bool = False) -> None:
        """Publish a frame with its settings and the scans that begin up to it, when the recorders have room for it.

        Time does not pass with one that was ``asked`` for.
        """
        life, values = self._life, self._life.settings
        began = time.perf_counter()
        self._wait_for_recorders()
        life.rate.waiting_s = time.perf_counter() - began
        began = time.perf_counter()
        if frame.layers:
            life.place.take(self._scene, pose, self._room.standpoint)
        if not asked:
            self._publish_senses(pose.stamp_ns)
        settings = FrameSettings(
            stamp_ns=pose.stamp_ns,
            scene=self._scene.id,
            frame=index,
            exposure_ev100=exposure.ev100,
            white_xy=exposure.white_xy,
            black=exposure.black,
            render=self._room.settings.render,
            sent=life.sent,
            frames=self._body.frames,
            **self._senses._asdict(),
            asked=asked,
            drive=None if asked or self._base is None else self._base.part,
            **{group: values[group] for group in ("camera", "sensor", "depth_sensor", "streams")},
        )
        self._output.publish(frame, pose, settings_to_json(settings), moves=not asked, frames=self._body.frames)
        life.rate.publishing_s = time.perf_counter() - began
        life.throughput.take(time.monotonic(), frame.samples * settings.camera.width * settings.camera.height, frame.rays)
        if not self._on_path:
            self._output.tell()
        self._last_ns = self._last_ns if asked else max(self._last_ns, pose.stamp_ns)
        self._published += 1
        self._shown()

    def _publish_senses(self, stamp_ns: int) -> None:
        """Publish what the body senses up to a frame, then the scans that begin up to it, and note what the frame comes after."""
        life = self._life
        if self._published == 0 and self._body.description is not None:
            self._output.publish_body([self._body.description])
        sent = self._output.publish_body(self._body.due(stamp_ns, self._output.is_wanted))
        if CLOCK in sent:
            sent[CLOCK] = stamp_ns  # its tick comes with the frame
        life.sent = life.sent | sent
        for due in self._scans.due(stamp_ns, self._output.wants_scans):
            life.sent = life.sent | self._output.publish_scan(due)

    def _wait_for_recorders(self) -> None:
        """Hold back while a recorder is ``frames_ahead`` frames behind, or as many as are kept for it, so that no queue overflows.

        Meanwhile the status says what has been published, so that a recorder that waits for what was lost hears of it.
        """
        config = self._life.config
        if config.expected_recorders == 0:
            return
        published, began, is_told = self._output.published, time.monotonic(), False
        ahead = min(config.frames_ahead, self._output.depth, self._output.frames_kept(self._body.bursts))
        while not self._inbox.wait_for_recorders(published, ahead, 1.0):
            self._output.tell()
            if not is_told and time.monotonic() - began > _RECORDER_PATIENCE_S:
                is_told = True
                self._life.node.warn(f"a recorder has taken no frame for {_RECORDER_PATIENCE_S:g} s; waiting")

    def _finish_path(self) -> None:
        """Say that the room is finished."""
        self._on_path = self._life.first_room = False
        self._output.tell(done_scene=self._scene.index, shown_ns=self._last_ns)
        seconds = time.perf_counter() - self._began_s
        self._life.node.get_logger().info(f"room {self._scene.index}: {self._published} frames rendered in {seconds:.1f} s")

    def _go(self, pose: CameraPose, spacing_s: float) -> CameraPose:
        """Return where the rig is at the next frame, that of the path or of a drive; in the order of time."""
        if self._base is not None:
            pose = self._base.advance(pose.stamp_ns, self._requests.velocity, self._requests.drive_config)
            self._path = self._output.messages.path = self._base.camera_path(pose.stamp_ns)
            self._scans.follow(self._base.rig, pose)
            self._body.follow(self._base.motion, pose.stamp_ns)
            return pose
        shown = self._requests.driven_pose(pose, spacing_s) if self._pace().realtime else pose
        if self._senses.scan.enabled:
            self._scans.go(shown)
        self._body.go(shown)
        return shown

    def _interrupted(self) -> bool:
        """Return whether the room must be left: for the end, or for the next room, unless that waits until the path is done."""
        shown = self._published > 0 or self._life.config.share_count > 1 or self._paused()
        return self._inbox.must_leave(self._on_path, shown)

    def _paused(self) -> bool:
        """Return whether frames must wait: for *activate*, or for recorders that would lose them."""
        return not self._life.node.active or self._output.status.state == "starting"

    def _is_turn(self) -> bool:
        """Return whether the room's frames may be published now."""
        return self._inbox.is_turn(self._scene.index, self._life.first_room)

    def _wait(self, seconds: float) -> None:
        """Wait for so long, or until a message has come."""
        self._inbox.wait(seconds, unless=lambda: self._interrupted() or self._requests.waiting)

    def _is_held(self, stamp_ns: int) -> bool:
        """Return whether the run holds back a frame of the path; it is told then up to where frames have gone out."""
        if not 0 <= self._inbox.until_ns < stamp_ns:
            return False
        if self._last_ns > self._output.status.shown_ns:
            self._output.tell(shown_ns=self._last_ns)
        return True

    def _wait_while_paused(self, stamp_ns: int = 0) -> float:
        """Wait until a frame may go out, 0 for one beyond the path; return for how long (s)."""
        began = time.perf_counter()
        while (self._paused() or self._is_held(stamp_ns)) and not self._interrupted():
            self._wait(_IDLE_S)
        return time.perf_counter() - began

    def _sleep_until(self, moment_s: float) -> None:
        while (left := moment_s - time.perf_counter()) > 0.0 and not self._interrupted():
            time.sleep(min(left, _IDLE_S))

    def _is_too_late(self, index: int, began: float) -> bool:
        """Return whether, in real time, the frame after this one is already due; the last frame of a room is never skipped.

        Nor is one that was let out of a run that is held: somebody waits for each.
        """
        path = self._scene.camera_path
        if not self._pace().realtime or index + 1 == len(path) or self._inbox.until_ns >= 0:
            return False
        return time.perf_counter() - began > (path[index + 1].stamp_ns - path[0].stamp_ns) / NANOSECONDS
