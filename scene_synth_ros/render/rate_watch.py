"""Whether frames in real time are as fast as their rate asks for: decided by the first few that show it."""

import math
from collections import deque
from collections.abc import Collection, Iterator
from statistics import median
from typing import NamedTuple

from renderer import CameraConfig

MARGIN = 0.9
"""Share of a period that a frame may take."""
LEAST_PIXELS = 0.25
"""Smallest image proposed, in shares of the present pixels: the model is not trusted further, and a lower rate loses less."""
COARSEST_M = 0.12
"""Widest spacing of the cache proposed: beyond it corners and shadows are lost."""
LEAST_FILLING = 0.1
"""Share of the budget that filling the cache must take for a coarser one to be proposed."""
_COARSER = (1.25, 1.5, 2.0)
_GRIDS = (16, 8, 4, 2, 1)


class FrameTime(NamedTuple):
    """How long the parts of a frame took (s); ``rendering_s`` includes ``sampling_s`` and ``denoising_s``."""

    rendering_s: float
    sampling_s: float = 0.0
    denoising_s: float = 0.0
    publishing_s: float = 0.0
    waiting_s: float = 0.0
    """Waiting for recorders that are behind."""
    filling_s: float = 0.0
    """Computing light for the cache of the room; part of ``rendering_s``, not of ``sampling_s``."""

    @property
    def total_s(self) -> float:
        """The whole frame (s)."""
        return self.rendering_s + self.publishing_s + self.waiting_s


class Quality(NamedTuple):
    """The settings that a frame's time depends on, in the order in which they are given up."""

    samples: int
    """Per pixel; 0 without sampled layers."""
    denoised: bool
    width: int
    height: int
    spacing_m: float = 0.0
    """Between the points of the irradiance cache; 0 without one."""


_PARAMETERS = {
    "samples": "render.samples_per_pixel",
    "denoised": "render.denoise",
    "width": "camera.width",
    "height": "camera.height",
    "spacing_m": "render.cache_spacing_m",
}


def proposed_settings(measured: FrameTime, quality: Quality, period_s: float, *, resizable: bool = True) -> str:
    """Return parameters with values that would about hold a rate, with commas between; empty if only a lower rate does.

    Fewer samples are tried first, then no denoising, then a coarser cache where filling it takes long, then a smaller image of the same
    shape; each keeps what was given up before.

    Args:
        measured: a typical frame.
        quality: what it was rendered with.
        period_s: of the rate that is asked for.
        resizable: whether a smaller image shows the same, as it does unless the lens is given in pixels.
    """
    for less in _lesser(measured, quality, period_s * MARGIN, resizable):
        if less != quality and predicted_s(measured, quality, less) <= period_s * MARGIN:
            changes = ((name, value) for name, value in less._asdict().items() if value != getattr(quality, name))
            return ", ".join(f"{_PARAMETERS[name]} {_text(value)}" for name, value in changes)
    return ""


def proposed_rate_hz(measured: FrameTime) -> float:
    """Return a round rate (Hz) that frames as they are would about hold."""
    rate = MARGIN / measured.total_s
    step = 1.0 if rate >= 10.0 else 0.5 if rate >= 1.0 else 0.1
    return max(0.1, round(math.floor(rate / step) * step, 1))


def predicted_s(measured: FrameTime, quality: Quality, less: Quality) -> float:
    """Return how long a frame of lower quality would about take (s)."""
    pixels = less.width * less.height / (quality.width * quality.height)
    sampling = measured.sampling_s * less.samples / max(quality.samples, 1)
    denoising = measured.denoising_s if less.denoised else 0.0
    filling = measured.filling_s * (quality.spacing_m / less.spacing_m) ** 2 if less.spacing_m else measured.filling_s
    rest = measured.total_s - measured.sampling_s - measured.denoising_s - measured.filling_s
    return pixels * (sampling + denoising + rest) + filling


def _text(value: float | bool) -> str:
    """Return a setting's value as it is written; the one flag, denoising, is given up by name."""
    return "none" if isinstance(value, bool) else f"{value:g}"


