"""The bag of one variant: made of its base room, and known again."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from grammar.counterfactual import apply_change
from renderer.film.tone import Exposure
from scene_description import SceneSynthError, error_line
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.offline_renderer import meter_room
from scene_synth_ros.offline.rules import rules_of
from scene_synth_ros.sweep.sweep_file import SweepError
from scene_synth_ros.sweep.variant import RECORD_NAME, BaseRoom, Variant


class Made(NamedTuple):
    """What became of a variant: how many frames it has, or why it cannot be."""

    id: str
    frames: int
    refused: str


def make_variant(variant: Variant, folder: Path, exposure: str) -> Made:
    """Write the bag of a variant below the folder of its sweep.

    The same random numbers, frame indices and stamps as of the base room; its exposure too, if that is ``held``.

    Args:
        variant: what to make.
        folder: of the sweep.
        exposure: ``held`` or ``metered``.

    Raises:
        BagWriteError: the bag cannot be written.
        SweepError: something else is where it shall be.
    """
    bag = folder / variant.bag
    remove_stale(bag)
    rules = rules_of(variant.base.settings)
    metered: Callable[[str], Exposure] | None = (lambda renderer: _held_exposure(variant.base, renderer)) if exposure == "held" else None
    try:
        scene = variant.base.scene
        for change in variant.changes:
            scene = apply_change(scene, change, rules)
        with OfflineBag(bag, variant.settings, rules.floor_map, {RECORD_NAME: variant.record(exposure)}) as writer:
            writer.add_room(scene, metered)
    except BagWriteError:
        raise
    except SceneSynthError as error:
        return Made(variant.id, 0, error_line(error))
    return Made(variant.id, len(scene.camera_path), "")


def is_done(variant: Variant, folder: Path, exposure: str) -> bool:
    """Return whether a variant's bag is there, whole, and records what the plan says; the command that made it does not matter."""
    try:
        with BagReader(folder / variant.bag) as reader:
            summary = reader.summary
    except (BagReadError, OSError):
        return False
    record = summary.records.get(RECORD_NAME, {})
    return summary.finished and not summary.faults and _compared(record) == _compared(variant.record(exposure))


def remove_stale(bag: Path) -> None:
    """Remove the bag of a variant that is not what the plan says.

    Raises:
        SweepError: there is something that is no bag.
    """
    if not bag.exists():
        return
    strangers = [file.name for file in bag.iterdir() if ".mcap" not in file.name and not file.name.startswith("metadata.yaml")]
    if strangers:
        raise SweepError(f"{bag}: expected a bag of this sweep, got a folder that holds {strangers[0]}; choose another --out")
    shutil.rmtree(bag)


_held: dict[str, Exposure] = {}
"""Exposures of the base room at work, as they are metered, by its records and renderer."""


def _held_exposure(base: BaseRoom, renderer: str) -> Exposure:
    key = json.dumps([base.said, base.scene.id, renderer])
    if key not in _held:
        if len(_held) > 16:
            _held.clear()
        _held[key] = meter_room(base.scene, base.settings.renderers[renderer])
    return _held[key]


def _compared(record: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in record.items() if name != "command"}
