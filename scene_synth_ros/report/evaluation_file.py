"""Reads what ``scene_synth evaluate`` wrote: ``evaluation.json``, schema ``scene_synth_evaluation/1``.

Keys that a report does not need are passed over, so that a newer evaluation can be shown.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from scene_description import FieldError, SceneSynthError
from scene_description.strict import shorten

SCHEMA = "scene_synth_evaluation/1"
MAX_BYTES = 1_000_000_000
MAX_TEXT = 400

Value = float | str | bool | None
"""A value of a factor; lists and mappings are kept as their JSON text."""


class ReportError(SceneSynthError):
    """A file that no report can be made of; one line."""


class MetricRow(NamedTuple):
    """A metric: its unit ("" for none), and which values are better."""

    name: str
    unit: str
    lower_is_better: bool


class TaskRow(NamedTuple):
    """A task with its metrics; the first that frames have a value of orders the worst frames."""

    name: str
    metrics: tuple[MetricRow, ...]


class FrameRow(NamedTuple):
    """A frame's values of the metrics of a task; ``bag`` as the file has it, the stamp in nanoseconds."""

    bag: str
    variant: str | None
    room: int
    room_type: str
    seed: int
    frame: int
    stamp_ns: int
    factors: Mapping[str, Value]
    task: str
    metrics: Mapping[str, float]


class SummaryRow(NamedTuple):
    """The score of a set of frames: ``by`` is "all", "room_type", "class", "distance" or a factor; (value, low, high) of each metric."""

    task: str
    by: str
    key: Value
    metrics: Mapping[str, tuple[float, float | None, float | None]]
    rooms: int
    frames: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """An evaluation file.

    ``estimates`` is the folder of the bags of estimates, None where none were written; ``estimate_topics`` are the topics by task.
    """

    path: Path
    title: str
    algorithm: str
    command: str
    version: str
    tasks: tuple[TaskRow, ...]
    frames: tuple[FrameRow, ...]
    summary: tuple[SummaryRow, ...]
    missing: Mapping[str, int]
    estimates: str | None
    estimate_topics: Mapping[str, str]


