"""Partitions: boards and sheets that stand between two nodes of a grid, so that neither lights the other's side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cache.atlas import Atlas
from renderer.core import embree as ray
from renderer.core.embree import INVALID_ID, LANES, SceneHandle, intersect16
from renderer.core.kernel import entry
from renderer.path.records import Scratch

_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_ABOVE_M = np.float32(3e-3)
_FARTHEST = np.float32(1.005)


@entry
def find_cuts(scene: SceneHandle, atlas: Atlas, grids: NDArray[np.int32], scratch: Scratch, first: int, end: int) -> None:
    """Fill ``cuts`` of grids [first, end): where the way to the next node, 3 mm above the surface, is blocked.

    ``grids``: (c, 3), first place, width and height.  A way is seen from either end, and a little beyond the other, as a sheet may stand
    on a node; what blocks it stands midway between the two hits.
    """
    packet = scratch.rays
    real, integer, alive = packet.real, packet.integer, packet.alive
    for grid in range(first, end):
        offset, width, height = grids[grid, 0], grids[grid, 1], grids[grid, 2]
        ways = 2 * width * height
        for begin in range(0, ways, LANES // 2):
            count = 0
            for k in range(LANES):
                way = begin + (k >> 1)
                alive[k] = 0
                integer[ray.GEOM_ID + k] = INVALID_ID
                place, upward = way >> 1, way & 1
                if way >= ways or (place // width + 1 >= height if upward else place % width + 1 >= width):
                    continue
                a, b = atlas.grid[offset + place], atlas.grid[offset + place + (width if upward else 1)]
                if a < 0 or b < 0:
                    continue
                if k & 1:
                    a, b = b, a
                for axis in range(3):
                    at = LANES * axis + k
                    real[ray.ORG_X + at] = atlas.position[a, axis] + _ABOVE_M * atlas.normal[a, axis]
                    real[ray.DIR_X + at] = atlas.position[b, axis] - atlas.position[a, axis]
                real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _FARTHEST
                alive[k] = -1
                count += 1
            if count == 0:
                continue
            intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
            scratch.traced[0] += count
            for k in range(0, LANES, 2):
                hence, thence = integer[ray.GEOM_ID + k] != INVALID_ID, integer[ray.GEOM_ID + k + 1] != INVALID_ID
                if hence or thence:
                    way, far = begin + (k >> 1), _ONE - real[ray.TFAR + k + 1]
                    near = real[ray.TFAR + k] if hence else far
                    atlas.cuts[offset + (way >> 1), way & 1] = _HALF * (near + (far if thence else near))
