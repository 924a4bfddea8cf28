"""The thread that measures while the thread of the executor goes on taking messages."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

Item = TypeVar("Item")


class MeasuringThread(Generic[Item]):
    """Does one job for each item, in their order, and gives up items when too many wait.

    Threads: one thread calls the methods; jobs run in the thread of this object, which nothing that a job raises ends.

    Args:
        job: what is done.
        failed: called, in the thread of this object, with what a job raised.
        places: how many items may wait.
    """

    def __init__(self, job: Callable[[Item], None], failed: Callable[[Exception], object], places: int) -> None:
        self._job, self._failed = job, failed
        self._queue: queue.Queue[Item | None] = queue.Queue()
        self._places = places
        self._thread = threading.Thread(target=self._run, name="measuring", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """How many items wait."""
        return self._queue.qsize()

    def offer(self, item: Item) -> bool:
        """Hand over an item; return False, and forget it, where too many wait."""
        if self._queue.qsize() >= self._places:
            return False
        self._queue.put(item)
        return True

    def close(self, timeout_s: float) -> bool:
        """Let the thread do what waits and end; return whether it has ended in time."""
        self._queue.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            try:
                self._job(item)
            except Exception as error:
                self._failed(error)
