"""When a bag goes on in a new file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scene_description import Limits
from scene_synth_ros.messages.stamps import NANOSECONDS

_FIXED = "a bag is split in one way"


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitPolicy:
    """A file ends before the first frame that finds it too large, too long, or at the end of its rooms; 0 sets no bound."""

    size_mb: Annotated[float, Limits(ge=0.0, le=1e9, unit="MB", description="Size on disk of a file", fixed=_FIXED)] = 0.0
    duration_s: Annotated[float, Limits(ge=0.0, le=1e9, unit="s", description="Simulated time in a file", fixed=_FIXED)] = 0.0
    rooms: Annotated[int, Limits(ge=0, le=10**9, description="Rooms in a file", fixed=_FIXED)] = 0

    def is_due(self, size: int, start_ns: int | None, log_ns: int, rooms: int, new_room: bool) -> bool:
        """Return whether the file ends here.

        Args:
            size: bytes of the file on disk.
            start_ns: log time of its first frame; None while it has none.
            log_ns: log time of the next frame.
            rooms: rooms that have begun in the file.
            new_room: whether the next frame begins a room.
        """
        if start_ns is None:
            return False
        too_large = 0.0 < self.size_mb * 1e6 <= size
        too_long = 0.0 < self.duration_s * NANOSECONDS <= log_ns - start_ns
        return too_large or too_long or (new_room and 0 < self.rooms <= rooms)
