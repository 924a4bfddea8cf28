"""What is known of an algorithm while it runs: measurements of the newest frames, scores, and what could not be measured."""

import threading
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from evaluation.core.errors import EvaluationError
from evaluation.core.task import Measurement, Tally
from evaluation.evaluation_file import FrameKey
from evaluation.summary import MeasuredFrame
from evaluation.tasks import TASKS
from scene_description import CameraPose
from scene_synth_ros.dataset.rooms import RoomInfo, RoomsByStart
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError, Notes
from scene_synth_ros.evaluate.flow_direction import FlowDirections
from scene_synth_ros.evaluate.measuring import Estimates, TruthFrame, measure_frame, measure_room
from scene_synth_ros.evaluate.readings import Reading
from scene_synth_ros.evaluate.stamp_buffer import Gathered
from scene_synth_ros.evaluate.task_streams import TASK_STREAMS, read_for_task
from scene_synth_ros.evaluate.topics import TypedTopic

Scores = dict[str, dict[str, float | None]]
"""Task -> metric -> value; None where it is undefined."""


class _OfFrame(NamedTuple):
    """What is kept of a frame: its measurement, or, of a task of whole rooms, its two poses; None where there is no estimate."""

    stamp_ns: int
    measurement: Measurement | None = None
    truth: CameraPose | None = None
    estimate: CameraPose | None = None


