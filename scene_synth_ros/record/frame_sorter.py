"""Puts messages that arrive in any order into the order of their stamps, so that a run always writes the same bytes.

DDS keeps the order of one topic, not of several.  Messages of one stamp form a group, which leaves when everything expected of that
stamp is there and all earlier groups have left; within a group the topics have a fixed order.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

LEADING = ("/clock", "/scene", "/scene/map", "/scene/markers", "/tf_static", "/tf")
"""Ends of topics that go before the others of the same stamp."""


def topic_rank(topic: str) -> tuple[int, str]:
    """Return what sorts topics into the order in which they leave at equal stamps: those that lead, then all others by name."""
    return next((rank for rank, end in enumerate(LEADING) if topic.endswith(end)), len(LEADING)), topic


class OrderedMessage(NamedTuple):
    """A message whose turn has come.

    ``log_ns`` never decreases from one to the next; it is ``stamp_ns`` except for messages that came late or have no stamp (None).
    """

    topic: str
    stamp_ns: int | None
    log_ns: int
    data: bytes


class _Group:
    """What has arrived of one stamp."""

    __slots__ = ("messages", "missing", "size")

    def __init__(self, missing: set[str] | None) -> None:
        self.messages: list[tuple[str, bytes]] = []
        self.missing = missing
        self.size = 0


class FrameSorter:
    """Holds messages until their group is complete, within bounds; no clocks, no threads.

    Args:
        expected: topics that every stamp must have to be complete; None lets groups leave only when they are flushed or too much waits.
        max_stamps: how many stamps may wait.
        max_bytes: how many bytes may wait, all stamps together.

    Attributes:
        late: messages that came after their stamp had left; they leave at once.
        forced: groups that left incomplete because too much was waiting.
        waiting_bytes: size of what is waiting.
    """

    def __init__(self, expected: Collection[str] | None, *, max_stamps: int = 64, max_bytes: int = 256 * 2**20) -> None:
        self._expected = None if expected is None else frozenset(expected)
        self._alike: Mapping[str, str] = {}
        self._max_stamps, self._max_bytes = max_stamps, max_bytes
        self._groups: dict[int, _Group] = {}
        self._released_ns: int | None = None
        self.late = 0
        self.forced = 0
        self.waiting_bytes = 0

    @property
    def waiting_stamps(self) -> int:
        """How many stamps are waiting."""
        return len(self._groups)

    @property
    def first_ns(self) -> float:
        """Earliest stamp that is waiting; infinite if there is none."""
        return min(self._groups, default=math.inf)

    def configure(self, expected: Collection[str] | None, alike: Mapping[str, str] = MappingProxyType({})) -> list[OrderedMessage]:
        """Change the expectation for stamps yet to come; return everything that waits, so that no group mixes the two.

        ``alike``: topic -> the topic that stands for it; of those with the same one, a stamp needs one only.
        """
        released = self.flush()
        self._alike = dict(alike)
        self._expected = None if expected is None else frozenset(map(self._stand_in, expected))
        return released

    def add(self, topic: str, stamp_ns: int | None, data: bytes) -> list[OrderedMessage]:
        """Take a message; return what may leave now, in order.  A message without a stamp leaves at once."""
        if stamp_ns is None:
            return [OrderedMessage(topic, None, self._released_ns or 0, data)]
        if self._released_ns is not None and stamp_ns <= self._released_ns:
            self.late += 1
            return [OrderedMessage(topic, stamp_ns, self._released_ns, data)]
        group = self._groups.get(stamp_ns)
        if group is None:
            group = self._groups[stamp_ns] = _Group(None if self._expected is None else set(self._expected))
        group.messages.append((topic, data))
        group.size += len(data)
        self.waiting_bytes += len(data)
        if group.missing is not None:
            group.missing.discard(self._stand_in(topic))
        released = list(self._release_complete())
        while len(self._groups) > self._max_stamps or self.waiting_bytes > self._max_bytes:
            self.forced += 1
            released += self._release(min(self._groups))
            released += self._release_complete()
        return released

    def flush(self, up_to_ns: int | None = None) -> list[OrderedMessage]:
        """Return everything that waits with a stamp of at most ``up_to_ns`` (None: everything), complete or not, in order."""
        stamps = sorted(stamp for stamp in self._groups if up_to_ns is None or stamp <= up_to_ns)
        released = [message for stamp in stamps for message in self._release(stamp)]
        return released + list(self._release_complete())

    def missing(self) -> dict[int, frozenset[str]]:
        """Return, for every waiting stamp, the topics that it still waits for."""
        return {stamp: frozenset(self._groups[stamp].missing or ()) for stamp in sorted(self._groups)}

    def _stand_in(self, topic: str) -> str:
        return self._alike.get(topic, topic)

    def _release_complete(self) -> Iterator[OrderedMessage]:
        while self._groups:
            first = min(self._groups)
            if self._groups[first].missing is None or self._groups[first].missing:
                return
            yield from self._release(first)

    def _release(self, stamp_ns: int) -> list[OrderedMessage]:
        group = self._groups.pop(stamp_ns)
        self.waiting_bytes -= group.size
        self._released_ns = stamp_ns
        ordered = sorted(group.messages, key=lambda message: topic_rank(message[0]))
        return [OrderedMessage(topic, stamp_ns, stamp_ns, data) for topic, data in ordered]
