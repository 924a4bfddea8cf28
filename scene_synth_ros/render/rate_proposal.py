"""Which setting would about hold a rate, from how long frames take: a plain model of their time, and settings in the order of what is lost.

    time = pixels * (rest + denoising + samples * sampling)

``rest``, ``denoising`` and ``sampling`` are measured, each for a pixel of the frames that are too slow.  It is supposed that everything
goes with the pixels.  In four furnished rooms, at 640x480 and 320x240, processor time went with the pixels within 15 %, with and without
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
_GRIDS = (16, 8, 4, 2, 1)


class FrameTime(NamedTuple):
    """How long the parts of a frame took (s); ``rendering_s`` includes ``sampling_s`` and ``denoising_s``."""

    rendering_s: float
    sampling_s: float = 0.0
    denoising_s: float = 0.0
    publishing_s: float = 0.0
    waiting_s: float = 0.0
    """Waiting for recorders that are behind."""

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


_PARAMETERS = {
    "samples": "render.samples_per_pixel",
    "denoised": "render.denoise",
    "width": "camera.width",
    "height": "camera.height",
}


def proposed_settings(measured: FrameTime, quality: Quality, period_s: float, *, resizable: bool = True) -> str:
    """Return parameters with values that would about hold a rate, with commas between; empty if only a lower rate does.

    Fewer samples are tried first, then no denoising, then a smaller image of the same shape; each keeps what was given up before.

    Args:
        measured: a typical frame.
        quality: what it was rendered with.
        period_s: of the rate that is asked for.
        resizable: whether a smaller image shows the same, as it does unless the lens is given in pixels.
    """
    for less in _lesser(measured, quality, period_s * MARGIN, resizable):
        if less != quality and predicted_s(measured, quality, less) <= period_s * MARGIN:
            changes = ((name, value) for name, value in less._asdict().items() if value != getattr(quality, name))
            return ", ".join(f"{_PARAMETERS[name]} {'none' if name == 'denoised' else value}" for name, value in changes)
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
    rest = measured.total_s - measured.sampling_s - measured.denoising_s
    return pixels * (sampling + denoising + rest)


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
