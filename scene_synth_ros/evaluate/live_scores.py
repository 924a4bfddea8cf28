"""What is known of an algorithm while it runs: measurements of the newest frames, scores of these, and what could not be measured."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evaluation.core.errors import EvaluationError
from evaluation.core.task import Measurement, Tally
from evaluation.evaluation_file import FrameKey
from evaluation.summary import MeasuredFrame
from evaluation.tasks import TASKS
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError
from scene_synth_ros.evaluate.measuring import TruthFrame, measure_frame, measure_room
from scene_synth_ros.evaluate.notes import Notes
from scene_synth_ros.evaluate.readings import Reading, StampedPose
from scene_synth_ros.evaluate.rooms import Rooms
from scene_synth_ros.evaluate.stamp_buffer import Gathered
from scene_synth_ros.evaluate.task_streams import TASK_STREAMS, read_for_task
from scene_synth_ros.evaluate.topics import TypedTopic


class _WholeRoom(NamedTuple):
    """The trajectories of the room at work."""

    key: FrameKey
    truth: list[StampedPose]
    estimate: list[StampedPose]


class LiveScores:
    """Measures frames as they come.

    Threads: one thread calls :meth:`measure`; any thread may call the others.  A lock guards what they share.

    Args:
        tasks: that are judged.
        truth: layer -> topic.
        kept: how many measurements of a task are kept, the newest.
        class_ids: name of a class -> its id.
    """

    def __init__(self, tasks: Sequence[str], truth: Mapping[str, TypedTopic], kept: int, class_ids: Mapping[str, int]) -> None:
        self._tasks, self._truth, self._class_ids = tuple(tasks), truth, class_ids
        self._estimates: dict[str, TypedTopic] = {}
        self._lock = threading.Lock()
        self._rooms = Rooms()
        self._frames: dict[str, deque[MeasuredFrame]] = {task: deque(maxlen=kept) for task in tasks}
        self._whole: dict[str, _WholeRoom] = {}
        self._fresh: dict[str, list[Tally]] = {task: [] for task in tasks}
        self._totals: dict[str, list[Tally]] = {task: [] for task in tasks}
        self._room, self._frame = -1, -1
        self._notes, self._foreign, self._measured = Notes(), Counter[str](), Counter[str]()

    def add_estimates(self, task: str, topic: TypedTopic) -> None:
        """Take where a task's estimates come from, as soon as their type is known."""
        with self._lock:
            self._estimates = {**self._estimates, task: topic}

    def add_room(self, scene: bytes, log_ns: int) -> None:
        """Take a serialised scene description."""
        with self._lock:
            self._rooms.add(scene, log_ns)

    def measure(self, gathered: Gathered[bytes]) -> None:
        """Measure what has come with a stamp."""
        with self._lock:
            estimates = self._estimates
            position = self._rooms.position(gathered.stamp_ns)
            room = self._rooms[position]
        if position != self._room:
            self.finish_room()
            self._room, self._frame = position, -1
        self._frame += 1
        key = FrameKey(
            bag="",
            room=room.index,
            room_type=room.room_type,
            seed=room.seed,
            frame=self._frame,
            stamp_ns=gathered.stamp_ns,
        )
        truth = TruthFrame(self._truth, gathered.items, f"stamp {gathered.stamp_ns} ns", self._class_ids)
        found = {task: _read(task, topic, gathered.items[topic.name]) for task, topic in estimates.items() if topic.name in gathered.items}
        for task in self._tasks:
            self._measure_task(task, key, truth, found)

    def finish_room(self) -> None:
        """Measure the trajectories of the room at work; called too when nothing more will come."""
        for task, room in self._whole.items():
            try:
                measurement = measure_room(task, room.truth, room.estimate)
            except EvaluationError as error:
                self._note(task, f"{error}")
                measurement = None
            self._keep(MeasuredFrame(key=room.key, task=task, measurement=measurement))
        self._whole = {}

    def frames(self) -> list[MeasuredFrame]:
        """Return the measurements that are kept, by tasks."""
        with self._lock:
            return [frame for frames in self._frames.values() for frame in frames]

    def notes(self) -> list[str]:
        """Return what was wrong with estimates, each kind in one line."""
        with self._lock:
            return self._notes.lines()

    def counts(self) -> dict[str, dict[str, int]]:
        """Return task -> how many frames were measured, how many had no estimate, and how many estimates had no truth."""
        with self._lock:
            return {
                task: {"measured": self._measured[task], "missing": self._notes.missing[task], "foreign": self._foreign[task]}
                for task in self._tasks
            }

    def scores(self) -> dict[str, dict[str, float | None]]:
        """Return task -> metric -> value over all frames so far; None where it is undefined.  For one thread only."""
        with self._lock:
            fresh, self._fresh = self._fresh, {task: [] for task in self._tasks}
        found: dict[str, dict[str, float | None]] = {}
        for task, tallies in fresh.items():
            if tallies:
                self._totals[task] = [TASKS[task].tallying.merge([*self._totals[task], *tallies])]
            values = TASKS[task].score_tallies(self._totals[task])
            found[task] = {name: value if np.isfinite(value) else None for name, value in values.items()}
        return found

    def _measure_task(self, task: str, key: FrameKey, truth: TruthFrame, found: Mapping[str, Reading | EstimateError]) -> None:
        estimate = found.get(task)
        if isinstance(estimate, EstimateError):
            self._note(task, f"{estimate}", key.stamp_ns)
            estimate = None
        try:
            reading = truth.layer(TASK_STREAMS[task].name)
        except EvaluateError as error:
            self._note(task, f"{error}")
            reading = None
        with self._lock:
            self._foreign[task] += reading is None and estimate is not None
            self._notes.missing[task] += reading is not None and estimate is None
        if reading is None:
            return
        if TASKS[task].whole_rooms:
            room = self._whole.setdefault(task, _WholeRoom(key, [], []))
            room.truth.extend(reading.value)
            room.estimate.extend(estimate.value if estimate is not None else ())
            return
        measurement: Measurement | None = None
        try:
            measurement = measure_frame(task, truth, found) if estimate is not None else None
        except (EstimateError, EvaluateError, EvaluationError) as error:
            self._note(task, f"{error}", key.stamp_ns)
            with self._lock:
                self._notes.missing[task] += 1
        self._keep(MeasuredFrame(key=key, task=task, measurement=measurement))

    def _keep(self, frame: MeasuredFrame) -> None:
        with self._lock:
            self._frames[frame.task].append(frame)
            if frame.measurement is not None:
                self._measured[frame.task] += 1
                self._fresh[frame.task].append(frame.measurement.whole)

    def _note(self, task: str, line: str, stamp_ns: int | None = None) -> None:
        with self._lock:
            self._notes.add(f"{task}: {line}", "" if stamp_ns is None else f"stamp {stamp_ns} ns")


def _read(task: str, topic: TypedTopic, data: bytes) -> Any:
    try:
        return read_for_task(task, topic.type_name, data, topic.name)
    except EstimateError as error:
        return EstimateError(f"{topic.name}: {error}")
