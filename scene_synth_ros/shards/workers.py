"""The worker processes of a run: each makes one shard at a time; one that dies is replaced, and a room that kills them is given up."""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections import Counter, deque
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any

from scene_synth_ros.shards.completion import ShardError
from scene_synth_ros.shards.make_shard import MAX_ATTEMPTS
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.worker_start import processors_of, worker_environment

_OWN_DEATHS = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}
"""Signals by which a process ends for what it does; any other comes from outside, and ends the run."""
_END_S = 5.0

Told = Callable[[dict[str, Any]], None]
"""Takes what a worker says: ``what`` and more (:mod:`scene_synth_ros.shards.worker`)."""


class _Worker:
    """A worker process, and the thread that reads what it says."""

    def __init__(
        self, number: int, threads: int, begin: dict[str, Any], events: queue.Queue[tuple[_Worker, dict[str, Any]]], lock: int
    ) -> None:
        self.number, self.shard, self.room = number, -1, -1
        processors = processors_of(number, threads, sorted(os.sched_getaffinity(0)))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "scene_synth_ros.shards.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=worker_environment(os.environ, len(processors)),
            pass_fds=(lock,),
            text=True,
            encoding="utf-8",
        )
        self._events = events
        self._send({**begin, "processors": processors})
        threading.Thread(target=self._read, name=f"worker {number}", daemon=True).start()

    def begin(self, shard: int, given_up: dict[int, str]) -> None:
        """Let it make a shard."""
        self.shard, self.room = shard, -1
        self._send({"shard": shard, "given_up": given_up})

    def end(self) -> int:
        """Let it end at once; return its exit status."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.close()
        except BrokenPipeError:
            pass
        try:
            return self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def _send(self, order: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass  # it has died, and its reader tells

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._events.put((self, json.loads(line)))
        self._events.put((self, {"what": "ended", "status": self._process.wait()}))


class Workers:
    """Worker processes; a context manager that ends them.

    Threads: one calls every method; each worker has a thread that reads what it says.

    Args:
        plan: of the dataset.
        where: its folder or URL.
        count: of workers.
        threads: processors of each.
        lock: descriptor of the folder's lock, which they inherit.
    """

    def __init__(self, plan: DatasetPlan, where: str, count: int, threads: int, lock: int) -> None:
        self._begin = {"plan": plan.to_json().decode(), "where": where}
        self._count, self._threads, self._lock = count, threads, lock
        self._events: queue.Queue[tuple[_Worker, dict[str, Any]]] = queue.Queue()
        self._workers: list[_Worker] = []
        self._given_up: dict[int, str] = {}
        self._deaths: Counter[int] = Counter()
        self._waiting: deque[int] = deque()

    def make(self, shards: Sequence[int], told: Told) -> None:
        """Make shards, in any order; what workers say is told in the calling thread.

        Raises:
            ShardError: a shard could not be made, or a worker was killed.
        """
        self._waiting = deque(shards)
        left = len(shards)
        for number in range(min(self._count, len(shards))):
            self._start(number)
        while left:
            worker, event = self._events.get()
            if event["what"] == "room":
                worker.room = event["room"]
            elif event["what"] == "done":
                left -= 1
                worker.shard = worker.room = -1
                self._give(worker)
            elif event["what"] == "broken":
                raise ShardError(f"{event['error']}; --resume goes on from here")
            elif event["what"] == "ended" and worker.shard >= 0:
                self._replace(worker, event["status"])
            told(event)

    def _start(self, number: int) -> None:
        worker = _Worker(number, self._threads, self._begin, self._events, self._lock)
        self._workers.append(worker)
        self._give(worker)

    def _give(self, worker: _Worker) -> None:
        if self._waiting:
            shard = self._waiting.popleft()
            worker.begin(shard, self._given_up)

    def _replace(self, worker: _Worker, status: int) -> None:
        """Make the shard of a worker that has died once more; a room that kills one time and again is given up.

        Raises:
            ShardError: it was killed from outside, or died before it had begun with a room.
        """
        self._workers.remove(worker)
        ended = f"ended by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        if -status not in _OWN_DEATHS or worker.room < 0:
            raise ShardError(f"a worker {ended}, by lack of memory perhaps; take fewer --workers, and --resume for what is missing")
        self._deaths[worker.room] += 1
        if self._deaths[worker.room] >= MAX_ATTEMPTS:
            self._given_up[worker.room] = f"a process that made it {ended}"
        self._waiting.appendleft(worker.shard)
        self._start(worker.number)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for worker in self._workers:
            worker.end()
