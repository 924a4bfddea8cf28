"""How many frames, samples and rays a renderer makes a second, and whether that is what was asked for."""

from __future__ import annotations

import threading
from collections import deque
from typing import NamedTuple

WINDOW_S = 5.0


class Rates(NamedTuple):
    """Frames, samples of colour, and rays a second over the last seconds; 0 where there were none."""

    frames: float
    samples: float
    rays: float


class Throughput:
    """Counts frames over a sliding window; no clocks.

    Threading: the rendering thread counts, the executor's thread asks; one lock guards the frames of the window.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frames: deque[tuple[float, int, int]] = deque()

    def take(self, now_s: float, samples: int, rays: int) -> None:
        """Count a frame with so many samples of colour and rays, all pixels together."""
        with self._lock:
            self._frames.append((now_s, samples, rays))
            self._forget(now_s)

    def rates(self, now_s: float) -> Rates:
        """Return the rates of the window that ends now; a window begins with its first frame, which does not count."""
        with self._lock:
            self._forget(now_s)
            frames = list(self._frames)
        if len(frames) < 2:
            return Rates(0.0, 0.0, 0.0)
        seconds = max(now_s, frames[-1][0]) - frames[0][0]
        if seconds <= 0.0:
            return Rates(0.0, 0.0, 0.0)
        counted = frames[1:]
        samples, rays = (sum(frame[column] for frame in counted) / seconds for column in (1, 2))
        return Rates(len(counted) / seconds, samples, rays)

    def _forget(self, now_s: float) -> None:
        while self._frames and now_s - self._frames[0][0] > WINDOW_S:
            self._frames.popleft()
