"""One thread for jobs that are done in order beside the thread that hands them over."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import BoundedSemaphore
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class BoundedThread(ThreadPoolExecutor):
    """A ``ThreadPoolExecutor`` of one thread whose ``submit`` waits while too many jobs wait.

    Threads: any thread may submit; jobs run in the thread of this object, one at a time.  The semaphore counts the free places.

    A job that raises leaves its exception in its future, and the thread goes on with the next.

    Args:
        places: how many jobs may wait or be at work.
    """

    def __init__(self, name: str, places: int) -> None:
        super().__init__(1, name)
        self._free = BoundedSemaphore(places)

    def submit(self, job: Callable[P, T], /, *values: P.args, **named: P.kwargs) -> Future[T]:
        """Hand over a job when there is a place for it.

        Raises:
            RuntimeError: the thread has been told to end.
        """
        self._free.acquire()
        try:
            return super().submit(self._run, job, *values, **named)
        except RuntimeError:
            self._free.release()
            raise

    def _run(self, job: Callable[P, T], /, *values: P.args, **named: P.kwargs) -> T:
        try:
            return job(*values, **named)
        finally:
            self._free.release()
