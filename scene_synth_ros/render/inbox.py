"""What a renderer's executor hands to its rendering thread: rooms, what the peers say, and the word to stop.  No ROS."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Collection

from scene_synth_ros.render.peers import Peers
from scene_synth_ros.suite.status import NodeStatus

MAX_ROOMS_WAITING = 16


class Inbox:
    """The rooms that wait for one life of the rendering thread, and when it must leave the one at work.

    Threading: the executor's thread puts in (``put_room``, ``announce``, ``take_status``, ``wake``, ``stop``), the rendering thread asks
    and waits.  One condition guards rooms, peers and the stop flag; every change wakes the rendering thread.

    Args:
        peers: of the renderer; from now on this object's.
    """

    def __init__(self, peers: Peers) -> None:
        self._changed = threading.Condition()
        self._peers = peers
        self._rooms: deque[str] = deque(maxlen=MAX_ROOMS_WAITING)
        self._announced: str | None = None
        self._stopped = False

    def put_room(self, text: str) -> None:
        """Put in a room's description, as it came."""
        with self._changed:
            self._rooms.append(text)
            self._changed.notify_all()

    def announce(self, text: str) -> None:
        """Put in the description of the room that will come next, in place of one that nobody has taken."""
        with self._changed:
            self._announced = text

    def take_announced(self) -> str | None:
        """Return the description of the room that will come next, once; None if there is no news."""
        with self._changed:
            text, self._announced = self._announced, None
            return text

    def take_status(self, status: NodeStatus, published: int) -> None:
        """Take a peer's status; ``published`` is how many frames this renderer has published."""
        with self._changed:
            self._peers.take(status, published)
            self._changed.notify_all()

    def wake(self) -> None:
        """Let the rendering thread look again at what it waits for."""
        with self._changed:
            self._changed.notify_all()

    def stop(self) -> None:
        """End this life: the room at work is left, what waits is dropped."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()

    @property
    def recorders(self) -> Collection[NodeStatus]:
        """The newest status of each recorder."""
        with self._changed:
            return tuple(self._peers.recorders)

    @property
    def finished_scene(self) -> int:
        """The last room that the grammar node knows to be finished by all."""
        return self._peers.finished_scene

    @property
    def wall_clock(self) -> bool:
        """Whether stamps are the time of day, so that every frame is due at its stamp."""
        return self._peers.wall_clock

    def next_room(self) -> str | None:
        """Wait for a room and return its description; None at the end.

        It is the oldest where every room waits until the one before is finished, else the newest: the others are dropped.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._stopped or self._rooms)
            while len(self._rooms) > 1 and not self._peers.rooms_wait:
                self._rooms.popleft()
            return None if self._stopped else self._rooms.popleft()

    def must_leave(self, on_path: bool, shown: bool = True) -> bool:
        """Return whether the room must be left: for the end, or for the next room, unless that waits until the camera path is done.

        A room of whose path nothing was shown yet is left for the end only: where rooms come faster than they can be made, nothing would
        ever be seen.
        """
        with self._changed:
            return self._stopped or (bool(self._rooms) and not (on_path and (self._peers.rooms_wait or not shown)))

    def is_turn(self, room: int, first: bool) -> bool:
        """Return whether a room may be published now; ``first`` marks the first one of this life."""
        with self._changed:
            return self._peers.is_turn(room, first)

    def wait(self, seconds: float, unless: Callable[[], bool]) -> None:
        """Wait for so long, or until something was put in; not at all if ``unless`` holds."""
        with self._changed:
            if not unless():
                self._changed.wait(seconds)

    def wait_for_recorders(self, published: int, allowed: int, seconds: float) -> bool:
        """Wait at most so long until the slowest recorder is less than ``allowed`` frames behind, or for the end; return whether it is."""
        with self._changed:
            return self._changed.wait_for(lambda: self._stopped or self._peers.has_room(published, allowed), seconds)
