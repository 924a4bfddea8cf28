"""The film: what a wave has gathered is added to the sums of its pixels, and layers that are made of several of these."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import inlined
from renderer.path.queues import WAVE, slot_pixel
from renderer.path.records import Film


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
