"""The rooms of a dataset: what is known of each without reading its description as a whole."""

from bisect import bisect_right
from dataclasses import dataclass

from scene_synth_ros.messages.cdr import json_object
from scene_synth_ros.messages.stamps import CdrBytes, stamp_ns
from scene_synth_ros.messages.streams import STRING_TYPE


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


def room_of_scene(data: CdrBytes, number: int) -> RoomInfo:
    """Return what a serialised scene description says; of what is none, the room ``number`` of an unknown type."""
    scene = json_object(data)
    index, seed, kind, name = (scene.get(key) for key in ("index", "seed", "category", "id"))
    return RoomInfo(
        index=index if isinstance(index, int) and index >= 0 else number,
        seed=seed if isinstance(seed, int) and seed >= 0 else 0,
        room_type=kind if isinstance(kind, str) and kind else UNKNOWN_ROOM.room_type,
        scene_id=name if isinstance(name, str) else "",
        frames=0,
    )


class RoomsByStart:
    """Rooms by their first stamps; a description that is sent again is one room."""

    def __init__(self) -> None:
        self._rooms: dict[int, RoomInfo] = {}
        self._starts: list[int] = []

    def add(self, data: CdrBytes, log_ns: int) -> None:
        """Take a serialised scene description.

        What is none is a room of the type ``unknown``; ``log_ns``, when it came, counts where it has no stamp.
        """
        stamp = stamp_ns(STRING_TYPE, data)
        self._rooms.setdefault(log_ns if stamp is None else stamp, room_of_scene(data, len(self._rooms)))
        self._starts = sorted(self._rooms)

    def position(self, stamp: int) -> int:
        """Return the position of the room that a frame shows; what comes before the first room belongs to that."""
        return max(bisect_right(self._starts, stamp) - 1, 0)

    def __getitem__(self, position: int) -> RoomInfo:
        """Return a room by its position."""
        return self._rooms[self._starts[position]] if self._starts else UNKNOWN_ROOM
