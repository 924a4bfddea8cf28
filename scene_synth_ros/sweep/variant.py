"""What a sweep makes: variants of base rooms, and what is said of them in files."""

import hashlib
import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from grammar.counterfactual import Change
from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.suite.parameters import parameter_values
from scene_synth_ros.sweep.sweep_file import SweepSpec
from scene_synth_ros.sweep.sweep_json import SWEEP_SCHEMA, FactorRow

VARIANT_SCHEMA = "scene_synth_variant/1"
RECORD_NAME = "scene_synth_variant"
"""Metadata record of a variant's bag."""


class BaseRoom(NamedTuple):
    """A room that variants are made of, with the parameters of its run; ``file`` is its description's, empty where it was sampled."""

    scene: SceneDescription
    settings: OfflineSettings
    file: str = ""

    @property
    def said(self) -> dict[str, object]:
        """What is said of it in files: room type, seed, index."""
        told: dict[str, object] = {"room_type": self.scene.category, "seed": self.scene.seed, "index": self.scene.index}
        return told | ({"file": self.file} if self.file else {})


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """A bag to be made.

    Attributes:
        id: four digits or more, unique in the sweep.
        base: the room that it is a variant of.
        factors: the value of every factor of the sweep; None where the base room has no one value.
        changed: names of the factors that differ from the base room.
        changes: of the scene, in their order.
        settings: of its run.
        file: of the sweep, as the user has named it.
    """

    id: str
    base: BaseRoom
    factors: Mapping[str, object]
    changed: tuple[str, ...]
    changes: tuple[Change, ...]
    settings: OfflineSettings
    file: str

    def command(self, file: str) -> str:
        """Return the command that makes the variant again, by a name of the sweep's file."""
        return shlex.join(["scene_synth", "sweep", file, "--only", self.id, "--out", f"sweep_{self.id}"])

    @property
    def bag(self) -> str:
        """Where it lies below the folder of the sweep."""
        return f"variants/{self.id}"

    def row(self) -> dict[str, object]:
        """Return what ``sweep.json`` says of it."""
        row: dict[str, object] = {"id": self.id, "bag": self.bag, "base": self.base.said, "factors": dict(self.factors)}
        return row | {"changed": list(self.changed), "command": self.command(self.file)}

    def record(self, exposure: str) -> dict[str, str]:
        """Return what its bag records of it: texts, JSON but for the id, the command and digests (SHA-256) of base room and parameters.

        The command names the file without its folder, so that bags do not depend on where that is.
        """
        changes = [{"factor": c.factor, "target": dict(c.target), "value": c.value, "seed": c.seed} for c in self.changes]
        parameters = self.settings.nodes | {"recorder": parameter_values(self.settings.recorder)}
        told = {"schema": VARIANT_SCHEMA, "base": self.base.said, "factors": dict(self.factors), "changed": list(self.changed)}
        texts = {name: json.dumps(value) for name, value in (told | {"changes": changes, "exposure": exposure}).items()}
        scene = hashlib.sha256(scene_to_json(self.base.scene).encode()).hexdigest()
        run = hashlib.sha256(json.dumps(parameters, sort_keys=True).encode()).hexdigest()
        return {"id": self.id, **texts, "base_sha256": scene, "parameters_sha256": run, "command": self.command(Path(self.file).name)}


class SweepPlan(NamedTuple):
    """Everything that a sweep will make."""

    spec: SweepSpec
    factors: tuple[FactorRow, ...]
    variants: tuple[Variant, ...]


def sweep_document(plan: SweepPlan, done: Sequence[str], refused: Mapping[str, str]) -> dict[str, Any]:
    """Return ``sweep.json``: factors, the variants whose bags are there, those that were refused and why, and those that are missing.

    ``refused``: id -> why the variant cannot be.
    """
    rows = {variant.id: variant.row() for variant in plan.variants}
    return {
        "schema": SWEEP_SCHEMA,
        "spec": dict(plan.spec.data),
        "factors": [factor.row() for factor in plan.factors],
        "variants": [rows[name] for name in rows if name in done],
        "refused": [
            {**{key: value for key, value in row.items() if key != "bag"}, "reason": refused[name]}
            for name, row in rows.items()
            if name in refused
        ],
        "missing": [name for name in rows if name not in done and name not in refused],
    }
