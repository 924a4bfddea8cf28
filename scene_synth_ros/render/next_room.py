"""The room that is made while the one before it is shown."""

import os
import sys
import threading
from collections.abc import Callable, Collection
from concurrent.futures import wait

from renderer import RenderCancelled
from scene_description import SceneDescription, SceneSynthError, scene_from_json
from scene_synth_ros.render.room import RenderedRoom, RoomSettings, is_same_room
from scene_synth_ros.suite.daemon_job import JobAhead
from scene_synth_ros.suite.faults import Faults

_NICENESS = 5
"""A room that is made ahead gets a third of the processor time that frames get where both want the same processor (sched(7))."""
_AMPLE_S = 15.0
"""Frames get more only where the room at work is shown for so long: the next one takes 1 to 2 s of one processor, much more where it must
give way on a busy machine, and frames would stop until it is there."""
_POLL_S = 0.05


class NextRoom:
    """Makes one room ahead, in one thread: geometry, trees, exposure, and light for its views as far as there is time.

    Frames are the same bytes as those of a room that is made when it comes: everything is a pure function of scene and settings.

    Threading: every method is called in the rendering thread; the room is made in a thread of its own, one after the other, and handed over
    when that has ended.
    """

    def __init__(self, faults: Faults) -> None:
        expected = (SceneSynthError, OSError, RenderCancelled)
        self._jobs: JobAhead[RenderedRoom | None] = JobAhead("next room", "the next room was made ahead", faults, _close, expected)
        self._enough, self._dropped = threading.Event(), threading.Event()

    def begin(self, text: str, present: RenderedRoom, settings: RoomSettings, layers: Collection[str]) -> None:
        """Begin to make a room in place of the one made before, unless it is the one that is present."""
        self.drop()
        self._enough, self._dropped = enough, dropped = threading.Event(), threading.Event()
        layers, path = tuple(layers), present.scene.camera_path
        is_ample = path[-1].stamp_ns - path[0].stamp_ns >= _AMPLE_S * 1e9

        def make() -> RenderedRoom | None:
            if is_ample:
                _be_nice()
            return _made(text, present, settings, layers, enough, dropped)

        self._jobs.begin(make)

    def take(self, scene: SceneDescription, settings: RoomSettings, cancelled: Callable[[], bool]) -> RenderedRoom | None:
        """Return the room of a scene, if it was begun with these settings; its caller closes it.

        The step under way is waited for; what is left of the room is made when it is asked for, with all threads.  A room that could not be
        made is not told of: who makes it again will tell.

        Raises:
            RenderCancelled: ``cancelled`` returned True meanwhile.
        """
        if self._jobs.job is None:
            return None
        self._enough.set()
        while not wait([self._jobs.job], _POLL_S).done:
            if cancelled():
                raise RenderCancelled("the room is not wanted any more")
        job = self._jobs.take()
        room = self._jobs.result(job) if job is not None else None
        if room is None:
            return None
        if room.settings != settings or not room.shows(scene):
            room.close()
            return None
        room.scene = scene
        return room

    def drop(self) -> None:
        """Forget the room; a thread at work ends soon, and only a fault of it is told."""
        self._dropped.set()
        self._enough.set()
        self._jobs.drop()


def _close(room: RenderedRoom | None) -> None:
    if room is not None:
        room.close()


def _made(
    text: str,
    present: RenderedRoom,
    settings: RoomSettings,
    layers: Collection[str],
    enough: threading.Event,
    dropped: threading.Event,
) -> RenderedRoom | None:
    scene = scene_from_json(text)
    if is_same_room(scene, present.scene):
        return None
    room = RenderedRoom(scene, settings, present)
    try:
        room.prepare(layers, enough, dropped.is_set)
    except BaseException:
        room.close()
        raise
    return room


def _be_nice() -> None:
    """Let the calling thread, and those that it starts, give way to others; on Linux, where threads have a niceness of their own."""
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
