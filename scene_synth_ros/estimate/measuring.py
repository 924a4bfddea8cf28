"""Measures rooms of a dataset as they will be made: in as many processes at once, each on its own processors."""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.sharedctypes import Synchronized
from typing import NamedTuple

from scene_description import SceneSynthError
from scene_synth_ros.estimate.room_cost import RoomCost, measure_room
from scene_synth_ros.offline.rules import rules_of
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.shards.worker_start import pin, processors_of, thread_environment
from scene_synth_ros.suite.environment import environment
from scene_synth_ros.suite.heap import limit_arenas

_WARM_FRAMES = 2


class EstimateError(SceneSynthError):
    """A sample that cannot be measured; one line."""


class Measured(NamedTuple):
    """What a sample of rooms says.

    Attributes:
        rooms: what each costs, by index.
        start_s: what a process took before its first room, the longest: modules, compiled kernels, and a room that is not counted.
        memory_bytes: the most that a process had.
    """

    rooms: tuple[RoomCost, ...]
    start_s: float
    memory_bytes: int


class _Sample(NamedTuple):
    """A room's cost, and what the process that made it took to start and had of memory."""

    cost: RoomCost
    start_s: float
    memory_bytes: int


def measure_rooms(
    settings: OfflineSettings,
    indices: Sequence[int],
    most_frames: int,
    workers: int,
    threads: int = 1,
    tell: Callable[[RoomCost], None] = lambda _: None,
) -> Measured:
    """Make some rooms of a dataset and measure them.

    Args:
        settings: of the dataset.
        indices: of the rooms, at least one.
        most_frames: of a room that are rendered.
        workers: processes at work at once.
        threads: processors of each.
        tell: called with every room that is measured.

    Raises:
        EstimateError: a worker was killed.
        SceneSynthError: a room cannot be made.
    """
    context = multiprocessing.get_context("spawn")
    count = min(workers, len(indices))
    samples: list[_Sample] = []
    with ProcessPoolExecutor(count, context, _start_worker, (context.Value("i", 0), threads, time.time())) as pool:
        try:
            with environment(thread_environment(threads)):  # as processes find it that start now
                jobs = [pool.submit(_measure, settings, index, most_frames) for index in indices]
            for job in as_completed(jobs):
                samples.append(job.result())
                tell(samples[-1].cost)
        except BrokenProcessPool:
            raise EstimateError("a worker was killed, by lack of memory perhaps; take fewer --workers") from None
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()
            raise
    return Measured(
        rooms=tuple(sorted((sample.cost for sample in samples), key=lambda cost: cost.index)),
        start_s=max(sample.start_s for sample in samples),
        memory_bytes=max(sample.memory_bytes for sample in samples),
    )


_started: list[float] = []
"""When this process was asked for, by the time of day; then what it took to start."""


def _start_worker(number: Synchronized[int], threads: int, asked: float) -> None:
    """Take this worker's processors; Ctrl-C is left to the first process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit_arenas()
    with number.get_lock():
        place = number.value
        number.value += 1
    pin(processors_of(place, threads, sorted(os.sched_getaffinity(0))))
    _started.append(asked)


def _measure(settings: OfflineSettings, index: int, most_frames: int) -> _Sample:
    rules = rules_of(settings)
    if len(_started) == 1:  # kernels are loaded, or compiled, with the first room of a process
        measure_room(settings, rules, index, _WARM_FRAMES)
        _started.append(time.time() - _started[0])
    cost = measure_room(settings, rules, index, most_frames)
    return _Sample(cost, _started[1], resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
