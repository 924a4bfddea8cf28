"""How many frames and samples a renderer makes a second, and whether that is what was asked for."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

WINDOW_S = 5.0


class Rates(NamedTuple):
    """Frames and samples of colour a second over the last seconds; 0 where there were none."""

    frames: float
    samples: float


class Throughput:
    """Counts frames over a sliding window; no clocks."""

    def __init__(self) -> None:
        self._frames: deque[tuple[float, int]] = deque()

    def take(self, now_s: float, samples: int) -> None:
        """Count a frame with so many samples of colour, all pixels together."""
        self._frames.append((now_s, samples))
        self._forget(now_s)

    def rates(self, now_s: float) -> Rates:
        """Return the rates of the window that ends now; a window begins with its first frame, which does not count."""
        self._forget(now_s)
        if len(self._frames) < 2:
            return Rates(0.0, 0.0)
        seconds = max(now_s, self._frames[-1][0]) - self._frames[0][0]
        if seconds <= 0.0:
            return Rates(0.0, 0.0)
        return Rates((len(self._frames) - 1) / seconds, sum(samples for _, samples in list(self._frames)[1:]) / seconds)

    def _forget(self, now_s: float) -> None:
        while self._frames and now_s - self._frames[0][0] > WINDOW_S:
            self._frames.popleft()
