"""What lies at a path: a bag, a file of one, a folder of bags, or a dataset whose shards say what is in them, and its splits."""

import json
import os
import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_description import SceneSynthError
from scene_description.strict import FieldError, from_mapping
from scene_synth_ros.bags.dataset_files import (
    DATASET_MANIFEST_NAME,
    DATASET_MANIFEST_SCHEMA,
    PLAN_NAME,
    SHARD_SCHEMA,
    SHARDS_NAME,
    SPLITS_NAME,
    SPLITS_SCHEMA,
    is_shard_file,
    shard_name,
)
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.folders import Folder, LocalFolder
from scene_synth_ros.dataset.rooms import RoomInfo
from scene_synth_ros.mcap.stored_file import StoredFile

_ENDINGS = (".mcap", ".mcap.active")
_MAX_JSON = 40 * 2**20
"""Bytes of a file of JSON, which takes up to 25 times as much memory; the manifest of 60,000 rooms has as many."""
_SPLIT_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")
"""Those of ``scene_synth split``; they become parts of paths."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BagPlace:
    """Where a bag of a dataset is: its name, its files in their order, its rooms where a shard says them."""

    name: str
    files: tuple[StoredFile, ...]
    rooms: tuple[RoomInfo, ...] | None = None


def find_bags(folder: Folder, report: Callable[[str], None]) -> list[BagPlace]:
    """Return the bags at a place in the order of their names, shards in the order of their numbers.

    ``report`` gets one line for everything that is not whole.

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
    if _is_dataset(names):
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
    """Return the shards that are complete, by the manifest where there is one that is not too large, else by their completion files."""
    below = folder / SHARDS_NAME if SHARDS_NAME in names else folder
    rows: Any
    if DATASET_MANIFEST_NAME in names and _size(folder.file(DATASET_MANIFEST_NAME)) <= _MAX_JSON:
        rows = read_json(folder.file(DATASET_MANIFEST_NAME), DATASET_MANIFEST_SCHEMA).get("shards")
        where = str(folder / DATASET_MANIFEST_NAME)
    else:
        inside = below.names() or []
        told = sorted(name for name in inside if name.removesuffix(".json").isdecimal() and name.endswith(".json"))
        rows = (read_json(below.file(name), SHARD_SCHEMA) for name in told)
        where = str(below)
        planned = _planned(folder, names)
        if planned is not None and len(told) < planned:
            report(
                f"{folder}: {len(told)} of {planned} shards are complete; the others are left out, scene_synth generate --resume makes them"
            )
    found = [_shard(below, row, f"{where}: shards[{number}]") for number, row in enumerate(rows if isinstance(rows, Iterable) else ())]
    if not found:
        raise DatasetError(f"{where}: expected complete shards, got none; let scene_synth generate finish one")
    if not any(bag.files for bag in found):
        raise DatasetError(f"{where}: expected a shard with rooms, got {len(found)} without; their completion files say what failed")
    return [bag for bag in found if bag.files]


def shard_bags(path: Path, report: Callable[[str], None]) -> list[Path]:
    """Return the bags of the complete shards of a dataset on this machine, in their order; none where ``path`` is no dataset.

    ``report`` gets one line for everything that is not whole.

    Raises:
        DatasetError: no shard is complete.
        OSError: it cannot be read.
    """
    folder = LocalFolder(path)
    names = folder.names() or []
    if not _is_dataset(names):
        return []
    return [Path(shard.name) for shard in _shards(folder, names, report)]


def _is_dataset(names: Collection[str]) -> bool:
    return PLAN_NAME in names or DATASET_MANIFEST_NAME in names or SHARDS_NAME in names


def _planned(folder: Folder, names: list[str]) -> int | None:
    if PLAN_NAME not in names:
        return None
    shards = read_json(folder.file(PLAN_NAME), "").get("shards")
    return shards if isinstance(shards, int) else None


def _shard(below: Folder, row: Any, where: str) -> BagPlace:
    try:
        rooms = tuple(_room(room, f"rooms[{number}]") for number, room in enumerate(row["rooms"]))
        files = tuple(below.file(name) for name in _in_order(_inside(file["name"], row["shard"]) for file in row["files"]))
        name = f"{below / shard_name(row['shard'])}"
    except (LookupError, TypeError, ValueError, SceneSynthError) as error:
        raise DatasetError(f"{where}: expected rooms and files of a shard, got {' '.join(str(error).split())[:200]}") from None
    return BagPlace(name=name, files=files, rooms=rooms)


