"""Chooses what of a dataset is converted: layers for the roles of a format, rooms, a camera, every n-th frame."""

from __future__ import annotations

import re
from collections.abc import Sequence as Items
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from renderer import LAYERS
from scene_synth_ros.convert.errors import ConvertError
from scene_synth_ros.convert.formats import Format
from scene_synth_ros.convert.writer import Role, Sequence, Source

if TYPE_CHECKING:
    from scene_synth_ros.dataset import Dataset


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What the options ask for.

    Attributes:
        layers: by name; empty: those that a format takes by itself.
        rooms: indices from the first to before the second; None for all.
        every: the first frame of each sequence and every n-th after it.
        catalog: folder of the user's models.
        split: name of the split that the dataset was opened with.
    """

    layers: tuple[str, ...] = ()
    rooms: tuple[int, int] | None = None
    every: int = 1
    catalog: Path | None = None
    split: str | None = None


def choose_layers(name: str, form: Format, recorded: Items[str], asked: Items[str], source: str) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return role -> layer, and the layers beside the roles.

    Args:
        name: of the format.
        form: its row.
        recorded: the layers of the source.
        asked: for, by name; a layer that can play a role does so in place of the usual one.
        source: name of the source, for messages.

    Raises:
        ConvertError: a layer is not recorded, or the format has no place for it.
    """
    roles: dict[str, str] = {}
    for role in form.roles:
        wanted = [layer for layer in role.layers if layer in asked] or [layer for layer in role.layers if layer in recorded]
        if wanted:
            roles[role.name] = _recorded(wanted[0], recorded, source, name)
        elif role.required:
            raise _missing(role, source, name)
    beside = tuple(layer for layer in asked if layer not in roles.values())
    for layer in beside:
        if not form.any_layer:
            known = [layer for role in form.roles for layer in role.layers]
            raise ConvertError(f"--layers {layer}: {name} has no place for it; expected some of {', '.join(known)}, one for each role")
        _recorded(layer, recorded, source, name)
    if form.any_layer and form.unasked and not asked:
        beside = tuple(layer for layer in recorded if layer not in roles.values())
    return roles, beside


def choose_frames(data: Dataset, choice: Choice, source: str) -> tuple[Sequence, ...]:
    """Return the sequences that are converted, by room, then camera.

    Raises:
        ConvertError: nothing is left.
    """
    found: dict[tuple[int, str], list[int]] = {}
    for number, (room, camera, _) in enumerate(data.index):
        if choice.rooms is None or choice.rooms[0] <= room < choice.rooms[1]:
            found.setdefault((room, camera), []).append(number)
    if not found:
        asked = "no room" if choice.rooms is None else f"none of rooms {choice.rooms[0]} to {choice.rooms[1] - 1}"
        raise ConvertError(f"{source}: expected frames, got {asked}; see what is there: scene_synth inspect")
    several = len({camera for _, camera in found}) > 1
    return tuple(
        Sequence(name=sequence_name(room, camera if several else ""), room=room, camera=camera, frames=tuple(frames[:: choice.every]))
        for (room, camera), frames in sorted(found.items())
    )


def sequence_name(room: int, camera: str) -> str:
    """Return the name of a sequence; ``camera`` is empty where there is one."""
    return f"room_{room:04d}" + (f"_{re.sub(r'[^A-Za-z0-9_.-]', '_', camera)}" if camera else "")


def choose(data: Dataset, name: str, form: Format, choice: Choice, source: str) -> Source:
    """Return what is converted of a dataset.

    Raises:
        ConvertError: a layer is not recorded, the format has no place for one, or no frame is left.
    """
    roles, beside = choose_layers(name, form, tuple(data.layers), choice.layers, source)
    sequences = choose_frames(data, choice, source)
    return Source(data=data, name=source, sequences=sequences, roles=roles, layers=beside, split=choice.split, catalog=choice.catalog)


def _recorded(layer: str, recorded: Items[str], source: str, name: str) -> str:
    if layer not in recorded:
        raise _missing(Role(layer, (layer,)), source, name)
    return layer


def _missing(role: Role, source: str, name: str) -> ConvertError:
    layer = role.layers[0]
    if layer not in LAYERS:
        return ConvertError(f"--layers {layer}: expected layers as of scene_synth layers")
    kinds = " or ".join(role.layers)
    return ConvertError(f"{source}: {name} needs {kinds}, which is not recorded; record it: -p renderer_node.streams.{layer}:=true")
