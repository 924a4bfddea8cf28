"""Threads that share the pieces of an image; kernels release the GIL, so they run side by side."""

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import TypeVar

from renderer.core.errors import RenderCancelled

Piece = TypeVar("Piece")
_POLL_S = 0.05


def thread_count(asked: int) -> int:
    """Return the number of threads to use: ``asked``, or one for each processor that this process may use when 0."""
    return asked or len(os.sched_getaffinity(0))


class Workers:
    """A fixed set of threads, numbered from 0, each with its own scratch memory elsewhere; a single one is the calling thread."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool = ThreadPoolExecutor(count, "renderer")
        self._alone = count == 1

    @contextmanager
    def in_this_thread(self) -> Iterator[None]:
        """Let :meth:`run` work in the calling thread alone, as worker 0, so that others keep the processors."""
        self._alone, before = True, self._alone
        try:
            yield
        finally:
            self._alone = before

    def run(self, work: Callable[[int, Piece], None], pieces: Iterable[Piece], cancelled: Callable[[], bool] | None = None) -> None:
        """Call ``work(worker, piece)`` for every piece, in any order.

        ``cancelled`` is asked in the calling thread, first and then every 50 ms; where that thread works itself, before every piece.

        Raises:
            RenderCancelled: ``cancelled`` returned True; pieces under way are finished first, the others are dropped.
        """
        if self._alone:
            for piece in pieces:
                if cancelled is not None and cancelled():
                    raise RenderCancelled("render: cancelled by its caller")
                work(0, piece)
            return
        if cancelled is not None and cancelled():
            raise RenderCancelled("render: cancelled by its caller")
        queue, stop = deque(pieces), threading.Event()

        def drain(worker: int) -> None:
            while not stop.is_set():
                try:
                    piece = queue.popleft()
                except IndexError:
                    return
                work(worker, piece)

        jobs = [self._pool.submit(drain, worker) for worker in range(self.count)]
        try:
            while wait(jobs, timeout=None if cancelled is None else _POLL_S).not_done:
                if cancelled is not None and cancelled():
                    raise RenderCancelled("render: cancelled by its caller")
        finally:
            stop.set()
            wait(jobs)
        for job in jobs:
            job.result()

    def close(self) -> None:
        """End the threads; harmless when repeated."""
        self._pool.shutdown()


PIECE = 1024


class Pieces:
    """The pieces of a range of ``count`` items that are still to be done, ``size`` at a time."""

    def __init__(self, count: int, size: int = PIECE) -> None:
        self._left = {(first, min(first + size, count)) for first in range(0, count, size)}

    def run(self, workers: Workers, work: Callable[[int, tuple[int, int]], None], cancelled: Callable[[], bool] | None = None) -> None:
        """Call ``work(worker, (first, end))`` for the pieces that are left; those that are done stay done.

        Raises:
            RenderCancelled: ``cancelled`` returned True; call again for the rest.
        """

        def do(worker: int, piece: tuple[int, int]) -> None:
            work(worker, piece)
            self._left.discard(piece)

        if self._left:
            workers.run(do, sorted(self._left), cancelled)
