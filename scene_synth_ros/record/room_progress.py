"""Which rooms are in the bag, what makes their frames complete, and what of them was lost."""

import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping

from scene_synth_ros.record.frame_topics import frame_topics, with_derived
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.suite.status import NodeStatus, done_in_run


class Accounting:
    """Compares cumulative counts of published and received messages, by topic.

    A renderer that was already publishing when it was first seen is counted from its next finished room on.  One that starts again is
    counted from then on; what its former life has published and what has arrived are taken to be even, because a room that it left is
    done again from its first frame.

    Attributes:
        received: messages that have arrived, by topic.
        lost: messages that were given up, by topic.
    """

    def __init__(self) -> None:
        self.received: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self._renderers: dict[str, NodeStatus] = {}
        self._uncounted: dict[str, Counter[str] | None] = {}

    def take_status(self, status: NodeStatus) -> None:
        """Take the newest status of a renderer."""
        name = status.node
        if name in self._renderers and status.start != self._renderers[name].start:
            others = self._published(without=name)
            arrived = self.received + self.lost
            self._uncounted[name] = Counter({topic: min(0, others[topic] - arrived[topic]) for topic in status.counts})
        elif name not in self._renderers:
            self._uncounted[name] = None if any(status.counts.values()) else Counter()
        elif self._uncounted[name] is None and status.done_scene > self._renderers[name].done_scene:
            self._uncounted[name] = Counter({topic: count - self.received[topic] for topic, count in status.counts.items()})
        self._renderers[name] = status

    @property
    def topics(self) -> set[str]:
        """The topics that renderers say they publish."""
        return {topic for status in self._renderers.values() for topic in status.counts}

    def done_scene(self, run: str) -> int:
        """Return the last room of a run that every known renderer has finished or refused, -1 if there is none."""
        return min((done_in_run(status, run) for status in self._renderers.values()), default=-1)

    def missing(self, recorded: Mapping[str, int]) -> dict[str, int]:
        """Return how many published messages have not arrived and have not been given up, by topic.

        Args:
            recorded: the topics that are recorded; values below 0 mark those that are left out.
        """
        published = self._published()
        short = {
            topic: count - self.received[topic] - self.lost[topic] for topic, count in published.items() if recorded.get(topic, -1) >= 0
        }
        return {topic: count for topic, count in sorted(short.items()) if count > 0}

    def _published(self, without: str = "") -> Counter[str]:
        """Return what the renderers, but for one, have published since they are counted, by topic."""
        published: Counter[str] = Counter()
        for name, status in self._renderers.items():
            uncounted = self._uncounted[name]
            if uncounted is not None and name != without:
                for topic, count in status.counts.items():
                    published[topic] += count - uncounted[topic]
        return published

    def give_up(self, missing: Mapping[str, int]) -> None:
        """Count messages as lost."""
        self.lost.update(missing)


def stand_ins(topics: Mapping[str, Collection[str]]) -> dict[str, str]:
    """Return topic -> the topic that stands for it, for those that renderers publish under their own names.

    Renderers that publish the same topics otherwise share the rooms of one camera: a frame has what one of them says of it.  Renderers of
    several cameras, or of several layers of one camera, publish every frame together, and each topic stands for itself.

    Args:
        topics: fully qualified name of a renderer -> the topics of its frames.
    """
    sharing: dict[frozenset[str], list[str]] = {}
    for node in sorted(topics):
        sharing.setdefault(frozenset(topic for topic in topics[node] if not topic.startswith(f"{node}/")), []).append(node)
    return {
        topic: f"{nodes[0]}/{topic.removeprefix(f'{node}/')}"
        for nodes in sharing.values()
        for node in nodes
        for topic in sorted(topics[node])
        if topic.startswith(f"{node}/")
    }


def expect_frames(recording: Recording, topics: Mapping[str, Collection[str]], is_recorded: Callable[[str], bool]) -> None:
    """Tell a recording which topics make a frame complete: those of the renderers' frames that are recorded, and what is derived of them.

    ``topics``: fully qualified name of a renderer -> the topics of its frames.
    """
    recorded = {topic for of_renderer in topics.values() for topic in of_renderer if is_recorded(topic)}
    recording.expect(with_derived(recorded), stand_ins(topics))


class RoomProgress:
    """Follows what renderers say: their frames' topics, the rooms that they have finished, how much they have published.

    Threads: the thread of the node's executor only.

    Args:
        known: the topics that were considered; values below 0 mark those that are left out.

    Attributes:
        run: the newest run that the grammar node has begun.
        done_scene: the last room of it that every renderer has finished and that is written, -1 for none.
    """

    def __init__(self, recording: Recording, accounting: Accounting, known: Mapping[str, int], warn: Callable[[str], None]) -> None:
        self._recording, self._accounting, self._known, self._warn = recording, accounting, known, warn
        self._frame_topics: dict[str, frozenset[str]] = {}
        self._missing_since = 0.0
        self._fewest_missing = math.inf
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
        """Write a room that is done; give up messages that are lost: published, and for so long none of those that are missing has come."""
        expect_frames(self._recording, self._frame_topics, lambda topic: self._known.get(topic, -1) >= 0)
        done = self._accounting.done_scene(self.run)
        self.done_scene = min(self.done_scene, done)  # a renderer has started again
        missing = self._accounting.missing(self._known)
        comes = 0 < sum(missing.values()) < self._fewest_missing
        self._let_go(now_s, loss_timeout_s, comes)
        if not missing:
            self._fewest_missing = math.inf
            if done != self.done_scene:
                self._recording.flush(done)
                self.done_scene = done
        elif comes:
            self._missing_since, self._fewest_missing = now_s, sum(missing.values())
        elif now_s - self._missing_since > loss_timeout_s:
            self._accounting.give_up(missing)
            self._fewest_missing = math.inf
            self._recording.flush()  # frames that wait for what is lost
            self._warn(f"{sum(missing.values())} messages lost after room {self.done_scene}: {missing}")

    def _let_go(self, now_s: float, loss_timeout_s: float, comes: bool) -> None:
        """Write frames that wait for a message on another topic that does not come, as it was sent before the recorder was there."""
        held = self._recording.intake.held
        if held != self._held or comes:
            self._held, self._held_since = held, now_s
        elif held and now_s - self._held_since > loss_timeout_s:
            self._recording.flush()
