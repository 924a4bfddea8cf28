"""From measurements of frames to an evaluation: metrics of each frame, and over all, by room type, class, distance and factor."""

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoomPart:
    """What one task measured of a room in one bag: as much as a summary needs, whatever the number of its frames.

    Attributes:
        key: of its first frame.
        task: of ``TASKS``.
        measurement: its frames merged; None where no frame has an estimate.
        asked: how many frames there are.
        answered: how many have an estimate.
        seen: in how many frames there are pixels of a class, or of a bin of distance.
    """

    key: FrameKey
    task: str
    measurement: Measurement | None
    asked: int
    answered: int
    seen: Counter[tuple[Breakdown, int]]


class Gathered:
    """What is kept of measurements: a row of each frame, and a :class:`RoomPart` of each room in each bag."""

    def __init__(self) -> None:
        self.rows: list[FrameRow] = []
        self.parts: list[RoomPart] = []
        self.lost = 0

    def add(self, measured: Iterable[MeasuredFrame]) -> None:
        """Take measurements; all frames of a room in a bag at once, so that they are merged."""
        rooms: dict[tuple[object, ...], list[MeasuredFrame]] = {}
        lost = set()
        for frame in measured:
            self.rows.append(frame_row(frame))
            rooms.setdefault((frame.task, frame.key.bag, frame.key.variant, room_of(frame.key)), []).append(frame)
            if frame.measurement is None:
                lost.add((frame.key.bag, frame.key.variant, frame.key.stamp_ns))
        self.lost += len(lost)
        self.parts += [_room_part(frames) for frames in rooms.values()]

    def take(self, others: "Gathered") -> None:
        """Take what was gathered of further bags."""
        self.rows += others.rows
        self.parts += others.parts
        self.lost += others.lost


def _room_part(frames: Sequence[MeasuredFrame]) -> RoomPart:
    known = [frame.measurement for frame in frames if frame.measurement is not None]
    ways: tuple[Breakdown, ...] = ("class", "distance")
    return RoomPart(
        key=frames[0].key,
        task=frames[0].task,
        measurement=TASKS[frames[0].task].merge(known) if known else None,
        asked=len(frames),
        answered=len(known),
        seen=Counter((by, key) for measurement in known for by in ways for key in parts_of(measurement, by)),
    )


def make_evaluation(
    measured: Iterable[MeasuredFrame] | Gathered,
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
        measured: of every frame and task that was to be judged, or what was gathered of them.
        title: of a report.
        algorithm: what was judged.
        created_with: the command that makes the evaluation again.
        seed: of the confidence intervals.
        draws: of the bootstrap.
        class_names: class id -> name, of the standard that the truth has.
        missing: further counts of what was not there, or one of ``WITHOUT_ESTIMATE`` that counts frames of whole rooms too.
    """
    if isinstance(measured, Gathered):
        found = measured
    else:
        found = Gathered()
        found.add(measured)
    tasks = [task for name, task in TASKS.items() if any(part.task == name for part in found.parts)]
    rows: list[SummaryRow] = []
    for task in tasks:
        rows += summarise(task, [part for part in found.parts if part.task == task.name], seed=seed, draws=draws, class_names=class_names)
    return Evaluation(
        title=title,
        algorithm=algorithm,
        created_with=created_with,
        tasks=tuple(map(task_row, tasks)),
        frames=tuple(found.rows),
        summary=tuple(rows),
        missing={WITHOUT_ESTIMATE: found.lost, **(missing or {})},
    )


def frame_row(frame: MeasuredFrame) -> FrameRow:
    """Return the metrics of one frame; None where they are undefined or nothing was estimated."""
    task = TASKS[frame.task]
    values = task.score([frame.measurement] if frame.measurement is not None else [])
    return FrameRow(key=frame.key, task=task.name, metrics={name: value if np.isfinite(value) else None for name, value in values.items()})


def summarise(
    task: Task, parts: Sequence[RoomPart], *, seed: int, draws: int = DRAWS, class_names: Mapping[int, str] = NYU40_NAMES
) -> list[SummaryRow]:
    """Return the rows of one task: over all frames, by room type, by class, by distance and by each factor that takes several values."""
    known = [part for part in parts if part.measurement is not None]
    if not known:
        return []
    rows: list[SummaryRow] = []

    def add(by: str, key: FactorValue, rooms: Sequence[Tally], count: int, answers: Sequence[tuple[int, int]] = ()) -> None:
        metrics = intervals(task, rooms, seed=seed, answers=answers, draws=draws)
        rows.append(SummaryRow(task=task.name, by=by, key=key, metrics=metrics, rooms=len(rooms), frames=count))

    def add_rooms(by: str, key: FactorValue, chosen: Sequence[RoomPart]) -> None:
        rooms = _merged_rooms(task, chosen)
        answers = _answers(chosen, rooms)
        add(by, key, [merged.whole for merged in rooms.values()], sum(answered for answered, _ in answers), answers)

    add_rooms("all", "all", parts)
    for room_type in sorted({part.key.room_type for part in known}):
        add_rooms("room_type", room_type, [part for part in parts if part.key.room_type == room_type])
    rooms, seen = _merged_rooms(task, known), Counter[tuple[Breakdown, int]]()
    for part in known:
        seen.update(part.seen)
    names: dict[Breakdown, Mapping[int, str]] = {"class": class_names, "distance": dict(enumerate(DISTANCE_NAMES))}
    for by, names_of in names.items():
        for key in sorted(number for way, number in seen if way == by):
            tallies = [parts_of(merged, by)[key] for merged in rooms.values() if key in parts_of(merged, by)]
            add(by, names_of.get(key, str(key)), tallies, seen[by, key])
    for factor in dict.fromkeys(name for part in known for name in part.key.factors):
        values = list(dict.fromkeys(part.key.factors.get(factor) for part in known))
        for value in values if len(values) > 1 else ():
            add_rooms(factor, value, [part for part in parts if part.key.factors.get(factor) == value])
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


def _answers(parts: Sequence[RoomPart], first: Iterable[RoomKey]) -> list[tuple[int, int]]:
    """Return of each room, ``first`` ones first, how many frames have an estimate, and how many frames there are."""
    asked, answered = Counter[RoomKey](), Counter[RoomKey]()
    for part in parts:
        asked[room_of(part.key)] += part.asked
        answered[room_of(part.key)] += part.answered
    return [(answered[room], asked[room]) for room in dict.fromkeys([*first, *asked])]


def _merged_rooms(task: Task, parts: Sequence[RoomPart]) -> dict[RoomKey, Measurement]:
    rooms: dict[RoomKey, list[Measurement]] = {}
    for part in parts:
        if part.measurement is not None:
            rooms.setdefault(room_of(part.key), []).append(part.measurement)
    return {room: found[0] if len(found) == 1 else task.merge(found) for room, found in rooms.items()}
