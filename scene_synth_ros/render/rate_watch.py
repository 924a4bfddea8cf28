"""Whether frames in real time are as fast as their rate asks for: decided by the first few that show it."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from statistics import median
from typing import NamedTuple

from scene_synth_ros.render.rate_proposal import FrameTime, Quality, proposed_rate_hz, proposed_settings

WINDOW = 5
"""Frames that are looked at."""
FEWEST = 2
"""Late frames that are a finding: one alone is a hiccup."""
EASY = 0.9
"""Share of the period within which all frames of a window must be before the rate counts as held again."""


class Finding(NamedTuple):
    """What the newest frames show."""

    layers: tuple[str, ...]
    wanted_hz: float
    typical: FrameTime
    """Medians of the window."""

    @property
    def held_hz(self) -> float:
        """The rate that is reached (Hz)."""
        return min(self.wanted_hz, 1.0 / self.typical.total_s)


class RateWatch:
    """Follows how long frames take against their period, anew for every set of layers; no ROS, no clocks.

    The first frame of a set of layers does not count: what it needs is made for it, as is the denoiser for the size of the image.  The rate
    is not held when more than half of the last :data:`WINDOW` frames, and :data:`FEWEST` at least, took longer than their period; it is
    held again when :data:`WINDOW` frames in a row took less than :data:`EASY` of it.

    Threading: :meth:`take` belongs to one thread; ``finding`` and ``late`` are replaced as a whole and may be read by any.

    Attributes:
        finding: what the newest frames show, None before there are any of these layers.
        late: the layers whose rate is not held, None while it is.
    """

    def __init__(self) -> None:
        self.finding: Finding | None = None
        self.late: tuple[str, ...] | None = None
        self._layers: tuple[str, ...] | None = None
        self._frames: deque[FrameTime] = deque(maxlen=WINDOW)

    def take(self, layers: Collection[str], period_s: float, frame: FrameTime) -> bool:
        """Take a frame; return whether it is news: a rate that is held no longer, or held again.

        Args:
            layers: that were rendered.
            period_s: from frame to frame, as asked for; 0 for a frame that has none, which counts as the first of its layers only.
            frame: how long it took.
        """
        names = tuple(sorted(layers))
        if names != self._layers:
            self._layers = names
            self._frames.clear()
            self.finding = None
            return False
        if not period_s:
            return False
        self._frames.append(frame)
        self.finding = Finding(names, 1.0 / period_s, FrameTime(*map(median, zip(*self._frames, strict=True))))
        late = sum(taken.total_s > period_s for taken in self._frames)
        if late >= FEWEST and 2 * late > len(self._frames) and self.late != names:
            self.late = names
            return True
        if self.late is not None and len(self._frames) == WINDOW and all(taken.total_s < EASY * period_s for taken in self._frames):
            self.late = None
            return True
        return False


def held_line(finding: Finding) -> str:
    """Return one line that says that a rate is held again."""
    return f"{_named(finding.layers)}: {finding.wanted_hz:g} Hz held"


def late_line(finding: Finding, quality: Quality, resizable: bool) -> str:
    """Return one line that says what rate is asked for, what is reached, why, and the setting that would about hold it.

    Args:
        finding: frames that are too slow.
        quality: what they were rendered with.
        resizable: whether a smaller image shows the same.
    """
    frame, period_s = finding.typical, 1.0 / finding.wanted_hz
    rate = f"grammar_node rate_hz {proposed_rate_hz(frame):g}"
    settings = ""
    if frame.rendering_s > period_s or max(frame.waiting_s, frame.publishing_s) < frame.total_s - period_s:
        settings = proposed_settings(frame, quality, period_s, resizable=resizable)
        why = f"a frame takes {frame.rendering_s:.3g} s to render"
    elif frame.waiting_s > frame.publishing_s:
        why = f"a recorder takes frames no faster, {frame.waiting_s:.3g} of {frame.total_s:.3g} s a frame are waiting for it"
    else:
        why = f"publishing takes {frame.publishing_s:.3g} of {frame.total_s:.3g} s a frame, fewer or faster subscribers would help"
    remedy = f"{settings} of the renderer would about hold it, or {rate}" if settings else f"{rate} would about hold"
    held_hz = round(finding.held_hz, 1 if finding.held_hz >= 1.0 else 2)
    return f"{_named(finding.layers)}: {finding.wanted_hz:g} Hz asked for, {held_hz:g} reached; {why}: {remedy}"


def _named(layers: Collection[str]) -> str:
    return ", ".join(layers) or "no layer"
