"""Chooses what is converted: the layers that play the roles of a format, cameras, rooms, every n-th frame."""

from collections.abc import Iterator, Mapping
from collections.abc import Sequence as Items
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from renderer import LAYERS
from scene_synth_ros.convert.formats import Format
from scene_synth_ros.convert.writer import ConvertError, Role, Sequence, Source
from scene_synth_ros.dataset import Dataset, open_dataset


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What the options ask for.

    Attributes:
        layers: by name; empty: those that a format takes by itself.
        rooms: indices from the first to before the second; None for all.
        every: the first frame of each sequence and every n-th after it.
        camera: its name; empty for all.
        split: name of a split of the dataset.
        catalog: folder of the user's models.
    """

    layers: tuple[str, ...] = ()
    rooms: tuple[int, int] | None = None
    every: int = 1
    camera: str = ""
    split: str | None = None
    catalog: Path | None = None


class Chosen(NamedTuple):
    """Role -> layer, and the layers beside the roles."""

    roles: dict[str, str]
    beside: tuple[str, ...]

    @property
    def layers(self) -> tuple[str, ...]:
        """All of them."""
        return (*self.roles.values(), *self.beside)


def open_source(place: str, name: str, form: Format, choice: Choice) -> Source:
    """Open what is converted.

    ``place``: path or URL of a bag, a folder of bags or a dataset.

    Raises:
        ConvertError: a layer is not recorded, the format has no place for one, or no frame is left.
        DatasetError: the source cannot be read.
    """
    whole = open_dataset(place, None, camera=choice.camera or None)
    cameras = (whole.camera,) if choice.camera else whole.cameras
    recorded = {camera: open_dataset(place, None, camera=camera).layers for camera in cameras}
    chosen, left_out = choose_cameras(name, form, recorded, choice.layers, place)
    data = {camera: open_dataset(place, layers=it.layers, split=choice.split, camera=camera) for camera, it in chosen.items()}
    first = next(iter(chosen.values()))
    return Source(
        data=data,
        name=place,
        sequences=choose_frames(data, choice, place),
        roles=first.roles,
        layers=first.beside,
        split=choice.split,
        catalog=choice.catalog,
        notes=(*dict.fromkeys(note for frames in data.values() for note in frames.notes), *left_out),
    )


def choose_cameras(
    name: str, form: Format, recorded: Mapping[str, Items[str]], asked: Items[str], source: str
) -> tuple[dict[str, Chosen], tuple[str, ...]]:
    """Return the cameras that have what a format needs, each with the same layers, and lines about the others.

    What a format takes of the first camera alone the others need not have.

    ``recorded``: camera -> its layers.

    Raises:
        ConvertError: no camera has it.
    """
    found: dict[str, Chosen] = {}
    refused: dict[str, ConvertError] = {}
    own = {layer for role in form.roles if role.first_only for layer in role.layers}
    shared = form._replace(roles=tuple(role for role in form.roles if not role.first_only))
    for camera, layers in recorded.items():
        wanted = (shared, [layer for layer in asked if layer not in own]) if found else (form, asked)
        try:
            found[camera] = choose_layers(name, wanted[0], layers, wanted[1], source)
        except ConvertError as error:
            refused[camera] = error
    if not found:
        raise next(iter(refused.values()), ConvertError(f"{source}: expected images of a camera, got none"))
    first = next(iter(found.values()))
    common = Chosen({role: layer for role, layer in first.roles.items() if layer not in own}, first.beside)
    for camera in [camera for camera, it in found.items() if it not in (first, common)]:
        missing = ", ".join(sorted(set(first.layers) ^ set(found.pop(camera).layers)))
        refused[camera] = ConvertError(f"{source}: the cameras differ in {missing}")
    return found, tuple(f"camera {camera} is left out: {error}" for camera, error in refused.items())


def choose_layers(name: str, form: Format, recorded: Items[str], asked: Items[str], source: str) -> Chosen:
    """Return the layers for a format; a layer that is asked for and can play a role does so in place of the usual one.

    Raises:
        ConvertError: a layer is not recorded, or the format has no place for it.
    """
    roles: dict[str, str] = {}
    for role in form.roles:
        wanted = [layer for layer in role.layers if layer in asked] or [layer for layer in role.layers if layer in recorded]
        if wanted:
            roles[role.name] = _recorded(wanted[0], recorded, source, name)
        elif role.required and "range" in recorded and "depth" in role.layers:
            raise ConvertError(f"{source}: {name} needs depth, got range alone, as of a panorama; choose --to nerfstudio or coco")
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
    return Chosen(roles, beside)


def choose_frames(data: Mapping[str, Dataset], choice: Choice, source: str) -> tuple[Sequence, ...]:
    """Return the sequences that are converted, by room, then camera.

    Raises:
        ConvertError: nothing is left.
    """
    found: dict[tuple[int, int], dict[str, tuple[int, ...]]] = {}
    for camera, frames in data.items():
        times: dict[int, int] = {}
        for room, indices in _rooms(frames):
            times[room] = times.get(room, 0) + 1
            if choice.rooms is None or choice.rooms[0] <= room < choice.rooms[1]:
                found.setdefault((room, times[room]), {})[camera] = indices[:: choice.every]
    if not found:
        asked = "none" if choice.rooms is None else f"none in rooms {choice.rooms[0]} to {choice.rooms[1] - 1}"
        raise ConvertError(f"{source}: expected frames with all layers of the format, got {asked}; see scene_synth inspect")
    names = _camera_names(list(data))
    return tuple(
        Sequence(
            folder=room_name(room, again),
            name=room_name(room, again) + (f"_{names[camera]}" if len(data) > 1 else ""),
            room=room,
            camera=camera,
            place=place,
            cameras=len(cameras),
            frames=frames,
        )
        for (room, again), cameras in sorted(found.items())
        for place, (camera, frames) in enumerate(cameras.items())
    )


def _rooms(frames: Dataset) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Yield the index of each room with its frames."""
    rooms = [info.index for info in frames.rooms]
    if len(set(rooms)) == len(rooms):
        yield from ((room, tuple(indices)) for room in rooms if len(indices := frames.frames_of(room)))
    else:
        for info, run in groupby(range(len(frames)), lambda index: frames.frame(index).info):
            yield info.index, tuple(run)


def room_name(room: int, again: int = 1) -> str:
    """Return the name of a room; ``again``: how often its index has come."""
    return f"room_{room:04d}" + (f"_{again}" if again > 1 else "")


def _camera_names(cameras: Items[str]) -> dict[str, str]:
    """Return camera -> its name without its namespace, with it where another is called the same, with a number where those are equal."""
    short = [camera.rpartition("/")[2] for camera in cameras]
    names = short if len(set(short)) == len(short) else [camera.strip("/").replace("/", "_") for camera in cameras]
    unique = names if len(set(names)) == len(names) else [f"{name}_{place}" for place, name in enumerate(names)]
    return dict(zip(cameras, unique, strict=True))


def _recorded(layer: str, recorded: Items[str], source: str, name: str) -> str:
    if layer not in recorded:
        raise _missing(Role(layer, (layer,)), source, name)
    return layer


def _missing(role: Role, source: str, name: str) -> ConvertError:
    layer = role.layers[0]
    if layer not in LAYERS:
        return ConvertError(f"--layers {layer}: expected layers as scene_synth layers lists them")
    kinds = " or ".join(role.layers)
    return ConvertError(f"{source}: {name} needs {kinds}, which is not recorded; record it: -p renderer_node.streams.{layer}:=true")
