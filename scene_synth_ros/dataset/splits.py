"""Splits of a dataset: ``splits.json`` names the rooms, and where it is so the frames, of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.bags.dataset_files import SPLITS_NAME, SPLITS_SCHEMA
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.folders import Folder
from scene_synth_ros.dataset.places import read_json
from scene_synth_ros.dataset.rooms import RoomInfo


def read_split(folder: Folder, name: str, rooms: Sequence[RoomInfo]) -> NDArray[np.int64]:
    """Return the frames of a split, (frames,) indices in the dataset, in the order of the split.

    Rooms that are not in the dataset yet, because their shards are not complete, are left out.

    Args:
        folder: of the dataset.
        name: of the split.
        rooms: of the dataset.

    Raises:
        DatasetError: there is no such split, or it does not fit.
        OSError: it cannot be read.
    """
    if SPLITS_NAME not in (folder.names() or ()):
        raise DatasetError(f"{folder}: expected {SPLITS_NAME} for the split '{name}', got none; make it with scene_synth split")
    file = folder.file(SPLITS_NAME)
    splits = read_json(file, SPLITS_SCHEMA).get("splits")
    if not isinstance(splits, dict) or name not in splits:
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
    values = [row.get("room"), row.get("scene"), row.get("copy", 0), row.get("frames")] if isinstance(row, dict) else [None] * 4
    room, scene, copy, frames = values
    numbers = [room, copy, *(frames if isinstance(frames, list) else ())]
    fits = (
        all(isinstance(item, int) and item >= 0 for item in numbers) and isinstance(scene, str | None) and isinstance(frames, list | None)
    )
    if not fits:
        raise DatasetError(f"{where}: expected a room and its frames or null, got {row!r:.80}")
    return room, scene, copy, frames
