"""Counts what renderers say they have published against what has arrived: nothing is lost unnoticed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

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
