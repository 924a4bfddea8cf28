"""Which rooms are in the bag, what makes their frames complete, and what of them was lost."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from scene_synth_ros.record.accounting import Accounting
from scene_synth_ros.record.frame_topics import frame_topics, with_derived
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.record.shared_frames import stand_ins
from scene_synth_ros.suite.status import NodeStatus


class RoomProgress:
    """Follows what renderers say: their frames' topics, the rooms that they have finished, how much they have published.

    Threads: the thread of the node's executor only.

    Args:
        recording: is told what to wait for and, when a room is done, to write it.
        accounting: of what was published, has arrived and is lost.
        known: the topics that were considered; values below 0 mark those that are left out.
        warn: called with one line when messages are given up.

    Attributes:
        run: the newest run that the grammar node has begun.
        done_scene: the last room of it that every renderer has finished and that is written, -1 for none.
    """

    def __init__(self, recording: Recording, accounting: Accounting, known: Mapping[str, int], warn: Callable[[str], None]) -> None:
        self._recording, self._accounting, self._known, self._warn = recording, accounting, known, warn
        self._frame_topics: dict[str, frozenset[str]] = {}
        self._missing_since: float | None = None
        self._held, self._held_since = "", 0.0
        self.run, self.done_scene = "", -1

    def take_status(self, status: NodeStatus) -> None:
        """Take the newest status of a renderer or of the grammar node."""
        if status.role == "grammar":
            if status.run != self.run:
                self.run, self.done_scene = status.run, -1
            return
        self._accounting.take_status(status)
        self._frame_topics[status.node] = frame_topics(status.counts)

    def step(self, now_s: float, loss_timeout_s: float) -> None:
        """Write a room that is done; give up messages that were published so long ago that they are lost.

        Args:
            now_s: of a clock that goes on evenly.
            loss_timeout_s: how long to wait for messages.
        """
        recorded = {topic for topics in self._frame_topics.values() for topic in topics if self._known.get(topic, -1) >= 0}
        self._recording.expect(with_derived(recorded), stand_ins(self._frame_topics))
        done = self._accounting.done_scene(self.run)
        self.done_scene = min(self.done_scene, done)  # a renderer has started again
        missing = self._accounting.missing(self._known)
        self._let_go(now_s, loss_timeout_s)
        if not missing:
            self._missing_since = None
            if done != self.done_scene:
                self._recording.flush(done)
                self.done_scene = done
        elif self._missing_since is None:
            self._missing_since = now_s
        elif now_s - self._missing_since > loss_timeout_s:
            self._accounting.give_up(missing)
            self._recording.flush()  # frames that wait for what is lost
            self._warn(f"{sum(missing.values())} messages lost after room {self.done_scene}: {missing}")

    def _let_go(self, now_s: float, loss_timeout_s: float) -> None:
        """Write frames that wait for a message on another topic that does not come, as it was sent before the recorder was there."""
        held = self._recording.intake.held
        if held != self._held:
            self._held, self._held_since = held, now_s
        elif held and now_s - self._held_since > loss_timeout_s:
            self._recording.flush()
