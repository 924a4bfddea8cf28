"""Scores by class, distance and room type, as the evaluations tell them: bars of the page, the worst first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evaluation.evaluation_file import FactorValue
from scene_synth_ros.report.design import value_text
from scene_synth_ros.report.reactions import Part, interval

KINDS = {"class": "class", "distance": "distance", "room_type": "room type"}
"""``by`` of a summary row -> heading; distances keep the order of the file, the others are sorted."""


def breakdowns(parts: Mapping[int, Part]) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Return metric -> kind -> rows with the key's text and, by the number of the evaluation, (value, low, high, rooms, frames)."""
    found: dict[str, dict[str, dict[FactorValue, dict[str, Any]]]] = {}
    better: dict[str, bool] = {}
    for number, part in parts.items():
        better.update((metric.name, metric.better == "lower") for metric in part.task.metrics)
        for row in part.evaluation.summary:
            if row.task != part.task.name or row.by not in KINDS:
                continue
            for metric, values in row.metrics.items():
                if values.value is None:
                    continue
                rows = found.setdefault(metric, {}).setdefault(row.by, {})
                rows.setdefault(row.key, {})[str(number)] = [*interval(values), row.rooms, row.frames]
    return {
        metric: {
            kind: [
                {"key": value_text(key).replace("_", " "), "values": values}
                for key, values in sorted(rows.items(), key=lambda item: _order(kind, item, better[metric]))
            ]
            for kind, rows in kinds.items()
        }
        for metric, kinds in found.items()
        if metric in better
    }


def _order(kind: str, item: tuple[FactorValue, dict[str, Any]], lower_is_better: bool) -> tuple[float, str]:
    key, values = item
    if kind == "distance":
        return 0.0, ""
    worst = next(iter(values.values()))[0]
    return (-worst if lower_is_better else worst), value_text(key)
