"""The thread that writes bags, which no exception ends and whose faults nobody misses."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import ParamSpec

from scene_description import SceneSynthError, error_line
from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.bags.bounded_thread import BoundedThread

P = ParamSpec("P")
_CAUSED_BY_USERS = (SceneSynthError, OSError)


class BagThread:
    """The first fault of writing: after it nothing more is written, and whoever waits for an answer gets it.

    Threads: the thread of the node's executor calls every method; jobs run in the thread of this object, which alone writes ``fault``.

    Args:
        tell_fault: called, in the thread of this object, with a fault of the program; returns it in one line.
        places: how many jobs may wait; more keep the caller waiting.

    Attributes:
        fault: why writing has ended early, one line, of the first fault; empty while all is well.
    """

    def __init__(self, tell_fault: Callable[[Exception], str], places: int) -> None:
        self.fault = ""
        self._tell_fault = tell_fault
        self._pool = BoundedThread("bag", places)
        self._closed = False

    def do(self, job: Callable[P, object], *values: P.args, **named: P.kwargs) -> None:
        """Do a job; whatever it raises is a fault.  Once the thread has ended, nothing is done."""
        if not self._closed:
            self._pool.submit(self._do, lambda: job(*values, **named))

    def ask(self, job: Callable[P, str], *values: P.args, **named: P.kwargs) -> Future[str]:
        """Do a job that answers; the future is its answer, or a BagWriteError: what it refuses, or the fault, also an earlier one."""
        if self._closed:
            ended: Future[str] = Future()
            ended.set_exception(BagWriteError(self.fault or "the recording has ended"))
            return ended
        return self._pool.submit(self._ask, lambda: job(*values, **named))

    def wait(self) -> None:
        """Wait until everything handed over so far is done."""
        if not self._closed:
            self._pool.submit(lambda: None).result()

    def close(self) -> None:
        """End the thread when everything handed over is done; harmless when repeated."""
        self._closed = True
        self._pool.shutdown()

    def _do(self, job: Callable[[], object]) -> None:
        try:
            job()
        except Exception as error:  # whatever it is: the thread must outlive it, and everybody must hear of it
            self._take_fault(error)

    def _ask(self, job: Callable[[], str]) -> str:
        if self.fault:
            raise BagWriteError(self.fault)
        try:
            return job()
        except _CAUSED_BY_USERS as error:
            raise BagWriteError(error_line(error)) from error
        except Exception as error:
            self._take_fault(error)
            raise BagWriteError(self.fault) from error

    def _take_fault(self, error: Exception) -> None:
        by_users = isinstance(error, _CAUSED_BY_USERS)
        line = error_line(error) if by_users else f"the recording ends: {self._tell_fault(error)}"
        self.fault = self.fault or line