def read_evaluation(path: Path) -> Evaluation:
    """Read and check a file.

    Raises:
        ReportError: it is no evaluation, with the place of what does not fit.
        OSError: it cannot be read.
    """
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise ReportError(f"{path}: expected at most {MAX_BYTES} bytes, got {size}; evaluate fewer frames")
    try:
        document = json.loads(path.read_bytes())
        if not isinstance(document, dict) or document.get("schema") != SCHEMA:
            got = shorten(document.get("schema", "none")) if isinstance(document, dict) else shorten(document)
            raise FieldError("schema", f"{SCHEMA!r}; give a file that scene_synth evaluate wrote", got)
        return _evaluation(path, document)
    except FieldError as error:
        raise ReportError(f"{path}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise ReportError(f"{path}: expected JSON that scene_synth evaluate wrote, got {' '.join(str(error).split())[:100]}") from None


def factor_value(value: object) -> Value:
    """Return a factor's value as a report handles it: numbers as float, names and switches as they are, all else as JSON text."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, (int, float)):
        number = float(value)
        return number if math.isfinite(number) else str(number)
    return (value if isinstance(value, str) else json.dumps(value))[:MAX_TEXT]


def _evaluation(path: Path, document: Mapping[str, Any]) -> Evaluation:
    tasks = tuple(_task(row, f"tasks.{k}") for k, row in enumerate(_take(document, "tasks", list, "")))
    names = {task.name for task in tasks}
    frames = tuple(_frames(_take(document, "frames", list, ""), names))
    estimates = document.get("estimates")
    estimates = estimates if isinstance(estimates, Mapping) else {"folder": estimates}
    folder, topics = estimates.get("folder"), estimates.get("topics")
    return Evaluation(
        path=path,
        title=_take(document, "title", str, "", path.stem)[:MAX_TEXT],
        algorithm=_take(document, "algorithm", str, "", "")[:MAX_TEXT],
        command=_take(document, "created_with", str, "", "")[:MAX_TEXT],
        version=str(document.get("version", ""))[:MAX_TEXT],
        tasks=tasks,
        frames=frames,
        summary=tuple(_summary(_take(document, "summary", list, "", []), names)),
        missing={str(key)[:MAX_TEXT]: count for key, count in _take(document, "missing", dict, "", {}).items() if isinstance(count, int)},
        estimates=folder if isinstance(folder, str) and folder else None,
        estimate_topics={str(key): str(value) for key, value in topics.items()} if isinstance(topics, Mapping) else {},
    )


def _task(row: object, path: str) -> TaskRow:
    metrics = []
    for k, metric in enumerate(_take(row, "metrics", list, path)):
        where = f"{path}.metrics.{k}"
        better = _take(metric, "better", str, where)
        if better not in ("lower", "higher"):
            raise FieldError(f"{where}.better", "'lower' or 'higher'", shorten(better))
        unit = metric.get("unit")
        metrics.append(MetricRow(_take(metric, "name", str, where), str(unit)[:40] if unit else "", better == "lower"))
    return TaskRow(_take(row, "name", str, path), tuple(metrics))


def _frames(rows: list[Any], tasks: set[str]) -> Iterator[FrameRow]:
    for k, row in enumerate(rows):
        path = f"frames.{k}"
        variant = _take(row, "variant", (str, type(None)), path, None)
        yield FrameRow(
            bag=_take(row, "bag", str, path),
            variant=variant,
            room=_take(row, "room", int, path),
            room_type=_take(row, "room_type", str, path, "")[:MAX_TEXT],
            seed=_take(row, "seed", int, path, 0),
            frame=_take(row, "frame", int, path, 0),
            stamp_ns=_take(row, "stamp_ns", int, path),
            factors={str(name): factor_value(value) for name, value in _take(row, "factors", dict, path, {}).items()},
            task=_known(row, tasks, path),
            metrics=_numbers(_take(row, "metrics", dict, path), f"{path}.metrics"),
        )


def _summary(rows: list[Any], tasks: set[str]) -> Iterator[SummaryRow]:
    for k, row in enumerate(rows):
        path, metrics = f"summary.{k}", {}
        for name, cell in _take(row, "metrics", dict, path).items():
            if isinstance(cell, Mapping):
                numbers = _numbers({key: cell.get(key) for key in ("value", "low", "high")}, f"{path}.metrics.{name}")
                if "value" in numbers:
                    metrics[name] = numbers["value"], numbers.get("low"), numbers.get("high")
        yield SummaryRow(
            task=_known(row, tasks, path),
            by=_take(row, "by", str, path),
            key=factor_value(row.get("key")),
            metrics=metrics,
            rooms=_take(row, "rooms", int, path, 0),
            frames=_take(row, "frames", int, path, 0),
        )


_MISSING = object()


def _take(row: object, key: str, kind: type | tuple[type, ...], path: str, otherwise: Any = _MISSING) -> Any:
    where = f"{path}.{key}" if path else key
    if not isinstance(row, Mapping):
        raise FieldError(path, "a mapping", shorten(row))
    value = row.get(key, otherwise)
    if value is _MISSING or (value is None and otherwise is not _MISSING and kind is not type(None)):
        if otherwise is _MISSING:
            raise FieldError(where, "a value", "nothing (the key is missing)")
        return otherwise
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is int):
        names = " or ".join(one.__name__ for one in (kind if isinstance(kind, tuple) else (kind,)))
        raise FieldError(where, f"a value of type {names}", shorten(value))
    return value


def _known(row: object, tasks: set[str], path: str) -> str:
    task: str = _take(row, "task", str, path)
    if task not in tasks:
        raise FieldError(f"{path}.task", f"one of {', '.join(sorted(tasks)) or 'no tasks'}", shorten(task))
    return task


def _numbers(cells: Mapping[str, object], path: str) -> dict[str, float]:
    numbers = {}
    for name, value in cells.items():
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise FieldError(f"{path}.{name}", "a number or null", shorten(value))
        if math.isfinite(value):
            numbers[str(name)] = float(value)
    return numbers
