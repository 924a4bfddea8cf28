"""The table of metrics that ``scene_synth sample --report`` prints, and its JSON form."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from grammar.checks.metrics import Metric, RoomMetrics, summarise


def report_text(rooms: Sequence[RoomMetrics], failures: int) -> tuple[str, bool]:
    """Return the table over at least one room, and whether every metric that has a limit keeps it."""
    metrics = summarise(rooms, failures)
    lines = [f"{'metric':24s}{'value':>12s} {'unit':5s}{'asked':10s}{'':8s}definition"]
    lines.extend(_row(metric) for metric in metrics)
    lines.extend(["", f"{'room type':16s}{'rooms':>6s}{'objects':>9s}{'p50 s':>8s}{'p99 s':>8s}{'attempts':>10s}{'R_walkable':>12s}"])
    for name, group in _by_type(rooms).items():
        row = _type_row(group)
        lines.append(
            f"{name:16s}{len(group):6d}{row['objects']:9.1f}{row['p50_s']:8.3f}{row['p99_s']:8.3f}"
            f"{row['attempts']:10.2f}{row['walkable_least']:12.3f}"
        )
    return "\n".join(lines), all(metric.passed is not False for metric in metrics)


def report_json(rooms: Sequence[RoomMetrics], errors: Sequence[str], command: Mapping[str, Any]) -> str:
    """Return the report as JSON: the command, the metrics with definitions and limits, by room type, and room by room."""
    report = {
        "command": dict(command),
        "metrics": [metric._asdict() for metric in summarise(rooms, len(errors))],
        "room_types": {name: {"rooms": len(group), **_type_row(group)} for name, group in _by_type(rooms).items()},
        "failures": list(errors),
        "rooms": [asdict(room) for room in rooms],
    }
    return json.dumps(report, indent=1) + "\n"


def _row(metric: Metric) -> str:
    verdict = {True: "ok", False: "FAILED", None: ""}[metric.passed]
    return f"{metric.name:24s}{metric.value:12.4f} {metric.unit:5s}{metric.limit:10s}{verdict:8s}{metric.definition}"


def _by_type(rooms: Sequence[RoomMetrics]) -> dict[str, list[RoomMetrics]]:
    groups: dict[str, list[RoomMetrics]] = defaultdict(list)
    for room in rooms:
        groups[room.room_type].append(room)
    return dict(sorted(groups.items()))


def _type_row(rooms: Sequence[RoomMetrics]) -> dict[str, float]:
    seconds = [room.seconds for room in rooms]
    return {
        "objects": float(np.mean([room.objects for room in rooms])),
        "p50_s": float(np.median(seconds)),
        "p99_s": float(np.quantile(seconds, 0.99)),
        "attempts": float(np.mean([room.cost.attempts for room in rooms])),
        "walkable_least": min(room.checks["walkable_share"][0] for room in rooms),
    }
