"""The rooms of a run, as scene descriptions name them, and which of them a frame shows."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scene_synth_ros.messages.cdr_reader import CdrReader, CdrReadError
from scene_synth_ros.messages.stamps import CdrBytes, stamp_ns
from scene_synth_ros.messages.streams import STRING_TYPE


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """A room; ``start_ns`` is the stamp of its first frame."""

    index: int
    room_type: str
    seed: int
    start_ns: int


UNKNOWN_ROOM = Room(index=0, room_type="unknown", seed=0, start_ns=0)
"""Of frames without a scene description."""


class Rooms:
    """Rooms by their first stamps; a description that is sent again is one room."""

    def __init__(self) -> None:
        self._rooms: dict[int, Room] = {}
        self._starts: list[int] = []

    def add(self, data: CdrBytes, log_ns: int) -> None:
        """Take a serialised scene description.

        Args:
            data: std_msgs/String; what is no description is a room of the type ``unknown``.
            log_ns: when it came, which counts where it has no stamp.
        """
        scene, start = json_object(data), stamp_ns(STRING_TYPE, data)
        index, seed, kind = scene.get("index"), scene.get("seed"), scene.get("category")
        start = log_ns if start is None else start
        room = Room(
            index=index if isinstance(index, int) and index >= 0 else len(self._rooms),
            room_type=kind if isinstance(kind, str) and kind else UNKNOWN_ROOM.room_type,
            seed=seed if isinstance(seed, int) and seed >= 0 else 0,
            start_ns=start,
        )
        self._rooms.setdefault(start, room)
        self._starts = sorted(self._rooms)

    def position(self, stamp: int) -> int:
        """Return the position of the room that a frame shows; what comes before the first room belongs to that."""
        return max(bisect_right(self._starts, stamp) - 1, 0)

    def __getitem__(self, position: int) -> Room:
        """Return a room by its position."""
        return self._rooms[self._starts[position]] if self._starts else UNKNOWN_ROOM


def json_object(data: CdrBytes) -> Mapping[str, Any]:
    """Return the JSON object in a serialised std_msgs/String; empty if there is none."""
    try:
        found = json.loads(CdrReader(data).text())
    except (CdrReadError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, Mapping) else {}
