"""The bags of truth that one evaluation judges: a single bag, or every variant of a sweep with its factors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scene_synth_ros.evaluate.errors import EvaluateError
from scene_synth_ros.sweep.sweep_json import SWEEP_NAME, BaseRow, SweepJsonError, VariantRow, read_sweep_json

_SCALAR = (str, int, float, bool, type(None))


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
    base: BaseRow | None = None
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
    try:
        variants = read_sweep_json(file).variants
    except SweepJsonError as error:
        raise EvaluateError(str(error)) from None
    if not variants:
        raise EvaluateError(f"{file}: variants: expected a list of variants, got an empty one")
    return [_truth_bag(variant, file.parent) for variant in variants]


def _truth_bag(variant: VariantRow, folder: Path) -> TruthBag:
    factors = {name: value if isinstance(value, _SCALAR) else json.dumps(value) for name, value in variant.factors.items()}
    return TruthBag(path=folder / variant.bag, variant=variant.id, base=variant.base, factors=factors)
