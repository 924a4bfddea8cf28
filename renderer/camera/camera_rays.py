"""Primary rays: packets of 4 x 4 pixels, aimed through a lens.

Those of the ideal pinhole have an optical z of 1, so the distance that Embree returns *is* the depth.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.core.tiles import EDGE

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)


TILE = EDGE
"""Edge of the pixel tile that one packet covers."""


CENTRE = np.zeros(2 * LANES, np.float32)
"""Offsets of rays through pixel centres."""


@inlined
def aim_tile(camera: PosedCamera, column: int, row: int, jitter: NDArray[np.float32], packet: Packet) -> None:
    """Aim 16 rays through the tile whose first pixel is (column, row); lanes where the lens sees nothing are off.

    The optical z of the directions is 1 for planar lenses; the others' directions have unit length but for rounding.  ``jitter``: (32,)
    float32, offsets from the pixel centres in pixels, u of 16 lanes, then v.
    """
    real, integer, alive, r = packet.real, packet.integer, packet.alive, camera.rotation
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    x0, y0, z0 = camera.position[0], camera.position[1], camera.position[2]
    scale = _ONE / camera.focal_px
    left = np.float32(column) + _HALF - _HALF * np.float32(camera.width)
    top = np.float32(row) + _HALF - _HALF * np.float32(camera.height)
    for k in range(LANES):
        x = (left + np.float32(k & 3) + jitter[k]) * scale
        y = (top + np.float32(k >> 2) + jitter[LANES + k]) * scale
        real[ray.ORG_X + k] = x0
        real[ray.ORG_Y + k] = y0
        real[ray.ORG_Z + k] = z0
        real[ray.TNEAR + k] = _ZERO
        real[ray.DIR_X + k] = r00 * x + r01 * y + r02
        real[ray.DIR_Y + k] = r10 * x + r11 * y + r12
        real[ray.DIR_Z + k] = r20 * x + r21 * y + r22
        real[ray.TFAR + k] = np.inf
        real[ray.NG_X + k] = _ZERO
        real[ray.NG_Y + k] = _ZERO
        real[ray.NG_Z + k] = _ZERO
        integer[ray.GEOM_ID + k] = INVALID_ID
        alive[k] = -1
    if len(camera.bearings):
        _bend_tile(camera, column, row, jitter, packet)


@kernel
def _bend_tile(camera: PosedCamera, column: int, row: int, jitter: NDArray[np.float32], packet: Packet) -> None:
    """Replace the directions of a tile by those of the lens's table; within a pixel they follow the differences of its neighbours."""
    real, r, table = packet.real, camera.rotation, camera.bearings
    for k in range(LANES):
        i, j = min(row + (k >> 2), camera.height - 1) + 1, min(column + (k & 3), camera.width - 1) + 1
        s, t = _HALF * jitter[k], _HALF * jitter[LANES + k]
        x, y, z = table[i, j, 0], table[i, j, 1], table[i, j, 2]
        if s != _ZERO or t != _ZERO:
            x += s * _step(table[i, j - 1, 0], x, table[i, j + 1, 0]) + t * _step(table[i - 1, j, 0], x, table[i + 1, j, 0])
            y += s * _step(table[i, j - 1, 1], y, table[i, j + 1, 1]) + t * _step(table[i - 1, j, 1], y, table[i + 1, j, 1])
            z += s * _step(table[i, j - 1, 2], z, table[i, j + 1, 2]) + t * _step(table[i - 1, j, 2], z, table[i + 1, j, 2])
        seen = x * x + y * y + z * z > _ZERO
        packet.alive[k] = -1 if seen else 0
        x, y, z = (x, y, z) if seen else (_ZERO, _ZERO, _ONE)
        for axis in range(3):
            real[ray.DIR_X + LANES * axis + k] = r[axis, 0] * x + r[axis, 1] * y + r[axis, 2] * z


@kernel
def _step(before: np.float32, here: np.float32, after: np.float32) -> np.float32:
    """Return the change over two pixels, from one side only where the lens sees nothing on the other."""
    left: np.float32 = here - before
    right: np.float32 = after - here
    left, right = (right if np.isnan(left) else left), (left if np.isnan(right) else right)
    return _ZERO if np.isnan(left + right) else left + right
