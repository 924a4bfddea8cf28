"""The rooms of a dataset: what is known of each without reading its description as a whole."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scene_synth_ros.messages.cdr_reader import CdrReader, CdrReadError


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomInfo:
    """A room.

    Attributes:
        index: its number in the run that made it.
        seed: of that run.
        room_type: ``bedroom`` and so on; ``unknown`` where no description was recorded.
        scene_id: of its description; empty where none was recorded.
        frames: how many of its frames have all layers that were asked for.
    """

    index: int
    seed: int
    room_type: str
    scene_id: str
    frames: int


UNKNOWN_ROOM = RoomInfo(index=0, seed=0, room_type="unknown", scene_id="", frames=0)
"""Of frames without a scene description."""


def read_string(data: bytes | memoryview) -> str:
    """Return the text of a serialised std_msgs/String.

    Raises:
        CdrReadError: it is cut off.
    """
    return CdrReader(data).text()


def room_of_scene(data: bytes | memoryview, number: int) -> RoomInfo:
    """Return what a serialised scene description says; of what is none, the room ``number`` of an unknown type."""
    try:
        found = json.loads(read_string(data))
    except (CdrReadError, ValueError, RecursionError):
        found = None
    scene: Mapping[str, Any] = found if isinstance(found, Mapping) else {}
    index, seed, kind, name = (scene.get(key) for key in ("index", "seed", "category", "id"))
    return RoomInfo(
        index=index if isinstance(index, int) and index >= 0 else number,
        seed=seed if isinstance(seed, int) and seed >= 0 else 0,
        room_type=kind if isinstance(kind, str) and kind else UNKNOWN_ROOM.room_type,
        scene_id=name if isinstance(name, str) else "",
        frames=0,
    )
