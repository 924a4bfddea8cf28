"""What a renderer knows of the others of its run: whose turn it is to publish, and how far the recorders are."""

from __future__ import annotations

from collections.abc import Collection

from scene_synth_ros.suite.status import NodeStatus, done_in_run


class Peers:
    """Newest status of recorders and other renderers; no threads, :class:`~scene_synth_ros.render.inbox.Inbox` guards it.

    Rooms that several renderers share by index are rendered at the same time but published one after the other, so that stamps increase
    and a bag has its rooms in order: a room's turn comes when every other renderer, and every recorder, has finished the rooms before it.

    Args:
        name: fully qualified name of the renderer itself.
        topic: a topic that has one message for each of its frames.
        share_count: how many renderers share the rooms.
    """

    def __init__(self, name: str, topic: str, share_count: int) -> None:
        self._name, self._topic, self._share_count = name, topic, share_count
        self._recorders: dict[str, NodeStatus] = {}
        self._renderers: dict[str, NodeStatus] = {}
        self._offsets: dict[str, int] = {}
        self._run = ""
        self.finished_scene = -1
        """Last room of the run that the grammar node knows to be finished by all."""
        self.wall_clock = False
        """Whether stamps are the time of day."""
        self._lock_step = False

    def take(self, status: NodeStatus, published: int) -> None:
        """Take a status; ``published`` is how many frames this renderer has published."""
        if status.role == "recorder":
            if status.node not in self._recorders:
                self._offsets[status.node] = status.counts.get(self._topic, 0) - published
            self._recorders[status.node] = status
        elif status.role == "renderer" and status.node != self._name:
            self._renderers[status.node] = status
        elif status.role == "grammar":
            self._run, self.finished_scene, self._lock_step = status.run, status.done_scene, status.lock_step
            self.wall_clock = status.clock == "wall"

    @property
    def rooms_wait(self) -> bool:
        """Whether a room waits until the one before is finished, as in lock-step and where rooms are shared; else it interrupts that."""
        return self._lock_step or self._share_count > 1

    @property
    def recorders(self) -> Collection[NodeStatus]:
        """The newest status of each recorder."""
        return self._recorders.values()

    def is_turn(self, room: int, first: bool) -> bool:
        """Return whether a room may be published now; ``first`` marks the first one of this process, before which nothing counts."""
        if self._share_count == 1:
            return True
        others = [done_in_run(status, self._run) for status in self._renderers.values()]
        ready = [status for status in self._recorders.values() if status.state == "ready"]
        recorders = [] if first else [done_in_run(status, self._run) for status in ready]
        return len(others) >= self._share_count - 1 and all(done >= room - 1 for done in (*others, *recorders))

    def has_room(self, published: int, allowed: int) -> bool:
        """Return whether the slowest recorder is less than ``allowed`` frames behind; recorders that leave the frames out do not count."""
        for name, status in self._recorders.items():
            taken = status.counts.get(self._topic, 0)
            if status.state == "ready" and taken >= 0 and published - (taken - self._offsets[name]) >= allowed:
                return False
        return True
