"""Which setting would about hold a rate, from how long frames take: a plain model of their time, and settings in the order of what is lost.

    time = pixels * (rest + denoising + samples * sampling) + filling / spacing ** 2

``rest``, ``denoising`` and ``sampling`` are measured, each for a pixel of the frames that are too slow; ``filling`` is what the points took
that the cached integrator computed for them, whose looking up is part of the rest.  It is supposed that all but ``filling`` goes with the
pixels.  In four furnished rooms, at 640x480 and 320x240, processor time went with the pixels within 15 %, with and without
denoising, and with the samples within 8 %.  Other rooms and views differ more, so a proposal is "about".  Shorter paths are never proposed:
they lose light.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
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
