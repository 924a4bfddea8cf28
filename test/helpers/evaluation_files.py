"""Hand-made files of evaluations and sweeps, for tests of reports."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

METRICS = [{"name": "abs_rel", "unit": "", "better": "lower"}, {"name": "delta_1", "unit": "", "better": "higher"}]


def combinations(values: Mapping[str, Sequence[Any]], base: Mapping[str, Any] | None = None) -> list[dict[str, Any]]:
    """Return the factors of each variant: the full grid, or, with a base, one at a time with the base first."""
    if base is None:
        return [dict(zip(values, row, strict=True)) for row in itertools.product(*values.values())]
    return [dict(base), *({**base, name: value} for name, own in values.items() for value in own if value != base[name])]


def frame(variant: str, room: int, factors: Mapping[str, Any], metrics: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """Return a frame of an evaluation."""
    row = {"bag": f"variants/{variant}", "variant": variant, "room": room, "room_type": "bedroom", "seed": 7, "frame": 0, "stamp_ns": 5}
    return row | {"factors": dict(factors), "task": "depth", "metrics": dict(metrics)} | more


def document(frames: Iterable[Mapping[str, Any]], summary: Iterable[Mapping[str, Any]] = (), **more: Any) -> dict[str, Any]:
    """Return an evaluation of depth."""
    tasks = [{"name": "depth", "metrics": METRICS}]
    told = {"title": "SGBM", "algorithm": "sgbm.py:Stereo", "created_with": "scene_synth evaluate --algorithm sgbm.py:Stereo"}
    head = {"schema": "scene_synth_evaluation/1", **told, "tasks": tasks}
    return head | {"frames": list(frames), "summary": list(summary), "missing": {"frames without an estimate": 2}} | more


def write(path: Path, content: Mapping[str, Any]) -> Path:
    """Write a file and return its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content), encoding="utf-8")
    return path
