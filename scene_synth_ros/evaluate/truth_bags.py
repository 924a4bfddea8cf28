"""The bags of truth that one evaluation judges: a single bag, or every variant of a sweep with its factors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scene_description.strict import FieldError, from_mapping
from scene_synth_ros.dataset.file_names import SWEEP_NAME, SWEEP_SCHEMA
from scene_synth_ros.evaluate.errors import EvaluateError

_MAX_SIZE = 64 * 2**20
_OF_BASE = ("room_type", "seed", "index")
_SCALAR = (str, int, float, bool, type(None))


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseRoom:
    """The room that a variant changes."""

    room_type: str
    seed: int
    index: int


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthBag:
    """A bag of truth.

    Attributes:
        path: of the bag.
        variant: its id in a sweep; None outside of one.
        base: the room that the variant changes; None outside of a sweep.
        factors: factor -> value of every factor of the sweep; lists, as of colours, as JSON text.
    """

    path: Path
    variant: str | None = None
    base: BaseRoom | None = None
    factors: Mapping[str, Any] = field(default_factory=dict)

    def beside(self, folder: Path) -> Path:
        """Return where the estimates of this bag are below the folder of all estimates."""
        if self.variant is None:
            return folder
        return folder / "variants" / self.variant if (folder / "variants").is_dir() else folder / self.variant


def truth_bags(path: Path) -> list[TruthBag]:
    """Return what is to be judged: all variants if ``path`` is the folder of a sweep or its sweep.json, else the bag.

    Raises:
        EvaluateError: a sweep.json cannot be used.
        OSError: it cannot be read.
    """
    file = path if path.name == SWEEP_NAME else path / SWEEP_NAME
    if not file.is_file():
        return [TruthBag(path=path)]
    return [_variant(row, number, file) for number, row in enumerate(_variants(file))]


def _variants(file: Path) -> list[Any]:
    if file.stat().st_size > _MAX_SIZE:
        raise EvaluateError(f"{file}: expected at most {_MAX_SIZE} bytes, got {file.stat().st_size}")
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise EvaluateError(f"{file}: expected JSON, got {' '.join(str(error).split())[:100]}; make the sweep again") from None
    schema = found.get("schema") if isinstance(found, dict) else None
    if schema != SWEEP_SCHEMA:
        raise EvaluateError(f"{file}: expected schema {SWEEP_SCHEMA}, got {schema!r:.60}; make the sweep again")
    variants = found.get("variants")
    if not isinstance(variants, list) or not variants:
        raise EvaluateError(f"{file}: variants: expected a list of variants, got {'an empty one' if variants == [] else 'none'}")
    return variants


def _variant(row: Any, number: int, file: Path) -> TruthBag:
    where = f"{file}: variants[{number}]"
    if not isinstance(row, dict) or not all(isinstance(row.get(key), str) for key in ("id", "bag")):
        raise EvaluateError(f"{where}: expected id and bag as text; make the sweep again")
    bag, factors = Path(row["bag"]), row.get("factors")
    if bag.is_absolute() or ".." in bag.parts or "/" in row["id"] or row["id"] in ("", ".", ".."):
        raise EvaluateError(f"{where}: expected a bag below the sweep's folder, got {row['bag'][:100]!r}")
    if not isinstance(factors, dict):
        raise EvaluateError(f"{where}: expected factors as an object; make the sweep again")
    try:
        told = row.get("base")
        base = from_mapping(BaseRoom, {key: told[key] for key in _OF_BASE if key in told} if isinstance(told, dict) else told, "base")
    except FieldError as error:
        raise EvaluateError(f"{where}.{error}") from None
    values = {name: value if isinstance(value, _SCALAR) else json.dumps(value) for name, value in factors.items()}
    return TruthBag(path=file.parent / bag, variant=row["id"], base=base, factors=values)
