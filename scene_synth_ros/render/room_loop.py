"""The loop of one room: its camera path, then what is asked for, until the next room comes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Protocol

from renderer import CameraConfig
from renderer.camera.rig import mounted, mounted_path
from renderer.film.frame import Frame
from renderer.film.tone import Exposure
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.render.camera_requests import CameraRequests
from scene_synth_ros.render.room import RoomRenderer, frame_index

_IDLE_S = 0.2
_SOON_S = 1.0
"""A wall clock that is set back while a room is on its way does not hold the room up for longer."""


class Host(Protocol):
    """What the loop of a room asks of its surroundings."""

    def interrupted(self) -> bool:
        """Return whether the room must be left."""

    def paused(self) -> bool:
        """Return whether frames must wait."""

    def wait(self, seconds: float) -> None:
        """Wait for so long, or until something has changed."""

    def wanted_layers(self) -> Collection[str]:
        """Return the layers that somebody wants."""

    def exposure(self) -> Exposure:
        """Return the exposure of the next frame."""

    def is_turn(self) -> bool:
        """Return whether the room's frames may be published now."""

    def go(self, pose: CameraPose) -> None:
        """Hear where the rig is at the next frame of the path, or of the drive; in the order of time."""

    def publish(self, frame: Frame, pose: CameraPose, index: int, exposure: Exposure) -> None:
        """Publish a frame; may wait."""

    def rendered(self, frame: Frame, seconds: float, period_s: float) -> None:
        """Hear how long a frame took, in real time; its period is 0 where it has none, as a room's first."""

    def skip(self) -> None:
        """Hear that a frame is left out because it would be late."""

    def path_done(self, published: int) -> None:
        """Hear that the camera path has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How frames follow each other: at their rate or as fast as can be, each at its stamp where that is the time of day.

    ``frames_held`` may wait for their turn.
    """

    realtime: bool
    wall_clock: bool = False
    frames_held: int


