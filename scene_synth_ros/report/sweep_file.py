"""What ``sweep.json`` beside the bags says: the design, the factors, and the command that makes each variant again."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from evaluation.evaluation_file import FactorValue
from scene_description import SceneSynthError, read_at_most
from scene_synth_ros.sweep.sweep_json import MAX_BYTES, SWEEP_SCHEMA

DESIGNS = ("one_at_a_time", "grid", "latin_hypercube")
AS_IT_IS = "as it is"
"""Stands for the value of a factor in a base room, where base rooms differ in it."""
MAX_TEXT, MAX_COMMAND = 400, 4000


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepFactor:
    """A factor: its name for people, its unit ("" for none), its values in their order, its base (None where there is none)."""

    label: str
    unit: str
    values: tuple[FactorValue, ...]
    base: FactorValue


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """A sweep: ``design`` is one of ``DESIGNS`` or empty.

    ``commands``, ``bases`` (room type, seed, index) and ``changed``, the factors that are not as in the base room, are of its variants,
    by their ids.
    """

    design: str = ""
    factors: Mapping[str, SweepFactor] = field(default_factory=dict)
    commands: Mapping[str, str] = field(default_factory=dict)
    bases: Mapping[str, tuple[str, int, int]] = field(default_factory=dict)
    changed: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def factors_of(self, variant: str, factors: Mapping[str, FactorValue]) -> dict[str, FactorValue]:
        """Return a variant's factors, with ``AS_IT_IS`` for those that are left as they are in a base room of its own value."""
        changed = self.changed.get(variant, factors.keys())
        return {name: value if name in changed else self._base(name, value) for name, value in factors.items()}

    def _base(self, name: str, value: FactorValue) -> FactorValue:
        if name not in self.factors:
            return value
        base = self.factors[name].base
        return AS_IT_IS if base is None else base


def factor_value(value: object) -> FactorValue:
    """Return a factor's value as an evaluation has it; lists and mappings as their JSON text."""
    if value is None or isinstance(value, (bool, int, float)):
        return value
    return (value if isinstance(value, str) else json.dumps(value))[:MAX_TEXT]


def read_sweep(path: Path) -> tuple[Sweep, str]:
    """Return what the file says, and a line for people where it cannot be used, else an empty one."""
    try:
        document = json.loads(read_at_most(path, MAX_BYTES, SceneSynthError))
        if not isinstance(document, dict) or document.get("schema") != SWEEP_SCHEMA:
            return Sweep(), f"{path.name}: expected schema {SWEEP_SCHEMA!r}; labels and commands of the variants are missing"
        design = json.dumps(document.get("spec", {}).get("design", ""))
        variants = [row for row in document.get("variants", ()) if isinstance(row.get("id"), str)]
        return Sweep(
            design=next((name for name in DESIGNS if name in design), ""),
            factors={str(row["name"]): _factor(row) for row in document.get("factors", ())},
            commands={row["id"]: str(row["command"])[:MAX_COMMAND] for row in variants if row.get("command")},
            changed={row["id"]: frozenset(map(str, row["changed"])) for row in variants if "changed" in row},
            bases={row["id"]: _base(row["base"]) for row in variants if row.get("base")},
        ), ""
    except (SceneSynthError, OSError, ValueError, KeyError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        reason = " ".join(str(error).split())[:100]
        return Sweep(), f"{path.name}: cannot be read ({reason}); labels and commands of the variants are missing"


def _factor(row: Mapping[str, Any]) -> SweepFactor:
    return SweepFactor(
        label=str(row.get("label") or row["name"])[:MAX_TEXT],
        unit=str(row.get("unit") or "")[:40],
        values=tuple(factor_value(value) for value in row.get("values", ())),
        base=factor_value(row.get("base")),
    )


def _base(row: Mapping[str, Any]) -> tuple[str, int, int]:
    return str(row.get("room_type", "")), int(row.get("seed", 0)), int(row.get("index", 0))