def _inside(name: Any, shard: int) -> str:
    if not is_shard_file(name, shard):
        raise FieldError("name", "a file of the shard", f"{name!r:.100}")
    return str(name)


def _room(room: Any, where: str) -> RoomInfo:
    return from_mapping(RoomInfo, {key: room[key] for key in ("index", "seed", "room_type", "scene_id", "frames")}, where)


def _size(file: StoredFile) -> int:
    with file.open("rb") as stream:
        return stream.seek(0, os.SEEK_END)


def read_json(file: StoredFile, schema: str) -> dict[str, Any]:
    """Return the JSON object in a file.

    It has the schema that is asked for, if one is.

    Raises:
        DatasetError: it is another, or the file is too large.
        OSError: it cannot be read.
    """
    size = _size(file)
    if size > _MAX_JSON:
        raise DatasetError(f"{file}: expected at most {_MAX_JSON} bytes of JSON, got {size}; it is none of scene_synth's files")
    with file.open("rb") as stream:
        text = stream.read(size)  # reading takes the memory that it is asked for, however short the file
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise DatasetError(f"{file}: expected JSON, got {' '.join(str(error).split())[:100]}") from None
    if not isinstance(found, dict) or (schema and found.get("schema") != schema):
        got = found.get("schema") if isinstance(found, dict) else None
        raise DatasetError(f"{file}: expected schema {schema or 'of an object'}, got {got!r:.60}; make the dataset again")
    return found


def read_split(folder: Folder, name: str, rooms: Sequence[RoomInfo]) -> NDArray[np.int64]:
    """Return the frames of a split, (frames,) indices in the dataset, in the order of the split.

    Rooms that are not in the dataset yet, because their shards are not complete, are left out.

    Raises:
        DatasetError: there is no such split, or it does not fit.
        OSError: it cannot be read.
    """
    if not _SPLIT_NAME.fullmatch(name):
        raise DatasetError(f"{folder}: expected the name of a split of letters, digits, - and _, got {name!r:.100}")
    if SPLITS_NAME not in (folder.names() or ()):
        raise DatasetError(f"{folder}: expected {SPLITS_NAME} for the split '{name}', got none; make it with scene_synth split")
    file = folder.file(SPLITS_NAME)
    splits = read_json(file, SPLITS_SCHEMA).get("splits")
    if not isinstance(splits, dict) or not isinstance(splits.get(name), list):
        raise DatasetError(f"{file}: expected split '{name}', got {', '.join(splits) if isinstance(splits, dict) else 'no splits'}")
    starts = np.concatenate([[0], np.cumsum([room.frames for room in rooms])]).astype(np.int64)
    places: dict[tuple[int, str | None], list[int]] = {}
    for place, info in enumerate(rooms):
        places.setdefault((info.index, info.scene_id), []).append(place)
        places.setdefault((info.index, None), []).append(place)
    chosen = [np.empty(0, np.int64)]
    for number, row in enumerate(splits[name]):
        room, scene, copy, frames = _row(row, f"{file}: splits.{name}[{number}]")
        alike = places.get((room, scene), [])
        if copy < len(alike):
            place = alike[copy]
            count = rooms[place].frames
            own = np.arange(count) if frames is None else np.array(frames, np.int64)
            if own.size and (own.min() < 0 or own.max() >= count):
                raise DatasetError(
                    f"{file}: splits.{name}[{number}]: expected frames of room {room} from 0 to {count - 1}, got {own.max()}"
                )
            chosen.append(starts[place] + own)
    return np.concatenate(chosen)


def _row(row: Any, where: str) -> tuple[int, str | None, int, list[int] | None]:
    """Return a room's index, the id of its scene (None: any), how many rooms of both come before it, and its frames (None: all)."""
    found: dict[str, Any] = row if isinstance(row, dict) else {}
    room, scene, copy, frames = found.get("room"), found.get("scene"), found.get("copy", 0), found.get("frames")
    numbers = [room, copy, *(frames if isinstance(frames, list) else ())]
    counted = all(isinstance(item, int) and 0 <= item < 2**63 for item in numbers)
    fits = counted and isinstance(scene, str | None) and isinstance(frames, list | None)
    if not fits or room is None:
        raise DatasetError(f"{where}: expected a room and its frames or null, got {row!r:.80}")
    return room, scene, copy, frames
