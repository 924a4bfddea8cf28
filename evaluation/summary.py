"""From measurements of frames to an evaluation: metrics of each frame, and over all, by room type, class, distance and factor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.confidence import DRAWS, intervals
from evaluation.core.groups import DISTANCE_NAMES
from evaluation.core.task import Breakdown, Measurement, Tally, Task, parts_of
from evaluation.evaluation_file import Evaluation, FactorValue, FrameKey, FrameRow, SummaryRow, task_row
from evaluation.tasks import TASKS
from scene_description.labels import NYU40

NYU40_NAMES: Mapping[int, str] = {label.id: label.name for label in NYU40}
WITHOUT_ESTIMATE = "frames without an estimate"
"""Key of ``missing``: how many frames the algorithm said nothing of in a task or more."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredFrame:
    """What one task measured of a frame; ``measurement`` is None where the algorithm estimated nothing."""

    key: FrameKey
    task: str
    measurement: Measurement | None


def make_evaluation(
    measured: Iterable[MeasuredFrame],
    *,
    title: str,
    algorithm: str,
    created_with: str,
    seed: int,
    draws: int = DRAWS,
    class_names: Mapping[int, str] = NYU40_NAMES,
    missing: Mapping[str, int] | None = None,
) -> Evaluation:
    """Return the evaluation of all these frames, in the order of the frames.

    Args:
        measured: of every frame and task that was to be judged.
        title: of a report.
        algorithm: what was judged.
        created_with: the command that makes the evaluation again.
        seed: of the confidence intervals.
        draws: of the bootstrap.
        class_names: class id -> name, of the standard that the truth has.
        missing: further counts of what was not there, or one of ``WITHOUT_ESTIMATE`` that counts frames of whole rooms too.
    """
    frames = list(measured)
    tasks = [task for name, task in TASKS.items() if any(frame.task == name for frame in frames)]
    rows: list[SummaryRow] = []
    for task in tasks:
        rows += summarise(task, [frame for frame in frames if frame.task == task.name], seed=seed, draws=draws, class_names=class_names)
    lost = len({(frame.key.bag, frame.key.variant, frame.key.stamp_ns) for frame in frames if frame.measurement is None})
    return Evaluation(
        title=title,
        algorithm=algorithm,
        created_with=created_with,
        tasks=tuple(map(task_row, tasks)),
        frames=tuple(map(frame_row, frames)),
        summary=tuple(rows),
        missing={WITHOUT_ESTIMATE: lost, **(missing or {})},
    )


def frame_row(frame: MeasuredFrame) -> FrameRow:
    """Return the metrics of one frame; None where they are undefined or nothing was estimated."""
    task = TASKS[frame.task]
    values = task.score([frame.measurement] if frame.measurement is not None else [])
    return FrameRow(key=frame.key, task=task.name, metrics={name: value if np.isfinite(value) else None for name, value in values.items()})


def summarise(
    task: Task, frames: Sequence[MeasuredFrame], *, seed: int, draws: int = DRAWS, class_names: Mapping[int, str] = NYU40_NAMES
) -> list[SummaryRow]:
    """Return the rows of one task: over all frames, by room type, by class, by distance and by each factor that takes several values."""
    known = [frame for frame in frames if frame.measurement is not None]
    if not known:
        return []
    rows: list[SummaryRow] = []

    def add(by: str, key: FactorValue, rooms: Sequence[Tally], count: int, answers: Sequence[tuple[int, int]] = ()) -> None:
        metrics = intervals(task, rooms, seed=seed, answers=answers, draws=draws)
        rows.append(SummaryRow(task=task.name, by=by, key=key, metrics=metrics, rooms=len(rooms), frames=count))

    def add_frames(by: str, key: FactorValue, rooms: Mapping[RoomKey, Measurement], chosen: Sequence[MeasuredFrame]) -> None:
        answers = _answers(chosen, rooms)
        add(by, key, [merged.whole for merged in rooms.values()], sum(answered for answered, _ in answers), answers)

    rooms = _merged_rooms(task, known)
    add_frames("all", "all", rooms, frames)
    for room_type in sorted({frame.key.room_type for frame in known}):
        of_type = {room: merged for room, merged in rooms.items() if room.room_type == room_type}
        add_frames("room_type", room_type, of_type, [frame for frame in frames if frame.key.room_type == room_type])
    names: dict[Breakdown, Mapping[int, str]] = {"class": class_names, "distance": dict(enumerate(DISTANCE_NAMES))}
    for by, names_of in names.items():
        for key in sorted({key for merged in rooms.values() for key in parts_of(merged, by)}):
            parts = [parts_of(merged, by)[key] for merged in rooms.values() if key in parts_of(merged, by)]
            count = sum(frame.measurement is not None and key in parts_of(frame.measurement, by) for frame in known)
            add(by, names_of.get(key, str(key)), parts, count)
    for factor in dict.fromkeys(name for frame in known for name in frame.key.factors):
        values = list(dict.fromkeys(frame.key.factors.get(factor) for frame in known))
        for value in values if len(values) > 1 else ():
            chosen = [frame for frame in frames if frame.key.factors.get(factor) == value]
            add_frames(factor, value, _merged_rooms(task, chosen), chosen)
    return rows


@dataclass(frozen=True, slots=True)
class RoomKey:
    """A room, whichever variants of a sweep and bags show it."""

    room_type: str
    seed: int
    room: int


def room_of(key: FrameKey) -> RoomKey:
    """Return the room that a frame shows."""
    return RoomKey(key.room_type, key.seed, key.room)


def _answers(frames: Sequence[MeasuredFrame], first: Iterable[RoomKey]) -> list[tuple[int, int]]:
    """Return of each room, ``first`` ones first, how many frames have an estimate, and how many frames there are."""
    asked = Counter(room_of(frame.key) for frame in frames)
    answered = Counter(room_of(frame.key) for frame in frames if frame.measurement is not None)
    return [(answered[room], asked[room]) for room in dict.fromkeys([*first, *asked])]


def _merged_rooms(task: Task, frames: Sequence[MeasuredFrame]) -> dict[RoomKey, Measurement]:
    rooms: dict[RoomKey, list[Measurement]] = {}
    for frame in frames:
        if frame.measurement is not None:
            rooms.setdefault(room_of(frame.key), []).append(frame.measurement)
    return {room: task.merge(measurements) for room, measurements in rooms.items()}
