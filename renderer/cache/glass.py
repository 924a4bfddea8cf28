"""Shadow rays that clear glass lets pass: straight on, tinted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cache.specular import is_clear
from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.embree import INVALID_ID, LANES, MEET_ALL, PASS_PANES, SceneHandle, intersect16, occluded16
from renderer.core.kernel import inlined
from renderer.path import surface_tables as st
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_DEEPEST = 8


@inlined
def pass_glass(scene: SceneHandle, surfaces: Surfaces, lanes: NDArray[np.float32], scratch: Scratch) -> None:
    """Trace shadow rays from P along TO_LIGHT; where something other than clear glass stands between, LIGHT_PDF becomes 0.

    Glass takes its colour from LI.
    """
    packet = scratch.shadow_rays.packet
    real, integer, alive = packet.real, packet.integer, packet.alive
    for k in range(LANES):
        for axis in range(0, 3 * LANES, LANES):
            real[ray.ORG_X + axis + k], real[ray.DIR_X + axis + k] = lanes[ln.P_X + axis + k], lanes[ln.TO_LIGHT_X + axis + k]
        end = lanes[ln.LIGHT_END + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, end
        integer[ray.MASK + k] = PASS_PANES if end > _ONE else MEET_ALL
        alive[k] = -1 if lanes[ln.LIGHT_PDF + k] > _ZERO else 0
    occluded16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
    scratch.traced[0] += LANES
    waiting = 0
    for k in range(LANES):
        blocked = (alive[k] != 0) & (real[ray.TFAR + k] < _ZERO)
        alive[k] = -1 if blocked else 0
        waiting += blocked
        real[ray.TFAR + k], integer[ray.GEOM_ID + k] = lanes[ln.LIGHT_END + k], INVALID_ID
    if len(surfaces.albedos.glass) == 0:
        for k in range(LANES):
            if alive[k] != 0:
                lanes[ln.LIGHT_PDF + k] = _ZERO
        return
    for _ in range(_DEEPEST):
        if waiting == 0:
            break
        intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
        waiting = 0
        for k in range(LANES):
            if alive[k] == 0:
                continue
            if integer[ray.GEOM_ID + k] == INVALID_ID:
                alive[k] = 0
                continue
            row = surfaces.face_part[integer[ray.PRIM_ID + k]] * st.ROW_SIZE
            if is_clear(surfaces.materials, row):
                for channel in range(3):
                    tint = np.sqrt(surfaces.materials[row + st.BASE + channel]) * np.float32(0.96)
                    lanes[ln.LI_R + channel * LANES + k] *= tint
                real[ray.TNEAR + k] = real[ray.TFAR + k] + np.float32(1e-5)
                real[ray.TFAR + k], integer[ray.GEOM_ID + k] = lanes[ln.LIGHT_END + k], INVALID_ID
                waiting += 1
            else:
                lanes[ln.LIGHT_PDF + k] = _ZERO
                alive[k] = 0
    for k in range(LANES):
        if alive[k] != 0:
            lanes[ln.LIGHT_PDF + k] = _ZERO
