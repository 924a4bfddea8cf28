"""AOVs: what the paths see first, base colours and normals, for people and for the denoiser."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.embree import LANES
from renderer.core.kernel import inlined
from renderer.path.queues import slot_pixel
from renderer.path.records import Film, Scratch

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_SMOOTH, _DEEPEST_MIRROR = np.float32(0.12), 3


@inlined
def _albedo(lanes: NDArray[np.float32], k: int, channel: int) -> np.float32:
    """Return the base colour of lane k's hit; of glass and lamps 1."""
    clear = _ONE if lanes[ln.LE_R + k] > _ZERO else max(lanes[ln.THIN + k], lanes[ln.TRANSMISSION + k])
    base = lanes[ln.BASE_R + LANES * channel + k]
    albedo: np.float32 = base + clear * (_ONE - base)
    return albedo


@inlined
def update_aovs(film: Film, column: int, row: int, depth: int, scratch: Scratch) -> None:
    """Add what the film asks for of a packet's hits in the tile that begins at (column, row)."""
    if depth == 0 and film.albedo.shape[0] > 0:
        _add_albedo(column, row, scratch, film.albedo)
    if film.aov.shape[0] > 0:
        _add_aovs(column, row, depth, scratch, film.aov)


@inlined
def _add_albedo(column: int, row: int, scratch: Scratch, albedo: NDArray[np.float32]) -> None:
    """Add the albedo of camera rays' hits; where they hit nothing, nothing."""
    lanes = scratch.lanes
    for k in range(LANES):
        if scratch.rays.alive[k] != 0 and lanes[ln.HIT + k] > _ZERO:
            x, y = slot_pixel(scratch.lane_slot[k])
            for channel in range(3):
                albedo[row + y, column + x, channel] += _albedo(lanes, k, channel)


@inlined
def _add_aovs(column: int, row: int, depth: int, scratch: Scratch, aov: NDArray[np.float32]) -> None:
    """Add albedo and normal of what paths hit first, or first behind mirrors and clear glass, tinted by these; once for each path."""
    lanes, aov_done = scratch.lanes, scratch.aov_done
    for k in range(LANES):
        slot = scratch.lane_slot[k]
        if scratch.rays.alive[k] == 0 or aov_done[slot] > 0:
            continue
        emits = lanes[ln.LE_R + k] + lanes[ln.LE_G + k] + lanes[ln.LE_B + k] > _ZERO
        clear = lanes[ln.METALLIC + k] > _HALF or lanes[ln.TRANSMISSION + k] > _HALF
        if clear and not emits and lanes[ln.ROUGHNESS + k] < _SMOOTH and depth < _DEEPEST_MIRROR:
            continue
        aov_done[slot] = 1
        if lanes[ln.HIT + k] > _ZERO:
            x, y = slot_pixel(slot)
            for channel in range(3):
                tint = min(lanes[ln.BETA_R + LANES * channel + k], _ONE)
                aov[row + y, column + x, channel] += tint * _albedo(lanes, k, channel)
                aov[row + y, column + x, 3 + channel] += lanes[ln.NS_X + LANES * channel + k]
