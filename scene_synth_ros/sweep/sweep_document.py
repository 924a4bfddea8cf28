"""What a sweep says of itself: ``sweep.json`` for programs, a table for people."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from scene_synth_ros.dataset.file_names import SWEEP_SCHEMA
from scene_synth_ros.sweep.variant import SweepPlan


def sweep_document(plan: SweepPlan, done: Sequence[str], refused: Mapping[str, str]) -> dict[str, Any]:
    """Return ``sweep.json``: factors, the variants whose bags are there, those that were refused and why, and those that are missing.

    Args:
        plan: of the sweep.
        done: ids of variants whose bags are whole.
        refused: id -> why the variant cannot be.
    """
    rows = {variant.id: variant.row() for variant in plan.variants}
    return {
        "schema": SWEEP_SCHEMA,
        "spec": dict(plan.spec.data),
        "factors": [factor.row() for factor in plan.factors],
        "variants": [rows[name] for name in rows if name in done],
        "refused": [{**_without(rows[name], "bag"), "reason": refused[name]} for name in rows if name in refused],
        "missing": [name for name in rows if name not in done and name not in refused],
    }


def plan_table(plan: SweepPlan) -> str:
    """Return the variants as a table; values that differ from the base room are marked with a star."""
    head = ["id", "room type", "seed", "index", *(factor.name for factor in plan.factors)]
    rows = [head]
    for variant in plan.variants:
        scene = variant.base.scene
        values = (f"{short(value)}{'*' if name in variant.changed else ''}" for name, value in variant.factors.items())
        rows.append([variant.id, scene.category, str(scene.seed), str(scene.index), *values])
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    return "".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() + "\n" for row in rows)


def short(value: object) -> str:
    """Return a value of a factor in few characters."""
    if value is None:
        return "-"
    return f"{value:g}" if isinstance(value, float) else value if isinstance(value, str) else json.dumps(value)


def _without(row: Mapping[str, object], key: str) -> dict[str, object]:
    return {name: value for name, value in row.items() if name != key}
