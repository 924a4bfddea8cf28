"""An evaluation as CSV for spreadsheets."""

import csv
import io
from collections.abc import Sequence

from evaluation.evaluation_file import Evaluation, FactorValue


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
