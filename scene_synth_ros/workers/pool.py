"""Worker processes that share the tasks of a run: each does one at a time, on processors of its own."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from multiprocessing.connection import Connection, Pipe, wait
from types import TracebackType
from typing import Any, NamedTuple

from scene_description import SceneSynthError
from scene_synth_ros.workers.processors import processors_of, worker_environment

_END_S = 5.0
"""How long workers may take to end, all together, before they are killed."""

Tell = Callable[[Any], None]
"""Takes what is said of a task as it proceeds."""
Do = Callable[[Any, Tell], Any]
"""Does a task in a worker and returns its result."""


class WorkerError(SceneSynthError):
    """A task that a worker could not do, or a worker that was ended; one line."""


class Death(NamedTuple):
    """A worker that ended at work.

    Attributes:
        worker: which it was, for people.
        task: that it was at.
        last: what it told last of that task, None where it told nothing.
        status: of the process, negative for a signal.
    """

    worker: str
    task: Any
    last: Any
    status: int

    @property
    def line(self) -> str:
        """Say who ended by what."""
        if self.status >= 0:
            return f"{self.worker} ended with status {self.status}"
        memory = ", by lack of memory perhaps (take fewer --workers)" if -self.status == signal.SIGKILL else ""
        name = signal.Signals(-self.status).name if -self.status in set(signal.Signals) else f"signal {-self.status}"
        return f"{self.worker} was ended by {name}{memory}"


def end_run(death: Death) -> Any:
    """End the run in which a worker has died.

    Raises:
        WorkerError: always; it names the worker and what ended it.
    """
    raise WorkerError(f"{death.line}; run again for what is missing")


class _Worker:
    """A worker process, and what it is at."""

    def __init__(self, number: int, begin: Sequence[Any], threads: int, inherited: Sequence[int]) -> None:
        self.number = number
        self.task: Any = None
        self.last: Any = None
        processors = processors_of(number, threads, sorted(os.sched_getaffinity(0)))
        self.connection, other = Pipe()
        with _no_interrupt():  # Ctrl-C is the first process's, which ends the connection
            self.process = subprocess.Popen(
                [sys.executable, "-m", "scene_synth_ros.workers.worker", str(other.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=2,
                env=worker_environment(os.environ, len(processors)),
                pass_fds=(other.fileno(), *inherited),
            )
        other.close()
        self._send((processors, *begin))

    def begin(self, task: Any) -> None:
        """Let it do a task."""
        self.task, self.last = task, None
        self._send(task)

    def death(self) -> Death:
        """Return how it ended, once its connection has."""
        self.connection.close()
        return Death(f"worker {self.number} (process {self.process.pid})", self.task, self.last, self.status(time.monotonic() + _END_S))

    def status(self, end_s: float) -> int:
        """Return the exit status, by a time of the monotonic clock at the latest: then the process is killed."""
        try:
            return self.process.wait(max(0.0, end_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()

    def _send(self, order: Any) -> None:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # it has died, as its connection will tell
            self.connection.send(order)


class WorkerPool:
    """Worker processes; a context manager that ends them.

    Threads: one calls every method.

    Args:
        prepare: function of a module, which a worker calls by its name once it is on its processors, and which returns what does a task.
        setup: what it is called with; as tasks, what is told and results, anything that can be pickled.
        workers: how many there are at most.
        threads: processors of each.
        inherited: descriptors that workers hold, too, of a folder's lock, say.
    """

    def __init__(self, prepare: Callable[[Any], Do], setup: Any, workers: int, threads: int = 1, inherited: Sequence[int] = ()) -> None:
        self._begin = (prepare.__module__, prepare.__qualname__, pickle.dumps(setup))
        self._count, self._threads, self._inherited = workers, threads, inherited
        self._processes: list[_Worker] = []
        self._busy: dict[Connection, _Worker] = {}

    def results(self, tasks: Iterable[Any], told: Tell = lambda _: None, died: Callable[[Death], Any] = end_run) -> Iterator[Any]:
        """Do tasks and yield their results as they come, in any order.

        Args:
            tasks: are taken as workers get free.
            told: called with what workers tell, in the calling thread.
            died: called where a worker has died; returns the task to do in its place, or raises what ends the run.

        Raises:
            WorkerError: a task could not be done, or a worker was ended.
        """
        waiting = iter(tasks)
        for number, task in zip(range(self._count), waiting, strict=False):
            self._start(number, task)
        while self._busy:
            for connection in wait(list(self._busy)):
                assert isinstance(connection, Connection)
                worker = self._busy[connection]
                try:
                    what, value = connection.recv()
                except (EOFError, OSError):  # it has ended; half a message is none
                    del self._busy[connection]
                    self._start(worker.number, died(worker.death()))
                    continue
                if what == "told":
                    worker.last = value
                    told(value)
                elif what == "failed":
                    raise WorkerError(value)
                else:
                    self._go_on(worker, waiting)
                    yield value

    def _start(self, number: int, task: Any) -> None:
        worker = _Worker(number, self._begin, self._threads, self._inherited)
        self._processes.append(worker)
        self._busy[worker.connection] = worker
        worker.begin(task)

    def _go_on(self, worker: _Worker, waiting: Iterator[Any]) -> None:
        """Give a worker the next task; end it where there is none."""
        try:
            worker.begin(next(waiting))
        except StopIteration:
            del self._busy[worker.connection]
            worker.connection.close()

    def __enter__(self) -> "WorkerPool":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for worker in self._processes:
            worker.connection.close()
        end_s = time.monotonic() + _END_S
        for worker in self._processes:
            worker.status(end_s)


def in_order(prepare: Callable[[Any], Do], setup: Any, tasks: Sequence[Any], workers: int, told: Tell = lambda _: None) -> Iterator[Any]:
    """Do tasks, in this process or in several, each with one processor; yield their results in the order of the tasks.

    ``prepare`` and ``setup`` are those of :class:`WorkerPool`; ``told`` is called with what is said of tasks as they proceed.

    Raises:
        WorkerError: a worker could not do a task, or was ended.
    """
    if workers == 1 or len(tasks) < 2:
        do = prepare(setup)
        yield from (do(task, told) for task in tasks)
        return
    early: dict[int, Any] = {}
    place = 0
    with WorkerPool(prepare_numbered, (prepare, setup), min(workers, len(tasks))) as pool:
        for number, result in pool.results(enumerate(tasks), told):
            early[number] = result
            while place in early:
                yield early.pop(place)
                place += 1


def prepare_numbered(work: tuple[Callable[[Any], Do], Any]) -> Do:
    """Return what does a task with its number before it, and returns the number with the result."""
    prepare, setup = work
    do = prepare(setup)
    return lambda task, tell: (task[0], do(task[1], tell))


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Let SIGTERM end a run as Ctrl-C does, what it has begun with it, with status 143; for the first thread."""
    terminated = 128 + signal.SIGTERM
    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(terminated))
    try:
        yield
    except SystemExit:  # nothing else ends a run so; Ray, if it is waited for meanwhile, puts a status of its own in it
        sys.exit(terminated)
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def _no_interrupt() -> Iterator[None]:
    """Hold SIGINT back meanwhile; what is started then never gets it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
