"""The file of an evaluation, ``scene_synth_evaluation/1``: metrics of every frame, and over all frames, room types, classes and so on.

What it holds is read strictly: what does not fit is refused with the path of the field.  Metrics that are undefined are null.
"""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from evaluation.confidence import Interval
from evaluation.core.errors import EvaluationError
from evaluation.core.task import Task
from scene_description.errors import read_at_most
from scene_description.strict import FieldError, Limits, from_mapping, shorten, to_mapping
from scene_description.whole import write_whole

SCHEMA: Final = "scene_synth_evaluation/1"
MAX_BYTES = 2**28
FactorValue = str | float | bool | None
"""A factor's value in a sweep."""

_LONGEST = 10_000
Text = Annotated[str, Limits(max_length=_LONGEST)]
Name = Annotated[str, Limits(min_length=1, max_length=200)]
Count = Annotated[int, Limits(ge=0)]
MetricValues = Mapping[str, float | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricRow:
    """A metric's name, its unit ("" for a share or a plain number), and which way is better."""

    name: Name
    unit: Text = ""
    better: Literal["lower", "higher"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskRow:
    """A task that was evaluated, and its metrics in the order of columns."""

    name: Name
    metrics: tuple[MetricRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameKey:
    """Which frame it is.

    ``bag`` is the path of its bag from the file's folder, ``variant`` its id in a sweep, ``room`` the room's number in its run, ``seed``
    the run's, ``frame`` its number in the room, ``stamp_ns`` its simulated time.  ``factors``: name -> value, of a sweep.

    Of a task that is judged by whole rooms it is the room's first frame.
    """

    bag: Text
    room: Count
    room_type: Name
    seed: Count
    frame: Count
    stamp_ns: int
    variant: Name | None = None
    factors: Mapping[str, FactorValue] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameRow:
    """The metrics of one task in one frame by name; all are None where the algorithm estimated nothing."""

    key: FrameKey
    task: Name
    metrics: MetricValues


@dataclass(frozen=True, slots=True, kw_only=True)
class SummaryRow:
    """The metrics of one task over some frames.

    ``by`` says how the frames, or their pixels, were chosen: "all", "room_type", "class", "distance" or the name of a factor; ``key`` is
    the room type, the class's name, the bin's name or the factor's value ("all" of all).
    """

    task: Name
    by: Name
    key: FactorValue
    metrics: Mapping[str, Interval]
    rooms: Count
    frames: Count


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthRecord:
    """What changes the meaning of a metric: the camera, the classes and the run that the truth is of; None for what its bags do not tell.

    ``camera_model`` and ``distortion`` are CameraInfo's model and coefficients, ``intrinsics`` fx, fy, cx, cy in pixels, rounded to 0.01.
    ``seed`` is the run's, ``grammar`` the name of its grammar file, ``room_types`` what was asked for.
    """

    image_width: Count | None = None
    image_height: Count | None = None
    camera_model: Text | None = None
    intrinsics: tuple[float, float, float, float] | None = None
    distortion: tuple[float, ...] | None = None
    label_standard: Text | None = None
    seed: Count | None = None
    grammar: Text | None = None
    room_types: Text | None = None


def common_truth(records: Sequence[TruthRecord]) -> TruthRecord | None:
    """Return the facts that all records tell alike, None for no fact: what differs among the bags of a sweep is a factor of it."""
    told = {field.name: {getattr(record, field.name) for record in records} for field in dataclasses.fields(TruthRecord)}
    common = TruthRecord(**{name: values.pop() for name, values in told.items() if len(values) == 1})
    return common if common != TruthRecord() else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """All that one evaluation found.

    ``algorithm`` names what was judged, ``created_with`` is the command that makes the file again; ``missing`` counts what was not there.
    ``truth`` is what the bags of the truth have in common, None where that is not known.
    """

    title: Text
    algorithm: Text
    created_with: Text
    tasks: tuple[TaskRow, ...]
    frames: tuple[FrameRow, ...]
    summary: tuple[SummaryRow, ...]
    missing: Mapping[str, Count] = field(default_factory=dict)
    truth: TruthRecord | None = None


def task_row(task: Task) -> TaskRow:
    """Return the row of a task."""
    metrics = tuple(MetricRow(name=metric.name, unit=metric.unit, better=metric.better) for metric in task.metrics)
    return TaskRow(name=task.name, metrics=metrics)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameFileRow(FrameKey):
    """A row of ``frames``: the frame, and the metrics of one task in it by name; all are null where the algorithm estimated nothing."""

    task: Name
    metrics: MetricValues


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationFile:
    """The file of an evaluation: what was judged, the metrics of each frame, and the metrics over frames with confidence intervals."""

    schema: Literal["scene_synth_evaluation/1"]
    title: Text
    algorithm: Text
    created_with: Text
    tasks: tuple[TaskRow, ...]
    frames: tuple[FrameFileRow, ...]
    summary: tuple[SummaryRow, ...]
    missing: Mapping[str, Count] = field(default_factory=dict)
    truth: TruthRecord | None = None


def evaluation_to_mapping(evaluation: Evaluation) -> dict[str, Any]:
    """Return what the file holds, ready for ``json.dumps``."""
    return {
        "schema": SCHEMA,
        **{name: _bounded(getattr(evaluation, name)) for name in ("title", "algorithm", "created_with")},
        "tasks": to_mapping(evaluation.tasks),
        "frames": [_frame_mapping(row) for row in evaluation.frames],
        "summary": [dataclasses.asdict(row) for row in evaluation.summary],
        "missing": dict(evaluation.missing),
        **({"truth": to_mapping(evaluation.truth)} if evaluation.truth is not None else {}),
    }


def _bounded(text: str) -> str:
    """Return a text as a reader takes it: the end of one that is longer, a command with very many topics, say, is cut off, and told."""
    told = f" ... (cut: {len(text)} characters)"
    return text if len(text) <= _LONGEST else text[: _LONGEST - len(told)] + told


def _frame_mapping(row: FrameRow) -> dict[str, Any]:
    key = {name: getattr(row.key, name) for name in ("bag", "variant", "room", "room_type", "seed", "frame", "stamp_ns")}
    return {**key, "factors": dict(row.key.factors), "task": row.task, "metrics": dict(row.metrics)}


def evaluation_from_mapping(data: object) -> Evaluation:
    """Read what the file holds.

    Raises:
        FieldError: with the path of the first field that does not fit.
    """
    if not isinstance(data, Mapping):
        raise FieldError("", "a mapping (an evaluation)", shorten(data))
    if data.get("schema") != SCHEMA:
        raise FieldError("schema", repr(SCHEMA), shorten(data.get("schema")))
    for name in ("frames", "summary"):
        if name not in data:
            raise FieldError(name, "a list", "nothing (the key is missing)")
    document = from_mapping(EvaluationFile, data)
    fields = {name: getattr(document, name) for name in ("title", "algorithm", "created_with", "tasks", "summary", "missing", "truth")}
    evaluation = Evaluation(**fields, frames=tuple(_frame_row(row) for row in document.frames))
    _check_names(evaluation)
    return evaluation


def _frame_row(row: FrameFileRow) -> FrameRow:
    key = FrameKey(**{name: getattr(row, name) for name in _KEY_NAMES})
    return FrameRow(key=key, task=row.task, metrics=row.metrics)


_KEY_NAMES = tuple(field.name for field in dataclasses.fields(FrameKey))


def _check_names(evaluation: Evaluation) -> None:
    """Refuse rows of tasks and metrics that the file does not list."""
    known = {task.name: {metric.name for metric in task.metrics} for task in evaluation.tasks}
    parts: tuple[tuple[str, Sequence[FrameRow | SummaryRow]], ...] = (("frames", evaluation.frames), ("summary", evaluation.summary))
    for part, rows in parts:
        for i, row in enumerate(rows):
            if row.task not in known:
                raise FieldError(f"{part}[{i}].task", f"one of {', '.join(known) or 'no task'} (tasks)", shorten(row.task))
            if row.metrics.keys() != known[row.task]:
                wrong = sorted(row.metrics.keys() ^ known[row.task])[0]
                got = "another metric" if wrong in row.metrics else "nothing"
                raise FieldError(f"{part}[{i}].metrics.{wrong}", f"the metrics that tasks lists of {row.task}", got)


def read_evaluation(path: Path) -> Evaluation:
    """Read the file of an evaluation.

    Raises:
        EvaluationError: it is not one; the text is one line with the file's path and that of the field.
        OSError: it cannot be read.
    """
    try:
        return evaluation_from_mapping(json.loads(read_at_most(path, MAX_BYTES, EvaluationError)))
    except FieldError as error:
        raise EvaluationError(f"{path}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise EvaluationError(f"{path}: expected an evaluation as JSON, got {error}; name a file that scene_synth evaluate wrote") from None


def write_evaluation(path: Path, evaluation: Evaluation) -> None:
    """Write the file of an evaluation; it appears under its name when it is whole."""
    text = json.dumps(evaluation_to_mapping(evaluation), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    write_whole(path, text + "\n")