class RoomLoop:
    """Renders one room.

    Threading: everything is called in the rendering thread.

    Args:
        scene: the room.
        renderer: of the room.
        camera: which sits in a rig that follows the room's path.
        host: says when to stop and wait, and publishes.
        requests: poses asked for, and the driven camera.
        pace: read anew for every frame.
    """

    def __init__(
        self,
        scene: SceneDescription,
        renderer: RoomRenderer,
        camera: CameraConfig,
        host: Host,
        requests: CameraRequests,
        pace: Callable[[], Pace],
    ) -> None:
        self._camera, self._path = camera, mounted_path(camera, scene.camera_path)
        self._scene, self._renderer, self._host, self._requests, self._pace = scene, renderer, host, requests, pace
        self._held: deque[tuple[Frame, CameraPose, int, Exposure]] = deque()
        self._last_ns = -1
        self._published = 0

    def run(self) -> None:
        """Render the path, say that it is done, then serve requests until the room must be left."""
        if self._show_path():
            self._idle()

    def _show_path(self) -> bool:
        """Render the camera path; return False if the room must be left."""
        path = self._scene.camera_path
        start_ns = path[0].stamp_ns
        began = self._beginning(start_ns)
        for index, pose in enumerate(path):
            waited_s = self._wait_while_paused()
            began += 0.0 if self._pace().wall_clock else waited_s
            self._serve_requests()
            if self._host.interrupted():
                return False
            if self._is_too_late(index, began):
                self._host.skip()
                continue
            spacing_s = (pose.stamp_ns - path[index - 1].stamp_ns) / NANOSECONDS if index else 0.0
            shown = self._requests.driven_pose(pose, spacing_s) if self._pace().realtime else pose
            self._host.go(shown)
            frame = self._render(shown, spacing_s)
            if self._pace().realtime:
                self._sleep_until(began + (pose.stamp_ns - start_ns) / NANOSECONDS)
            self._hold(*frame)
        while self._held and not self._host.interrupted():
            if self._host.is_turn():
                self._release()
            else:
                self._host.wait(_IDLE_S)
        if self._held or self._host.interrupted():
            return False
        self._host.path_done(self._published)
        return True

    def _beginning(self, start_ns: int) -> float:
        """Return when the path begins, by the counter: now, or at its stamp where that is the time of day, but soon in any case."""
        ahead_s = (start_ns - time.time_ns()) / NANOSECONDS if self._pace().wall_clock else 0.0
        return time.perf_counter() + min(ahead_s, _SOON_S)

    def _idle(self) -> None:
        """Serve what is asked for, and go on driving at the path's rate."""
        path = self._scene.camera_path
        spacing_ns = path[-1].stamp_ns - path[-2].stamp_ns if len(path) > 1 else NANOSECONDS // 10
        due = time.perf_counter()
        while not self._host.interrupted():
            self._wait_while_paused()
            self._serve_requests()
            if not (self._pace().realtime and self._requests.driven):
                self._host.wait(_IDLE_S)
                due = time.perf_counter()
                continue
            due = max(due + spacing_ns / NANOSECONDS, time.perf_counter())
            pose = replace(path[-1], stamp_ns=self._last_ns + spacing_ns)
            shown = self._requests.driven_pose(pose, spacing_ns / NANOSECONDS)
            self._host.go(shown)
            frame = self._render(shown, spacing_ns / NANOSECONDS)
            self._sleep_until(due)
            if not self._host.interrupted():
                self._publish(*frame)

    def _serve_requests(self) -> None:
        """Render the poses that wait, each once, if the room may be published."""
        while self._requests.waiting and self._host.is_turn() and not self._host.interrupted():
            self._release()
            pose = self._requests.next_pose()
            if pose is not None:
                now_ns = time.time_ns() if self._pace().wall_clock else 0
                stamp_ns = pose.stamp_ns or max(self._last_ns + 1, self._scene.camera_path[0].stamp_ns + 1, now_ns)
                self._publish(*self._render(replace(pose, stamp_ns=stamp_ns)))

    def _render(self, pose: CameraPose, period_s: float = 0.0) -> tuple[Frame, CameraPose, int, Exposure]:
        """Render a pose; the first of a room and those asked for have no period."""
        exposure = self._host.exposure()
        index = frame_index(self._scene, pose)
        layers = self._host.wanted_layers()
        placed = mounted(self._camera, pose)
        began = time.perf_counter()
        frame = self._renderer.render(placed, index, layers, exposure=exposure, path=self._path, cancelled=self._host.interrupted)
        if self._pace().realtime:
            self._host.rendered(frame, time.perf_counter() - began, period_s)
        return frame, placed, index, exposure

    def _hold(self, frame: Frame, pose: CameraPose, index: int, exposure: Exposure) -> None:
        """Publish a frame when the room's turn has come; until then keep as many as may wait."""
        self._held.append((frame._replace(radiance=None), pose, index, exposure))
        while not self._host.is_turn() and not self._host.interrupted() and len(self._held) >= self._pace().frames_held:
            self._host.wait(_IDLE_S)
        if self._host.is_turn():
            self._release()

    def _release(self) -> None:
        while self._held and not self._host.interrupted():
            self._publish(*self._held.popleft())

    def _publish(self, frame: Frame, pose: CameraPose, index: int, exposure: Exposure) -> None:
        self._host.publish(frame, pose, index, exposure)
        self._last_ns = max(self._last_ns, pose.stamp_ns)
        self._published += 1

    def _wait_while_paused(self) -> float:
        """Wait; return for how long (s)."""
        began = time.perf_counter()
        while self._host.paused() and not self._host.interrupted():
            self._host.wait(_IDLE_S)
        return time.perf_counter() - began

    def _sleep_until(self, moment_s: float) -> None:
        while (left := moment_s - time.perf_counter()) > 0.0 and not self._host.interrupted():
            time.sleep(min(left, _IDLE_S))

    def _is_too_late(self, index: int, began: float) -> bool:
        """Return whether, in real time, the frame after this one is already due; the last frame of a room is never skipped."""
        path = self._scene.camera_path
        if not self._pace().realtime or index + 1 == len(path):
            return False
        return time.perf_counter() - began > (path[index + 1].stamp_ns - path[0].stamp_ns) / NANOSECONDS
