"""Times of frames, integer nanoseconds: simulated, independent of how long a frame took, or moved to the time of day."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from scene_description import CameraPose

ROOM_CHANGE_S = 0.3
"""By the wall clock, the first frame of a room is due so long after the room has gone out: a renderer prepares it meanwhile."""


@dataclass(frozen=True, slots=True)
class FrameTimes:
    """Times of a sequence of frames from ``origin_ns`` on, ``rate_hz`` a second, counted from frame ``first_frame``.

    A change of rate while running starts a new sequence at the next frame's time, so stamps always increase.
    """

    origin_ns: int
    rate_hz: float
    first_frame: int = 0

    def stamp_ns(self, frame: int) -> int:
        """Return the stamp of a frame, frame >= first_frame."""
        return self.origin_ns + round((frame - self.first_frame) * 1_000_000_000 / self.rate_hz)

    def at_rate(self, rate_hz: float, frame: int) -> FrameTimes:
        """Return the times from ``frame`` on at another rate."""
        return FrameTimes(self.stamp_ns(frame), rate_hz, frame)


def moved_to(path: Sequence[CameraPose], start_ns: int) -> tuple[CameraPose, ...]:
    """Return a camera path whose first frame has the stamp ``start_ns``; the times between frames stay."""
    return tuple(replace(pose, stamp_ns=pose.stamp_ns - path[0].stamp_ns + start_ns) for pose in path)
