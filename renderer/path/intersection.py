"""From the queue to hits: 16 paths become a packet, and Embree finds what their rays hit first."""

from __future__ import annotations

import numpy as np

from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.embree import INVALID_ID, LANES, SceneHandle, intersect16
from renderer.core.kernel import inlined
from renderer.core.lanes import CARRIED
from renderer.path import queues as qu
from renderer.path.queues import ROW, Queue
from renderer.path.records import Scratch

_ZERO, _INFINITE = np.float32(0.0), np.float32(np.inf)


@inlined
def intersect_closest(scene: SceneHandle, here: Queue, first: int, count: int, primary: bool, scratch: Scratch) -> None:
    """Take paths ``first`` to ``first`` + 15 of ``count`` from the queue into packet and lanes, and find what their rays hit first."""
    rays, lanes, state = scratch.rays, scratch.lanes, here.state
    real, integer = rays.real, rays.integer
    for k in range(LANES):
        i = first + k
        real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = state[qu.ORG_X + i], state[qu.ORG_Y + i], state[qu.ORG_Z + i]
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = state[qu.DIR_X + i], state[qu.DIR_Y + i], state[qu.DIR_Z + i]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _INFINITE
        real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = _ZERO, _ZERO, _ZERO
        integer[ray.GEOM_ID + k] = INVALID_ID
        rays.alive[k] = -1 if i < count else 0
        lanes[ln.WIDTH + k] = state[qu.WIDTH + i]
        for field in range(CARRIED):
            lanes[ln.BETA_R + LANES * field + k] = state[qu.BETA_R + ROW * field + i]
        slot = here.slot[i]
        scratch.lane_slot[k] = slot
        scratch.lane_seeds[k] = scratch.seeds[slot]
    flags = scene.coherent if primary else scene.incoherent
    intersect16(rays.alive.ctypes.data, scene.address, real.ctypes.data, flags)
