"""``splits.json``, which :func:`scene_synth_ros.dataset.open_dataset` reads: rooms and frames of each split, and how they were chosen."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from typing import Any, NamedTuple

from scene_synth_ros.bags.dataset_files import SPLITS_SCHEMA
from scene_synth_ros.splits.balance import ClassBalance


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomFrames:
    """What of a room is in a split.

    Attributes:
        room: index.
        scene: id of its description, empty if it has none.
        copy: how many rooms of that index and id come before it in the source.
        frames: numbers of its frames; None for all.
        count: how many frames these are.
    """

    room: int
    scene: str
    copy: int
    frames: tuple[int, ...] | None
    count: int


class SplitBalance(NamedTuple):
    """The weights of a split's frames, in the order of its rooms and their frames, and its classes."""

    weights: Sequence[float]
    classes: Mapping[str, ClassBalance]


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """What a filter leaves out: rooms that it refuses as a whole, frames that it refuses, and how many of these no other refuses."""

    rooms: int
    frames: int
    alone: int


def splits_json(
    splits: Mapping[str, Sequence[RoomFrames]],
    *,
    rule: Mapping[str, Any],
    filters: Mapping[str, Any],
    left_out: Mapping[str, LeftOut],
    balance: Mapping[str, SplitBalance] | None = None,
) -> str:
    """Return the text of the file; a room stands on a line of its own."""
    lines = []
    for name, rooms in splits.items():
        weights = iter((balance or {})[name].weights) if name in (balance or {}) else None
        rows = ",\n".join(f"   {_compact(_row(room, weights))}" for room in rooms)
        lines.append(f"  {json.dumps(name)}: [{chr(10) + rows if rows else ''}]")
    told = {name: {"rooms": it.rooms, "frames": it.frames, "alone": it.alone} for name, it in left_out.items()}
    parts = [
        f' "schema": "{SPLITS_SCHEMA}"',
        f' "rule": {_compact(rule)}',
        f' "filters": {_compact(filters)}',
        f' "left_out": {_compact(told)}',
    ]
    if balance is not None:
        classes = {name: {key: asdict(one) for key, one in of.classes.items()} for name, of in balance.items()}
        parts.append(f' "classes": {_compact(classes)}')
    return "{\n" + ",\n".join([*parts, ' "splits": {\n' + ",\n".join(lines) + "\n }"]) + "\n}\n"


def _row(room: RoomFrames, weights: Iterator[float] | None) -> dict[str, Any]:
    row: dict[str, Any] = {"room": room.room}
    if room.scene:
        row["scene"] = room.scene
    if room.copy:
        row["copy"] = room.copy
    row |= {"frames": None if room.frames is None else list(room.frames)}
    return row if weights is None else row | {"weights": list(islice(weights, room.count))}


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
