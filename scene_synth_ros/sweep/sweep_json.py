"""``sweep.json``: what a sweep says of itself beside its bags.  The sweep writes it; what judges or shows the bags reads it.  No ROS."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from scene_description import FieldError, Limits, SceneSynthError, read_at_most
from scene_description.strict import from_mapping, shorten

SWEEP_NAME, SWEEP_SCHEMA = "sweep.json", "scene_synth_sweep/1"
MAX_BYTES = 64 * 2**20


class SweepJsonError(SceneSynthError):
    """A ``sweep.json`` that cannot be used; one line with the file, the place, expected and got."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseRow:
    """The room that a variant changes; ``file`` is its description's, empty where it was sampled."""

    room_type: str
    seed: int
    index: int
    file: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class VariantRow:
    """A variant whose bag is there.

    Attributes:
        id: unique in the sweep.
        bag: its folder below that of the sweep.
        base: the room that it changes.
        factors: the value of every factor of the sweep; None where the base room has no one value.
        changed: names of the factors that differ from the base room.
        command: what makes it again.
    """

    id: Annotated[str, Limits(min_length=1, max_length=100)]
    bag: Annotated[str, Limits(min_length=1, max_length=1000)]
    base: BaseRow
    factors: Mapping[str, Any] = field(default_factory=dict)
    changed: tuple[str, ...] = ()
    command: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class FactorRow:
    """A factor: its name for people, the values of the design, what it is of; ``base`` is None where base rooms have no one value."""

    name: str
    label: str = ""
    unit: str | None = None
    attribute: str = ""
    base: Any = None
    values: tuple[Any, ...] = ()

    def row(self) -> dict[str, object]:
        """Return what ``sweep.json`` says of it."""
        return {name: getattr(self, name) for name in ("name", "label", "unit", "attribute", "base")} | {"values": list(self.values)}


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepRecord:
    """What ``sweep.json`` says; ``design`` is that of the sweep's file, empty where it says none."""

    design: str
    factors: tuple[FactorRow, ...]
    variants: tuple[VariantRow, ...]


def find_sweep(bag: Path) -> Path | None:
    """Return the ``sweep.json`` of the sweep that a bag belongs to: in the folder above it, or in that above ``variants``."""
    return next((path for path in (bag.parent / SWEEP_NAME, bag.parent.parent / SWEEP_NAME) if path.is_file()), None)


def read_sweep_json(file: Path) -> SweepRecord:
    """Read a ``sweep.json``; keys that this version does not know are left out.

    Raises:
        SweepJsonError: it is too long, no JSON, of another schema, or a row does not fit.
        OSError: it cannot be read.
    """
    try:
        document = json.loads(read_at_most(file, MAX_BYTES, SweepJsonError))
    except (ValueError, RecursionError) as error:
        raise SweepJsonError(f"{file}: expected JSON, got {' '.join(str(error).split())[:100]}; make the sweep again") from None
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SWEEP_SCHEMA:
        raise SweepJsonError(f"{file}: expected schema {SWEEP_SCHEMA}, got {schema!r:.60}; make the sweep again")
    spec = document.get("spec")
    try:
        return SweepRecord(
            design=str(spec.get("design", "")) if isinstance(spec, dict) else "",
            factors=tuple(_factor(row, f"factors[{i}]") for i, row in enumerate(_rows(document, "factors"))),
            variants=tuple(_variant(row, f"variants[{i}]") for i, row in enumerate(_rows(document, "variants"))),
        )
    except FieldError as error:
        raise SweepJsonError(f"{file}: {error}; make the sweep again") from None


def _rows(document: Mapping[str, Any], key: str) -> list[Any]:
    rows = document.get(key, [])
    if not isinstance(rows, list):
        raise FieldError(key, "a list", shorten(rows))
    return rows


def _factor(row: Any, where: str) -> FactorRow:
    data = _known_keys(FactorRow, row, where)
    values, base = data.pop("values", []), data.pop("base", None)
    if not isinstance(values, list):
        raise FieldError(f"{where}.values", "a list", shorten(values))
    factor: FactorRow = from_mapping(FactorRow, data, where)
    return replace(factor, values=tuple(values), base=base)


def _variant(row: Any, where: str) -> VariantRow:
    data = _known_keys(VariantRow, row, where)
    factors = data.pop("factors", None)
    if not isinstance(factors, dict):
        raise FieldError(f"{where}.factors", "an object", shorten(factors))
    if "base" in data:
        data["base"] = _known_keys(BaseRow, data["base"], f"{where}.base")
    variant: VariantRow = replace(from_mapping(VariantRow, data, where), factors=factors)
    bag = Path(variant.bag)
    if bag.is_absolute() or ".." in bag.parts or "/" in variant.id or variant.id in (".", ".."):
        raise FieldError(f"{where}.bag", "a bag below the sweep's folder", shorten(variant.bag))
    return variant


def _known_keys(cls: Any, row: Any, where: str) -> dict[str, Any]:
    if not isinstance(row, dict):
        raise FieldError(where, "an object", shorten(row))
    return {key: value for key, value in row.items() if key in cls.__dataclass_fields__}
