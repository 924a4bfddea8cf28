"""Blocked light: what the sampled lights would bring to the first hits if nothing stood between, and how much of it something takes away.

The samples are those of direct light, emitters and infinite light alike, before the surface reflects any of it: black things and mirrors
have shadows as white ones do.  Rays of their own test what stands between, so that colour keeps its bytes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.embree import LANES, MEET_ALL, PASS_PANES, Packet, SceneHandle, occluded16
from renderer.core.kernel import kernel
from renderer.path.queues import slot_pixel

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)


@kernel
def add_blocked_light(
    scene: SceneHandle,
    lanes: NDArray[np.float32],
    slots: NDArray[np.int32],
    packet: Packet,
    column: int,
    row: int,
    arriving: NDArray[np.float32],
) -> None:
    """Add the illuminance of a packet's light samples, and what of it is blocked, to ``Film.arriving`` of the tile at (column, row).

    Reads P, TO_LIGHT, LIGHT_END, LI, LIGHT_PDF and WI; ``slots``: of the lanes; ``packet``: memory for the rays.
    """
    real, integer = packet.real, packet.integer
    for k in range(LANES):
        for axis in range(3):
            real[ray.ORG_X + LANES * axis + k] = lanes[ln.P_X + LANES * axis + k]
            real[ray.DIR_X + LANES * axis + k] = lanes[ln.TO_LIGHT_X + LANES * axis + k]
        end = lanes[ln.LIGHT_END + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, end
        integer[ray.MASK + k] = PASS_PANES if end > _ONE else MEET_ALL
        packet.alive[k] = -1 if lanes[ln.LIGHT_PDF + k] > _ZERO else 0
    occluded16(packet.alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
    for k in range(LANES):
        if lanes[ln.LIGHT_PDF + k] > _ZERO:
            luminance = _RED * lanes[ln.LI_R + k] + _GREEN * lanes[ln.LI_G + k] + _BLUE * lanes[ln.LI_B + k]
            lux = luminance * lanes[ln.WI_Z + k] / lanes[ln.LIGHT_PDF + k]
            x, y = slot_pixel(slots[k])
            arriving[row + y, column + x, 0] += lux
            # Embree sets the end of a blocked ray to minus infinity.
            arriving[row + y, column + x, 1] += lux if real[ray.TFAR + k] < _ZERO else _ZERO
