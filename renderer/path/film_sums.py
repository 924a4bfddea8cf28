"""What samples add to a film: light, AOVs (what paths see first, for people and for the denoiser), and light that is clipped.

Clipping: a single stroke of indirect light brings only so much to its own pixel, and what it has beyond is shared by all of them.

Few strokes of light are hundreds of times as bright as white: a path that happens to meet the patch where the sun falls, say.  In a
picture of few samples each is a speck; simply cut off, as is common, they leave the picture darker and of another colour.  Here what is
cut off is gathered, and the indirect light of all pixels is made brighter by one factor for each channel, so that the picture's mean is
that of the strokes before.  What is lost is where that light was.

A stroke counts up to :data:`CLIPPED_REACH` times the limit, or else one alone could light a whole picture; what is beyond that is lost.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core import lanes as ln
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES
from renderer.path.queues import WAVE, slot_pixel
from renderer.path.records import Film, Scratch


@inlined
def update_film(camera: PosedCamera, column: int, row: int, light: NDArray[np.float32], film: Film) -> None:
    """Add one sample of the tile that begins at (column, row); ``light``: of the scratch memory."""
    for slot in range(WAVE):
        x, y = slot_pixel(slot)
        if column + x < camera.width and row + y < camera.height:
            for channel in range(3):
                value = light[channel * WAVE + slot]
                film.light[row + y, column + x, channel] += value
                if film.squares.shape[0] > 0:
                    film.squares[row + y, column + x, channel] += value * value
                if film.direct.shape[0] > 0:
                    film.direct[row + y, column + x, channel] += light[(3 + channel) * WAVE + slot]
                if film.clipped.shape[0] > 0:
                    film.clipped[row + y, column + x, channel] += light[(6 + channel) * WAVE + slot]


def indirect_part(light: NDArray[np.float32], direct: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what light (height, width, 3) has beside its direct part; rounding of the two sums makes nothing negative."""
    return np.asarray(np.maximum(light - direct, np.float32(0.0)))


def blocked_share(arriving: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return which share (height, width) of ``Film.arriving`` is blocked: 0 nothing, 1 all; NaN where nothing would arrive anyway."""
    whole, blocked = arriving[..., 0], arriving[..., 1]
    return np.divide(blocked, whole, out=np.full(whole.shape, np.nan, np.float32), where=whole > 0.0)


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


CLIPPED_REACH = np.float32(16.0)
_STEPS = 4096.0
"""Factors come in steps, so that they agree on processors that add in another order."""


def share_clipped(film: Film) -> None:
    """Give the means of a film's clipped light to its indirect light, in place, with ``squares`` to match.

    ``film``: with ``direct`` and ``clipped``; where there is no indirect light nothing is given.
    """
    for channel in range(3):
        light, direct = film.light[..., channel], film.direct[..., channel]
        indirect = np.maximum(light - direct, np.float32(0.0))
        kept, clipped = (float(part.sum(dtype=np.float64)) for part in (indirect, film.clipped[..., channel]))
        gain = round(_STEPS * clipped / kept) / _STEPS if kept > 0.0 else 0.0
        shared = light + np.float32(gain) * indirect
        if len(film.squares):
            film.squares[..., channel] *= np.divide(shared, light, out=np.ones_like(light), where=light > 0.0) ** 2
        light[...] = shared
