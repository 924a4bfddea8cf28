"""An evaluation as tables for a terminal: each metric a line with its confidence interval, then what is asked for beside it."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from evaluation.confidence import LEVEL, Interval
from evaluation.evaluation_file import Evaluation, FactorValue, SummaryRow, TaskRow


def table_lines(evaluation: Evaluation, by: Collection[str]) -> list[str]:
    """Return the lines of all tables.

    Args:
        evaluation: what was found.
        by: ways of the summary, room_type, class, distance or names of factors, that get a table each.
    """
    lines: list[str] = []
    for task in evaluation.tasks:
        rows = [row for row in evaluation.summary if row.task == task.name]
        for way in ["all", *dict.fromkeys(row.by for row in rows if row.by in by)]:
            lines += [*_table(task, way, [row for row in rows if row.by == way]), ""]
    return lines[:-1]


def _table(task: TaskRow, way: str, rows: Sequence[SummaryRow]) -> list[str]:
    if way == "all":
        return _whole(task, rows[0]) if rows else [f"{task.name}: no frame with an estimate"]
    head = [f"{task.name} by {way}", "rooms", "frames", *(metric.name for metric in task.metrics)]
    cells = [[_text(row.key), str(row.rooms), str(row.frames), *(_value(row.metrics[m.name]) for m in task.metrics)] for row in rows]
    return _aligned([head, *cells])


def _whole(task: TaskRow, row: SummaryRow) -> list[str]:
    head = [f"{task.name}, {_count(row.rooms, 'room')}, {_count(row.frames, 'frame')}", "value", f"{LEVEL:.0%} interval", "unit", "better"]
    cells = [[m.name, _value(row.metrics[m.name]), _ends(row.metrics[m.name]), m.unit, m.better] for m in task.metrics]
    return _aligned([head, *cells])


def _text(key: FactorValue) -> str:
    return f"{key:g}" if isinstance(key, float) else str(key)


def _value(found: Interval) -> str:
    return "-" if found.value is None else f"{found.value:.4g}"


def _ends(found: Interval) -> str:
    return "-" if found.low is None or found.high is None else f"{found.low:.4g} to {found.high:.4g}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows with columns of one width: the first on the left, the others on the right."""
    first, *rest = (max(map(len, column)) for column in zip(*rows, strict=True))
    return [
        "  ".join([row[0].ljust(first), *(cell.rjust(width) for cell, width in zip(row[1:], rest, strict=True))]).rstrip() for row in rows
    ]
