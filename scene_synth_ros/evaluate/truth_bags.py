"""The bags of truth that one evaluation judges: a single bag, the shards of a dataset, or every variant of a sweep with its factors."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scene_synth_ros.bags.dataset_files import SHARDS_NAME
from scene_synth_ros.dataset.places import shard_bags
from scene_synth_ros.evaluate.errors import EvaluateError
from scene_synth_ros.sweep.sweep_json import SWEEP_NAME, BaseRow, SweepJsonError, VariantRow, read_sweep_json

_SCALAR = (str, int, float, bool, type(None))


@dataclass(frozen=True, slots=True, kw_only=True)
class TruthBag:
    """A bag of truth.

    Attributes:
        path: of the bag.
        variant: its id in a sweep; None outside of one.
        of_several: whether it is a variant, or a shard of a dataset, whose estimates have a folder of the same name.
        base: the room that the variant changes; None outside of a sweep.
        factors: factor -> value of every factor of the sweep; lists, as of colours, as JSON text.
    """

    path: Path
    variant: str | None = None
    of_several: bool = False
    base: BaseRow | None = None
    factors: Mapping[str, Any] = field(default_factory=dict)

    def beside(self, folder: Path) -> Path:
        """Return where the estimates of this bag are below the folder of all estimates."""
        if not self.of_several:
            return folder
        above = next((folder / name for name in ("variants", SHARDS_NAME) if (folder / name).is_dir()), folder)
        return above / self.path.name


def truth_bags(path: Path, tell: Callable[[str], None]) -> list[TruthBag]:
    """Return what is to be judged: all variants of a sweep, by its folder or sweep.json, all shards of a dataset, else the bag.

    ``tell`` gets a line for everything of a dataset that is not whole.

    Raises:
        EvaluateError: a sweep.json cannot be used.
        DatasetError: there is no complete shard.
        OSError: it cannot be read.
    """
    file = path if path.name == SWEEP_NAME else path / SWEEP_NAME
    if not file.is_file():
        shards = shard_bags(path, tell)
        return [TruthBag(path=shard, of_several=True) for shard in shards] or [TruthBag(path=path)]
    try:
        variants = read_sweep_json(file).variants
    except SweepJsonError as error:
        raise EvaluateError(str(error)) from None
    if not variants:
        raise EvaluateError(f"{file}: variants: expected a list of variants, got an empty one")
    return [_truth_bag(variant, file.parent) for variant in variants]


def _truth_bag(variant: VariantRow, folder: Path) -> TruthBag:
    factors = {name: value if isinstance(value, _SCALAR) else json.dumps(value) for name, value in variant.factors.items()}
    return TruthBag(path=folder / variant.bag, variant=variant.id, of_several=True, base=variant.base, factors=factors)