def is_resizable(camera: CameraConfig) -> bool:
    """Return whether an image of another size shows the same, so that the lens is given by its field of view alone."""
    return camera.focal_x_px == camera.focal_y_px == 0.0 and camera.principal_x_px < 0.0 and camera.principal_y_px < 0.0


def _lesser(measured: FrameTime, quality: Quality, budget_s: float, resizable: bool) -> Iterator[Quality]:
    """Yield what may be given up, less before more."""
    if quality.samples:
        left_s = budget_s - (measured.total_s - measured.sampling_s)
        fitting = int(left_s / measured.sampling_s * quality.samples) if measured.sampling_s else 1
        quality = quality._replace(samples=min(max(fitting, 1), quality.samples))
        yield quality
        quality = quality._replace(denoised=False)
        yield quality
    if quality.spacing_m and measured.filling_s > LEAST_FILLING * budget_s:
        wider = [round(quality.spacing_m * factor, 3) for factor in _COARSER]
        for spacing_m in (spacing_m for spacing_m in wider if spacing_m <= COARSEST_M):
            quality = quality._replace(spacing_m=spacing_m)
            yield quality
    if resizable:
        yield from (quality._replace(width=width, height=height) for width, height in _smaller_sizes(quality.width, quality.height))


def _smaller_sizes(width: int, height: int) -> Iterator[tuple[int, int]]:
    """Yield smaller sizes of the same shape, large ones first, in multiples of 16 or of the largest power of two that allows three."""
    shape = math.gcd(width, height)
    for grid in _GRIDS:
        step_w, step_h = width // shape * grid, height // shape * grid
        first, least = (shape - 1) // grid, math.ceil(shape * math.sqrt(LEAST_PIXELS) / grid)
        if first >= least + 2 or grid == 1:
            yield from ((step_w * count, step_h * count) for count in range(first, least - 1, -1))
            return


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
    total_s: float
    """Median of whole frames (s); those of their parts need not add up to it."""

    @property
    def held_hz(self) -> float:
        """The rate that is reached (Hz)."""
        return min(self.wanted_hz, 1.0 / self.total_s)


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
        total_s = median(taken.total_s for taken in self._frames)
        self.finding = Finding(names, 1.0 / period_s, FrameTime(*map(median, zip(*self._frames, strict=True))), total_s)
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
    """Return one line that says what rate is asked for, what is reached, why, and the setting that would about hold it."""
    frame, period_s = finding.typical, 1.0 / finding.wanted_hz
    rate = f"grammar_node rate_hz {proposed_rate_hz(frame):g}"
    settings = ""
    if frame.rendering_s > period_s or frame.rendering_s > frame.waiting_s + frame.publishing_s:
        settings = proposed_settings(frame, quality, period_s, resizable=resizable)
        why = f"a frame takes {frame.rendering_s:.3g} s to render"
    elif frame.waiting_s > frame.publishing_s:
        why = f"a recorder takes frames no faster, {frame.waiting_s:.3g} of {frame.total_s:.3g} s a frame are waiting for it"
    else:
        why = f"publishing takes {frame.publishing_s:.3g} of {frame.total_s:.3g} s a frame, fewer or faster subscribers would help"
    remedy = f"{settings} of the renderer would about hold it, or {rate}" if settings else f"{rate} would about hold"
    return f"{_named(finding.layers)}: {finding.wanted_hz:g} Hz {_reached(finding)}; {why}: {remedy}"


def _reached(finding: Finding) -> str:
    """Return how near a rate is; what is short of it is never rounded up to it."""
    if finding.held_hz == finding.wanted_hz:
        return "only just reached"
    step = 10 if finding.held_hz >= 1.0 else 100
    held_hz = round(finding.held_hz * step) / step
    return f"asked for, {held_hz if held_hz < finding.wanted_hz else math.floor(finding.held_hz * step) / step:g} reached"


def _named(layers: Collection[str]) -> str:
    return ", ".join(layers) or "no layer"
