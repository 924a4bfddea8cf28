"""Surfaces that rays of the cache go on from as if they were smooth: clear glass, straight through it, and mirrors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core import embree as ray
from renderer.core.embree import INVALID_ID, Packet
from renderer.core.kernel import inlined
from renderer.path import surface_tables as st

_ZERO, _HALF, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(2.0), np.float32(1e-20)
_SMOOTH, _CLEAR_M = np.float32(0.15), np.float32(1e-4)


@inlined
def is_clear(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is glass, panes apart."""
    clear: bool = (materials[row + st.TRANSMISSION] > _HALF) & (materials[row + st.PORTAL] == _ZERO)
    return clear


@inlined
def is_mirror(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is smooth metal."""
    mirror: bool = (materials[row + st.METALLIC] > _HALF) & (materials[row + st.ROUGHNESS] < _SMOOTH)
    return mirror


@inlined
def go_on(packet: Packet, k: int, mirror: bool) -> None:
    """Send ray k on from its hit, mirrored or straight, to be traced again."""
    real = packet.real
    if mirror:
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
        scale = -_TWO * (dx * nx + dy * ny + dz * nz) / max(nx * nx + ny * ny + nz * nz, _TINY)
        t = real[ray.TFAR + k]
        real[ray.ORG_X + k] += t * dx
        real[ray.ORG_Y + k] += t * dy
        real[ray.ORG_Z + k] += t * dz
        real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx + scale * nx, dy + scale * ny, dz + scale * nz
        real[ray.TNEAR + k] = _CLEAR_M
    else:
        real[ray.TNEAR + k] = real[ray.TFAR + k] + _CLEAR_M
    real[ray.TFAR + k] = np.inf
    packet.integer[ray.GEOM_ID + k] = INVALID_ID
    packet.alive[k] = -1
