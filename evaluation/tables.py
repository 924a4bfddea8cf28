"""An evaluation as plain text for a terminal, and as CSV for spreadsheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from evaluation.confidence import Interval
from evaluation.evaluation_file import Evaluation, FactorValue, SummaryRow, TaskRow


def summary_table(evaluation: Evaluation) -> str:
    """Return the summary as text: a block for each task, a line for each group of frames, a column for each metric.

    Values are those over the group; in the line of all frames the ends of the confidence interval follow in brackets.
    """
    blocks = []
    for task in evaluation.tasks:
        rows = [row for row in evaluation.summary if row.task == task.name]
        names = [f"{metric.name} [{metric.unit}]" if metric.unit else metric.name for metric in task.metrics]
        lines = [[task.name, "rooms", "frames", *names]]
        lines += [_line(task, row) for row in rows]
        blocks.append(_aligned(lines) if rows else f"{task.name}: no frame with an estimate")
    blocks += [f"{what}: {count}" for what, count in evaluation.missing.items() if count]
    return "\n\n".join(blocks) + "\n"


def _line(task: TaskRow, row: SummaryRow) -> list[str]:
    name = "all" if row.by == "all" else f"{row.by} {_text(row.key)}"
    values = [_value(row.metrics[metric.name], interval=row.by == "all") for metric in task.metrics]
    return [name, str(row.rooms), str(row.frames), *values]


def _value(found: Interval, *, interval: bool) -> str:
    if found.value is None:
        return "-"
    ends = f" [{found.low:.4g}, {found.high:.4g}]" if interval and found.low is not None and found.high is not None else ""
    return f"{found.value:.4g}{ends}"


def _text(key: FactorValue) -> str:
    return f"{key:g}" if isinstance(key, float) else str(key)


def _aligned(lines: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    first, *rest = widths
    return "\n".join(
        "  ".join([line[0].ljust(first), *(cell.rjust(width) for cell, width in zip(line[1:], rest, strict=True))]) for line in lines
    )


def frames_csv(evaluation: Evaluation) -> str:
    """Return one line for each metric of each frame: bag, variant, room, ..., one column for each factor, task, metric, value.

    A value that is undefined, or of which there was no estimate, is empty.
    """
    factors = list(dict.fromkeys(name for row in evaluation.frames for name in row.key.factors))
    keys = ("bag", "variant", "room", "room_type", "seed", "frame", "stamp_ns")
    lines = [[*keys, *factors, "task", "metric", "value"]]
    for row in evaluation.frames:
        place = [_cell(getattr(row.key, name)) for name in keys] + [_cell(row.key.factors.get(name)) for name in factors]
        lines += [[*place, row.task, name, _cell(value)] for name, value in row.metrics.items()]
    return _csv(lines)


def summary_csv(evaluation: Evaluation) -> str:
    """Return one line for each metric of each group of frames: task, by, key, rooms, frames, metric, unit, value, low, high."""
    units = {(task.name, metric.name): metric.unit for task in evaluation.tasks for metric in task.metrics}
    lines = [["task", "by", "key", "rooms", "frames", "metric", "unit", "value", "low", "high"]]
    for row in evaluation.summary:
        place = [row.task, row.by, _cell(row.key), str(row.rooms), str(row.frames)]
        for name, found in row.metrics.items():
            lines.append([*place, name, units[row.task, name], _cell(found.value), _cell(found.low), _cell(found.high)])
    return _csv(lines)


def _cell(value: FactorValue) -> str:
    return "" if value is None else str(value)


def _csv(lines: Sequence[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(lines)
    return text.getvalue()
