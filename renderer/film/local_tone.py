"""Local tone mapping by exposure fusion: a picture becomes several, exposed longer and shorter; of each, what it shows well is kept.

T. Mertens, J. Kautz and F. Van Reeth, "Exposure Fusion", Pacific Graphics 2007, with exposures made from one, as telephones do (S. W.
Hasinoff et al., "Burst Photography for High Dynamic Range and Low-Light Imaging on Mobile Cameras", SIGGRAPH Asia 2016).  They are blended
by Laplacian pyramids (P. J. Burt and E. H. Adelson, "A Multiresolution Spline", ACM Transactions on Graphics 2, 1983).  Weights hang on the
light alone and not on the frame, so frames agree.
"""

import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.color import LUMINANCE
from scene_description.products import matmul

KEPT_LIGHT = 0.35
"""Light, in multiples of white, that stays as it is: telephones show the middle of a room brighter than grey of 0.18."""

_STEP_STOPS, _LONGER_SHARE = 2.0, 0.25
"""Most stops between one exposure and the next, and of all of them the share by which the longest is longer than the picture's own."""
_HALF_LIGHT = 0.6
"""Light, in multiples of white, that an exposure shows at half of the most that it can; tones are the root of that share."""
_BEST_TONE, _TONE_SPREAD, _CLARITY = 0.7, 0.15, 0.03
"""The tone that counts most, how fast others count less, and by how much stronger details are shown for each stop that is merged."""
_COARSEST = 20
"""Pixels of the shorter side below which a pyramid ends."""
_LEAST_LIGHT, _LEAST_TONE, _MOST_TONE = 1e-6, 1e-3, 0.998

Tones = NDArray[np.float64]


def merge_exposures(light: NDArray[np.float32], stops: float) -> NDArray[np.float32]:
    """Return light (height, width, 3), in multiples of white, as merged from exposures, the shortest ``stops`` below the longest.

    A quarter of these are above this one.  Colours keep their hue, and even light of ``KEPT_LIGHT`` stays as it is.
    """
    luminance = np.maximum(matmul(light.astype(np.float64).reshape(-1, 3), LUMINANCE).reshape(light.shape[:2]), _LEAST_LIGHT)
    scale = KEPT_LIGHT / _merged(np.full((1, 1), KEPT_LIGHT), stops)
    return np.asarray(light * (scale * _merged(luminance, stops) / luminance).astype(np.float32)[..., None])


def _merged(luminance: Tones, stops: float) -> Tones:
    """Return the luminance (height, width) that merged exposures show."""
    below = np.linspace(0.0, stops, math.ceil(stops / _STEP_STOPS) + 1) - _LONGER_SHARE * stops
    gains = [math.pow(0.5, stop) for stop in below.tolist()]
    tones = np.stack([np.sqrt(gain * luminance / (gain * luminance + _HALF_LIGHT)) for gain in gains])
    off = (tones - _BEST_TONE) / _TONE_SPREAD
    weights = el.exp(-0.5 * off * off)
    share = np.clip(_fuse(tones, weights / weights.sum(axis=0), 1.0 + _CLARITY * stops), _LEAST_TONE, _MOST_TONE)
    share = share * share
    return np.asarray(_HALF_LIGHT * share / (1.0 - share))


def _fuse(tones: Tones, weights: Tones, strength: float) -> Tones:
    """Return the blend (height, width) of images (exposures, height, width): details at each scale by its weights, and stronger."""
    if min(tones.shape[1:]) < _COARSEST:
        return np.asarray((tones * weights).sum(axis=0))
    coarse = _halved(tones)
    detail = tones - _doubled(coarse, tones.shape[1:])
    blurred = _doubled(_fuse(coarse, _halved(weights), strength), tones.shape[1:])
    return np.asarray(strength * (detail * weights).sum(axis=0) + blurred)


def _halved(images: Tones) -> Tones:
    """Return images (..., height, width) at half the size: binomial filter of five taps along both axes, every other pixel."""
    for axis in (-2, -1):
        line = np.moveaxis(images, axis, -1)
        line = np.concatenate([line[..., :1], line[..., :1], line, line[..., -1:], line[..., -1:]], axis=-1)
        inner, outer = line[..., 1:-3] + line[..., 3:-1], line[..., :-4] + line[..., 4:]
        images = np.moveaxis((0.375 * line[..., 2:-2] + 0.25 * inner + 0.0625 * outer)[..., ::2], -1, axis)
    return images


def _doubled(images: Tones, size: tuple[int, ...]) -> Tones:
    """Return images (..., h, w) at twice their size, (..., *size), by the same filter between their pixels."""
    for axis, length in zip((-2, -1), size, strict=True):
        line = np.moveaxis(images, axis, -1)
        line = np.concatenate([line[..., :1], line, line[..., -1:]], axis=-1)
        even = 0.75 * line[..., 1:-1] + 0.125 * (line[..., :-2] + line[..., 2:])
        odd = 0.5 * (line[..., 1:-1] + line[..., 2:])
        images = np.moveaxis(np.stack([even, odd], axis=-1).reshape(*even.shape[:-1], -1)[..., :length], -1, axis)
    return images
