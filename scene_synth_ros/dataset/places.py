"""What lies at a path: a bag, a file of one, a folder of bags, or a dataset whose shards say what is in them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from scene_description import SceneSynthError
from scene_description.strict import FieldError, from_mapping
from scene_synth_ros.bags.dataset_files import (
    DATASET_MANIFEST_NAME,
    DATASET_MANIFEST_SCHEMA,
    PLAN_NAME,
    SHARD_SCHEMA,
    SHARDS_NAME,
    shard_name,
)
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.folders import Folder
from scene_synth_ros.dataset.rooms import RoomInfo
from scene_synth_ros.mcap.stored_file import StoredFile

_ENDINGS = (".mcap", ".mcap.active")
_MAX_SHARD = 2**30


@dataclass(frozen=True, slots=True, kw_only=True)
class BagPlace:
    """Where a bag of a dataset is: its name, its files in their order, its rooms where a shard says them."""

    name: str
    files: tuple[StoredFile, ...]
    rooms: tuple[RoomInfo, ...] | None = None


def find_bags(folder: Folder, report: Callable[[str], None]) -> list[BagPlace]:
    """Return the bags at a place in the order of their names, shards in the order of their numbers.

    Args:
        folder: the place, a folder or a single file.
        report: called with one line for everything that is not whole.

    Raises:
        DatasetError: there is nothing to read.
        OSError: it cannot be read.
    """
    if folder.name.endswith(_ENDINGS) and folder.is_file():
        return [BagPlace(name=str(folder), files=(folder.file(""),))]
    names = folder.names()
    if names is None:
        got = "a file of another kind" if folder.is_file() else "nothing there"
        raise DatasetError(f"{folder}: expected a bag, the folder of a dataset, or an .mcap file, got {got}; check the path")
    if any(name.endswith(_ENDINGS) for name in names):
        return [_bag(folder, names, report)]
    if PLAN_NAME in names or DATASET_MANIFEST_NAME in names or SHARDS_NAME in names:
        return _shards(folder, names, report)
    bags = [(child, inner) for name in sorted(names) for child in [folder / name] if (inner := child.names()) is not None]
    found = [_bag(child, inner, report) for child, inner in bags if any(name.endswith(_ENDINGS) for name in inner)]
    if not found:
        raise DatasetError(
            f"{folder}: expected a bag, bags in folders, or a dataset, got {', '.join(sorted(names)[:5]) or 'an empty folder'}"
        )
    return found


def _bag(folder: Folder, names: list[str], report: Callable[[str], None]) -> BagPlace:
    files = _in_order(names)
    for name in files:
        if name.endswith(_ENDINGS[1]):
            report(f"{folder / name}: unfinished, its recorder was not closed; read as far as it goes")
    return BagPlace(name=str(folder), files=tuple(folder.file(name) for name in files))


def _in_order(names: Iterable[str]) -> list[str]:
    """Return the names of MCAP files in the order in which a recorder numbers them."""
    return sorted((name for name in names if name.endswith(_ENDINGS)), key=lambda name: (len(name), name))


def _shards(folder: Folder, names: list[str], report: Callable[[str], None]) -> list[BagPlace]:
    """Return the shards that are complete, by the manifest where there is one, else by their completion files."""
    below = folder / SHARDS_NAME if SHARDS_NAME in names else folder
    if DATASET_MANIFEST_NAME in names:
        manifest = read_json(folder.file(DATASET_MANIFEST_NAME), DATASET_MANIFEST_SCHEMA)
        rows = manifest.get("shards")
        where = str(folder / DATASET_MANIFEST_NAME)
    else:
        inside = below.names() or []
        told = sorted(name for name in inside if name.removesuffix(".json").isdecimal() and name.endswith(".json"))
        rows = [read_json(below.file(name), SHARD_SCHEMA) for name in told]
        where = str(below)
        planned = _planned(folder, names)
        if planned is not None and len(rows) < planned:
            report(
                f"{folder}: {len(rows)} of {planned} shards are complete; the others are left out, scene_synth generate --resume makes them"
            )
    if not isinstance(rows, list) or not rows:
        raise DatasetError(f"{where}: expected complete shards, got none; let scene_synth generate finish one")
    found = [_shard(below, row, f"{where}: shards[{number}]") for number, row in enumerate(rows)]
    if not any(bag.files for bag in found):
        raise DatasetError(f"{where}: expected a shard with rooms, got {len(found)} without; their completion files say what failed")
    return [bag for bag in found if bag.files]


def _planned(folder: Folder, names: list[str]) -> int | None:
    if PLAN_NAME not in names:
        return None
    shards = read_json(folder.file(PLAN_NAME), "").get("shards")
    return shards if isinstance(shards, int) else None


def _shard(below: Folder, row: Any, where: str) -> BagPlace:
    try:
        rooms = tuple(_room(room, f"rooms[{number}]") for number, room in enumerate(row["rooms"]))
        files = tuple(below.file(name) for name in _in_order(_inside(file["name"]) for file in row["files"]))
        name = f"{below / shard_name(row['shard'])}"
    except (LookupError, TypeError, ValueError, SceneSynthError) as error:
        raise DatasetError(f"{where}: expected rooms and files of a shard, got {' '.join(str(error).split())[:200]}") from None
    return BagPlace(name=name, files=files, rooms=rooms)


def _inside(name: Any) -> str:
    if not isinstance(name, str) or name.startswith("/") or ".." in name.split("/"):
        raise FieldError("name", "a file of the shard", f"{name!r:.100}")
    return name


def _room(room: Any, where: str) -> RoomInfo:
    return from_mapping(RoomInfo, {key: room[key] for key in ("index", "seed", "room_type", "scene_id", "frames")}, where)


def read_json(file: StoredFile, schema: str) -> dict[str, Any]:
    """Return the JSON object in a file.

    Args:
        file: at most 1 GiB.
        schema: that it must have; empty for any.

    Raises:
        DatasetError: it is another.
        OSError: it cannot be read.
    """
    with file.open("rb") as stream:
        text = stream.read(_MAX_SHARD)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise DatasetError(f"{file}: expected JSON, got {' '.join(str(error).split())[:100]}") from None
    if not isinstance(found, dict) or (schema and found.get("schema") != schema):
        got = found.get("schema") if isinstance(found, dict) else None
        raise DatasetError(f"{file}: expected schema {schema or 'of an object'}, got {got!r:.60}; make the dataset again")
    return found
