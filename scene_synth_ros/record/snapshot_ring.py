"""The last seconds of a run, kept in memory by whole frames: messages of equal log time stay or go together."""

import math
from collections import deque
from collections.abc import Collection, Iterator
from typing import NamedTuple

from scene_synth_ros.messages.stamps import NANOSECONDS


class KeptMessage(NamedTuple):
    """A message as it would go into a bag."""

    topic: str
    log_ns: int
    data: bytes


class SnapshotRing:
    """Keeps the messages of the last ``seconds`` of log time, at most ``max_bytes`` of them, and what latched topics said before.

    Args:
        seconds: how far back; 0 keeps nothing.
        max_bytes: bound of memory; the oldest frames go first.
    """

    def __init__(self, seconds: float, max_bytes: int) -> None:
        self._span_ns, self._max_bytes = round(seconds * NANOSECONDS), max_bytes
        self._messages: deque[KeptMessage] = deque()
        self._before: dict[str, KeptMessage] = {}
        self._newest_ns = self._forgotten_ns = -1
        self.latched: Collection[str] = ()
        self.size = 0

    def add(self, message: KeptMessage) -> None:
        """Take a message; where log times go back, because time has begun anew, what was before is no longer among the last seconds."""
        if not self._span_ns:
            return
        if message.log_ns < self._newest_ns:
            self._forget_until(math.inf)
            self._forgotten_ns = -1
        self._newest_ns = message.log_ns
        self._messages.append(message)
        self.size += len(message.data)
        self._forget_until(max(message.log_ns - self._span_ns, self._forgotten_ns + 1))
        while self.size > self._max_bytes:
            self._forgotten_ns = self._messages[0].log_ns
            self._forget_until(self._forgotten_ns + 1)

    def _forget_until(self, end_ns: float) -> None:
        """Forget what was logged before ``end_ns``, except the last messages of latched topics."""
        while self._messages and self._messages[0].log_ns < end_ns:
            oldest = self._messages.popleft()
            self.size -= len(oldest.data)
            if oldest.topic in self.latched:
                self._before[oldest.topic] = oldest

    def content(self) -> Iterator[KeptMessage]:
        """Yield the latched state at the beginning, then what is kept."""
        if self._messages:
            start_ns = self._messages[0].log_ns
            yield from (message._replace(log_ns=start_ns) for message in self._before.values())
            yield from self._messages
