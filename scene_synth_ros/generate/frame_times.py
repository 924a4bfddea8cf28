"""Simulated time of frames: integer nanoseconds, independent of how long a frame took."""

from __future__ import annotations

from dataclasses import dataclass


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
