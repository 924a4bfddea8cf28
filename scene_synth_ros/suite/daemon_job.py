"""Work in a thread of its own that a process need not wait for when it ends."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Any, Generic, TypeVar

from scene_description import SceneSynthError
from scene_synth_ros.suite.faults import Faults

T = TypeVar("T")


def start_daemon_job(name: str, work: Callable[[], T], after: Future[Any] | None = None) -> Future[T]:
    """Do some work in a daemon thread and return its future, which has the result or whatever was raised.

    The threads of a ``ThreadPoolExecutor`` are joined when the interpreter ends: a job that waits for messages would never let it end.

    ``after``: an earlier job; the work begins when that has ended, and never if its own future is cancelled before.
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


class JobAhead(Generic[T]):
    """One job at a time, done before its result is needed; each begins when one that was dropped before it has ended.

    Threading: one thread calls every method; jobs run in daemon threads.

    Args:
        name: of the threads.
        doing: what a job does, as a fault's report says it.
        faults: takes what jobs have raised whose results nobody asks for, beyond ``expected``.
        release: frees the result of a job that was dropped.
        expected: what a user can cause.
    """

    def __init__(
        self,
        name: str,
        doing: str,
        faults: Faults,
        release: Callable[[T], None] = lambda _: None,
        expected: tuple[type[BaseException], ...] = (SceneSynthError, OSError),
    ) -> None:
        self._name, self._doing, self._faults, self._release, self._expected = name, doing, faults, release, expected
        self._dropped: Future[T] | None = None
        self.job: Future[T] | None = None
        """The job that was begun and neither taken nor dropped."""

    def begin(self, work: Callable[[], T]) -> Future[T]:
        """Begin a job, while there is none."""
        self.job = start_daemon_job(self._name, work, after=self._dropped)
        return self.job

    def take(self) -> Future[T] | None:
        """Return the job if it has ended; then the next may begin."""
        if self.job is None or not self.job.done():
            return None
        job, self.job = self.job, None
        return job

    def drop(self) -> None:
        """Forget the job; one at work ends by itself."""
        job, self.job = self.job, None
        if job is not None:
            self._dropped = job
            if not job.cancel():
                job.add_done_callback(self._forget)

    def result(self, job: Future[T]) -> T | None:
        """Return the result of a job that has ended; None if it has none, and then only a fault is told."""
        error = job.exception()
        if error is None:
            return job.result()
        if not isinstance(error, self._expected):
            self._faults.tell(error, self._doing)
        return None

    def _forget(self, job: Future[T]) -> None:
        result = self.result(job)
        if result is not None:
            self._release(result)
