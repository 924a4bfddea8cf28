"""Counts by topic that one thread reads while another counts."""

from __future__ import annotations

import threading
from collections import Counter


class TopicCounts:
    """A counter of messages by topic.

    Threads: any thread may call anything; the lock guards the counter.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()

    def add(self, topic: str) -> None:
        """Count one message."""
        with self._lock:
            self._counts[topic] += 1

    def __getitem__(self, topic: str) -> int:
        with self._lock:
            return self._counts[topic]

    def total(self) -> int:
        """Return how many messages all topics have."""
        with self._lock:
            return self._counts.total()

    def copy(self) -> dict[str, int]:
        """Return topic -> messages as it is now."""
        with self._lock:
            return dict(self._counts)