class LiveScores:
    """Measures frames as they come.  Which room a frame shows is told when it is asked for: its description may come after it.

    Threads: one thread calls :meth:`measure`, one :meth:`scores`; any thread may call the others.  A lock guards what they share.

    Of each task the newest ``kept`` frames are kept.
    """

    def __init__(self, tasks: Sequence[str], truth: Mapping[str, TypedTopic], kept: int) -> None:
        self._tasks, self._truth = tuple(tasks), truth
        self._estimates: dict[str, TypedTopic] = {}
        self._lock = threading.Lock()
        self._rooms = RoomsByStart()
        self._frames: dict[str, deque[_OfFrame]] = {task: deque(maxlen=kept) for task in tasks}
        self._fresh: dict[str, list[Tally]] = {task: [] for task in tasks}
        self._totals: dict[str, list[Tally]] = {task: [] for task in tasks}
        self._newest_ns = 0
        self._notes, self._foreign, self._measured = Notes(), Counter[str](), Counter[str]()
        self._directions = FlowDirections(tasks)

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
            estimates, self._newest_ns = self._estimates, gathered.stamp_ns
        truth = TruthFrame(self._truth, gathered.items, f"stamp {gathered.stamp_ns} ns")
        found = {task: _read(task, topic, gathered.items[topic.name]) for task, topic in estimates.items() if topic.name in gathered.items}
        for task in self._tasks:
            self._measure_task(task, gathered.stamp_ns, truth, found)

    def frames(self) -> list[MeasuredFrame]:
        """Return the measurements that are kept, by tasks and stamps; of a task of whole rooms one for each room."""
        with self._lock:
            kept = {task: sorted(frames, key=lambda frame: frame.stamp_ns) for task, frames in self._frames.items()}
            places = {frame.stamp_ns: self._rooms.position(frame.stamp_ns) for frames in kept.values() for frame in frames}
            rooms = {place: self._rooms[place] for place in places.values()}
        numbers: Counter[int] = Counter()
        keys: dict[int, FrameKey] = {}
        for stamp, place in sorted(places.items()):
            keys[stamp] = _key(rooms[place], numbers[place], stamp)
            numbers[place] += 1
        found: list[MeasuredFrame] = []
        for task, frames in kept.items():
            if TASKS[task].whole_rooms:
                by_room = {place: [frame for frame in frames if places[frame.stamp_ns] == place] for place in rooms}
                rows = [(of_room[0].stamp_ns, self._whole_room(task, of_room)) for of_room in by_room.values() if of_room]
            else:
                rows = [(frame.stamp_ns, frame.measurement) for frame in frames]
            found += [MeasuredFrame(key=keys[stamp], task=task, measurement=measurement) for stamp, measurement in rows]
        return found

    def room(self) -> RoomInfo:
        """Return the room of the newest frame."""
        with self._lock:
            return self._rooms[self._rooms.position(self._newest_ns)]

    def notes(self) -> list[str]:
        """Return what was wrong with estimates, each kind in one line."""
        with self._lock:
            return [*self._notes.lines(), *self._directions.lines()]

    def counts(self) -> dict[str, dict[str, int]]:
        """Return task -> how many frames were measured, how many had no estimate, and how many estimates had no truth."""
        with self._lock:
            return {
                task: {"measured": self._measured[task], "missing": self._notes.missing[task], "foreign": self._foreign[task]}
                for task in self._tasks
            }

    def scores(self) -> Scores:
        """Return the scores over all frames so far, of tasks of whole rooms over those that are kept."""
        with self._lock:
            fresh, self._fresh = self._fresh, {task: [] for task in self._tasks}
        for task, tallies in fresh.items():
            if tallies:
                self._totals[task] = [TASKS[task].tallying.merge([*self._totals[task], *tallies])]
        whole = [task for task in self._tasks if TASKS[task].whole_rooms]
        rooms = [frame for frame in (self.frames() if whole else ()) if frame.task in whole and frame.measurement is not None]
        of_rooms = {task: [frame.measurement.whole for frame in rooms if frame.task == task and frame.measurement] for task in whole}
        values = {task: TASKS[task].score_tallies(of_rooms.get(task, self._totals[task])) for task in self._tasks}
        return {task: {name: value if np.isfinite(value) else None for name, value in found.items()} for task, found in values.items()}

    def _measure_task(self, task: str, stamp_ns: int, truth: TruthFrame, found: Estimates) -> None:
        given = found.get(task)
        estimate = given if isinstance(given, Reading) else None
        if isinstance(given, EstimateError):
            self._note(task, given, stamp_ns)
        try:
            reading = truth.layer(TASK_STREAMS[task].name)
            if truth.says_nothing(task):
                return
        except EvaluateError as error:
            self._note(task, error)
            reading = None
        if reading is None:
            if estimate is not None:
                self._take_foreign(task, stamp_ns)
            return
        if TASKS[task].whole_rooms:
            poses = (*(estimate.value if estimate is not None else ()), None)
            self._keep(task, _OfFrame(stamp_ns, truth=reading.value[0], estimate=poses[0]), there=poses[0] is not None)
            return
        measurement = None
        try:
            measurement = measure_frame(task, truth, found) if estimate is not None else None
            if measurement is not None:
                with self._lock:
                    self._directions.add(task, truth, found)
        except (EstimateError, EvaluateError, EvaluationError) as error:
            self._note(task, error, stamp_ns)
        self._keep(task, _OfFrame(stamp_ns, measurement), there=measurement is not None)

    def _take_foreign(self, task: str, stamp_ns: int) -> None:
        """Count an estimate at a stamp whose truth has not come."""
        with self._lock:
            self._foreign[task] += 1
            name = self._estimates[task].name
        line = f"{name}: expected estimates at the stamps of the truth, got one at a stamp that no truth has; copy the stamp of the image"
        self._note(task, EstimateError(line), stamp_ns)

    def _whole_room(self, task: str, frames: Sequence[_OfFrame]) -> Measurement | None:
        try:
            truth, estimate = [frame.truth for frame in frames], [frame.estimate for frame in frames]
            return measure_room(task, [pose for pose in truth if pose is not None], [pose for pose in estimate if pose is not None])
        except EvaluationError as error:
            self._note(task, error)
            return None

    def _keep(self, task: str, frame: _OfFrame, *, there: bool) -> None:
        with self._lock:
            self._frames[task].append(frame)
            self._measured[task] += there
            self._notes.missing[task] += not there
            if frame.measurement is not None:
                self._fresh[task].append(frame.measurement.whole)

    def _note(self, task: str, error: Exception, stamp_ns: int | None = None) -> None:
        with self._lock:
            self._notes.add(f"{task}: {error}", "" if stamp_ns is None else f"stamp {stamp_ns} ns")


def _key(room: RoomInfo, frame: int, stamp_ns: int) -> FrameKey:
    return FrameKey(bag="", room=room.index, room_type=room.room_type, seed=room.seed, frame=frame, stamp_ns=stamp_ns)


def _read(task: str, topic: TypedTopic, data: bytes) -> Reading | EstimateError:
    try:
        return read_for_task(task, topic.type_name, data, topic.name)
    except EstimateError as error:
        return EstimateError(f"{topic.name}: {error}")
