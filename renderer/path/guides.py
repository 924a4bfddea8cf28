"""What the paths see first, for people and for the denoiser: base colours and normals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import LANES
from renderer.core.kernel import inlined
from renderer.core.lanes import BASE_R, GLOW_R, METALLIC, REFLECTS, ROUGHNESS, SHADE_X, THIN, TRANSMISSION, WEIGHT_R
from renderer.path.records import Scratch, slot_pixel

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_SMOOTH, _DEEPEST_MIRROR = np.float32(0.12), 3


@inlined
def _albedo(lanes: NDArray[np.float32], k: int, channel: int) -> np.float32:
    """Return the base colour of lane k's hit; of glass and lamps 1."""
    clear = _ONE if lanes[GLOW_R + k] > _ZERO else max(lanes[THIN + k], lanes[TRANSMISSION + k])
    base = lanes[BASE_R + LANES * channel + k]
    albedo: np.float32 = base + clear * (_ONE - base)
    return albedo


@inlined
def note_albedo(column: int, row: int, scratch: Scratch, albedo: NDArray[np.float32]) -> None:
    """Add the albedo of camera rays' hits; where they hit nothing, nothing."""
    lanes = scratch.lanes
    for k in range(LANES):
        if scratch.rays.alive[k] != 0 and lanes[REFLECTS + k] > _ZERO:
            x, y = slot_pixel(scratch.lane_slot[k])
            for channel in range(3):
                albedo[row + y, column + x, channel] += _albedo(lanes, k, channel)


@inlined
def note_guides(column: int, row: int, depth: int, scratch: Scratch, guides: NDArray[np.float32]) -> None:
    """Add albedo and normal of what paths hit first, or first behind mirrors and clear glass, tinted by these; once for each path."""
    lanes, guided = scratch.lanes, scratch.guided
    for k in range(LANES):
        slot = scratch.lane_slot[k]
        if scratch.rays.alive[k] == 0 or guided[slot] > 0:
            continue
        bright = lanes[GLOW_R + k] + lanes[GLOW_R + LANES + k] + lanes[GLOW_R + 2 * LANES + k] > _ZERO
        clear = lanes[METALLIC + k] > _HALF or lanes[TRANSMISSION + k] > _HALF
        if clear and not bright and lanes[ROUGHNESS + k] < _SMOOTH and depth < _DEEPEST_MIRROR:
            continue
        guided[slot] = 1
        if lanes[REFLECTS + k] > _ZERO:
            x, y = slot_pixel(slot)
            for channel in range(3):
                tint = min(lanes[WEIGHT_R + LANES * channel + k], _ONE)
                guides[row + y, column + x, channel] += tint * _albedo(lanes, k, channel)
                guides[row + y, column + x, 3 + channel] += lanes[SHADE_X + LANES * channel + k]
