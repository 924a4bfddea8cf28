"""The film: what a wave has gathered is added to the sums of its pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import inlined
from renderer.path.queues import WAVE, slot_pixel
from renderer.path.records import Film


@inlined
def update_film(camera: PosedCamera, column: int, row: int, light: NDArray[np.float32], film: Film) -> None:
    """Add one sample of the tile that begins at (column, row); ``light``: (3 * WAVE,) float32, by slot, cd/m2."""
    for slot in range(WAVE):
        x, y = slot_pixel(slot)
        if column + x < camera.width and row + y < camera.height:
            for channel in range(3):
                value = light[channel * WAVE + slot]
                film.light[row + y, column + x, channel] += value
                if film.squares.shape[0] > 0:
                    film.squares[row + y, column + x, channel] += value * value
