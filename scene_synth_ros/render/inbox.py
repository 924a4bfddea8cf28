"""What a renderer's executor hands to its rendering thread: rooms, what the peers say, and the word to stop.  No ROS."""

import threading
from collections import deque
from collections.abc import Callable, Collection

from scene_synth_ros.suite.status import NodeStatus, begun_in_run, done_in_run

MAX_ROOMS_WAITING = 16


class Inbox:
    """The rooms that wait for one life of the rendering thread, when it must leave the one at work, and when it may publish.

    Rooms that several renderers share by index are rendered at the same time but published one after the other, so that stamps increase
    and a bag has its rooms in order: a room's turn comes when every other renderer, and every recorder, has finished the rooms before it.

    Threading: the executor's thread puts in (``put_room``, ``announce``, ``take_status``, ``wake``, ``stop``), the rendering thread asks
    and waits.  One condition guards everything; every change wakes the rendering thread.

    Args:
        name: fully qualified name of the renderer itself.
        topic: a topic that has one message for each of its frames.
        share_count: how many renderers share the rooms.
        token: of the command or launch that has started the renderer.

    Attributes:
        is_expected: whether the grammar node, where it waits for its peers, takes this renderer for one of them.
        finished_scene: the last room of the run that the grammar node knows to be finished by all.
        wall_clock: whether stamps are the time of day, so that every frame is due at its stamp.
        until_ns: stamp of the last frame that may go out, -1 for no limit.
    """

    def __init__(self, name: str, topic: str, share_count: int, token: str = "") -> None:
        self._name, self._topic, self._share_count, self._token = name, topic, share_count, token
        self.is_expected = True
        self._changed = threading.Condition()
        self._recorders: dict[str, NodeStatus] = {}
        self._renderers: dict[str, NodeStatus] = {}
        self._offsets: dict[str, int] = {}
        self._run = ""
        self._lock_step = self._stopped = self._abandoned = False
        self._rooms: deque[str] = deque(maxlen=MAX_ROOMS_WAITING)
        self._announced: str | None = None
        self.finished_scene = self.until_ns = -1
        self.wall_clock = False

    def put_room(self, text: str) -> None:
        """Put in a room's description, as it came; one of a run that does not expect this renderer is left alone."""
        with self._changed:
            if self.is_expected:
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
            if status.role == "recorder":
                if status.node not in self._recorders:
                    self._offsets[status.node] = status.counts.get(self._topic, 0) - published
                self._recorders[status.node] = status
            elif status.role == "renderer" and status.node != self._name:
                self._renderers[status.node] = status
            elif status.role == "grammar":
                if status.lock_step and self._run not in ("", status.run) and not self._recorders:
                    self._abandoned = True
                self._run, self.finished_scene, self._lock_step = status.run, status.done_scene, status.lock_step
                self.wall_clock, self.until_ns = status.clock == "wall", status.until_ns
                self.is_expected = not status.lock_step or status.token in ("", self._token)
                if not self.is_expected:
                    self._rooms.clear()
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
            return tuple(self._recorders.values())

    @property
    def rooms_wait(self) -> bool:
        """Whether a room waits until the one before is finished, as in lock-step and where rooms are shared; else it interrupts that."""
        return self._lock_step or self._share_count > 1

    def next_room(self) -> str | None:
        """Wait for a room and return its description; None at the end.

        It is the oldest where every room waits until the one before is finished, else the newest: the others are dropped.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._stopped or self._rooms)
            while len(self._rooms) > 1 and not self.rooms_wait:
                self._rooms.popleft()
            self._abandoned = False
            return None if self._stopped else self._rooms.popleft()

    def must_leave(self, on_path: bool, shown: bool = True) -> bool:
        """Return whether the room must be left: for the end, or for the next room, unless that waits until the camera path is done.

        In lock-step it is left, too, when the run has begun again meanwhile, where no recorder would have a part of it in a bag.
        A room of whose path nothing was shown yet is left for the end only: where rooms come faster than they can be made, nothing would
        ever be seen.
        """
        with self._changed:
            if self._stopped or self._abandoned or not self.is_expected:
                return True
            return bool(self._rooms) and not (on_path and (self.rooms_wait or not shown))

    def is_turn(self, room: int, first: bool) -> bool:
        """Return whether a room may be published now; ``first`` marks the first one of this life, before which nothing counts."""
        with self._changed:
            if self._share_count == 1:
                return True
            others = [done_in_run(status, self._run) for status in self._renderers.values()]
            ready = [status for status in self._recorders.values() if status.state == "ready"]
            recorders = [] if first else [done_in_run(status, self._run) for status in ready]
            return len(others) >= self._share_count - 1 and all(done >= room - 1 for done in (*others, *recorders))

    def wait(self, seconds: float, unless: Callable[[], bool]) -> None:
        """Wait for so long, or until something was put in; not at all if ``unless`` holds."""
        with self._changed:
            if not unless():
                self._changed.wait(seconds)

    def wait_for_recorders(self, published: int, allowed: int, seconds: float) -> bool:
        """Wait at most so long until the slowest recorder is less than ``allowed`` frames behind, or for the end; return whether it is.

        Recorders that leave the frames out do not count.
        """
        with self._changed:
            return self._changed.wait_for(lambda: self._stopped or not self._is_behind(published, allowed), seconds)

    def not_begun(self, room: int) -> set[str]:
        """Return the other renderers of this suite that are ready and have no frame of a room yet; none where rooms are shared."""
        with self._changed:
            peers = [] if self._share_count > 1 else [peer for peer in self._renderers.values() if peer.state == "ready"]
            return {peer.node for peer in peers if peer.run == self._run and begun_in_run(peer, self._run) < room}

    def _is_behind(self, published: int, allowed: int) -> bool:
        for name, status in self._recorders.items():
            taken = status.counts.get(self._topic, 0)
            if status.state == "ready" and taken >= 0 and published - (taken - self._offsets[name]) >= allowed:
                return True
        return False
