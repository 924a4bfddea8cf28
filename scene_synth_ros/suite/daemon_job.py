"""Work in a thread of its own that a process need not wait for when it ends."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Any, TypeVar

T = TypeVar("T")


def start_daemon_job(name: str, work: Callable[[], T], after: Future[Any] | None = None) -> Future[T]:
    """Do some work in a daemon thread and return its future, which has the result or whatever was raised.

    The threads of a ``ThreadPoolExecutor`` are joined when the interpreter ends: a job that waits for messages would never let it end.

    Args:
        name: of the thread.
        work: what to do.
        after: an earlier job; the work begins when that has ended, and never if its own future is cancelled before.
    """
    future: Future[T] = Future()

    def run() -> None:
        if after is not None:
            wait([after])
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(work())
        except BaseException as error:  # whoever holds the future is told
            future.set_exception(error)

    threading.Thread(target=run, name=name, daemon=True).start()
    return future
