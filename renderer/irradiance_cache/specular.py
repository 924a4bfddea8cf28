"""Surfaces that rays of the cache go on from as if they were smooth: clear glass, straight through it and tinted, and mirrors."""

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.embree import intersect16, occluded16
from renderer.core.kernel import inlined
from renderer.core.ray_packet import INVALID_ID, LANES, MEET_ALL, PASS_PANES, Packet
from renderer.path import surface_tables as st
from renderer.path.records import LitScene, Scratch

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
SMOOTH = np.float32(0.15)
"""Roughness below which metal is a mirror."""
_CLEAR_M = np.float32(1e-4)
_DEEPEST = 8
"""Most faces of glass that a shadow ray passes."""


@inlined
def is_clear(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is glass, panes apart."""
    clear: bool = (materials[row + st.TRANSMISSION] > st.CLEAR) & (materials[row + st.PORTAL] == _ZERO)
    return clear


@inlined
def clear_share(materials: NDArray[np.float32], row: int, channel: int) -> np.float32:
    """Return what of a channel's light goes on through one face of the clear glass whose material begins at ``row``.

    Two faces have the colour of the glass; as much as is opaque, and what is mirrored about, does not go on.
    """
    share: np.float32 = np.sqrt(materials[row + st.BASE + channel]) * materials[row + st.TRANSMISSION] * np.float32(0.96)
    return share


@inlined
def scattered_share(materials: NDArray[np.float32], row: int, channel: int, opaque: np.float32) -> np.float32:
    """Return what the front of clear glass mirrors and scatters of a channel's light, over all that does not go on through it.

    ``opaque``: what it reflects of light by all that is not glass.
    """
    reflected = opaque + np.float32(0.04) * materials[row + st.TRANSMISSION]
    return min(reflected / max(_ONE - clear_share(materials, row, channel), _TINY), _ONE)


@inlined
def is_mirror(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is smooth metal."""
    mirror: bool = (materials[row + st.METALLIC] > _HALF) & (materials[row + st.ROUGHNESS] < SMOOTH)
    return mirror


@inlined
def is_brushed(materials: NDArray[np.float32], row: int) -> bool:
    """Return whether the part whose material begins at ``row`` is metal that scatters light about where it would mirror it."""
    brushed: bool = (materials[row + st.METALLIC] > _HALF) & (materials[row + st.ROUGHNESS] >= SMOOTH)
    return brushed


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


@inlined
def _meets_box(boxes: NDArray[np.float32], packet: Packet, k: int) -> bool:
    """Return whether the line of ray k meets one of some boxes (n, 6)."""
    real = packet.real
    for i in range(len(boxes)):
        near, far = _ZERO, np.float32(np.inf)
        for axis in range(3):
            per = _ONE / real[ray.DIR_X + LANES * axis + k]
            origin = real[ray.ORG_X + LANES * axis + k]
            a, b = (boxes[i, axis] - origin) * per, (boxes[i, 3 + axis] - origin) * per
            first, last = (a, b) if a < b else (b, a)
            near, far = first if first > near else near, last if last < far else far
        if near <= far:
            return True
    return False


@inlined
def pass_glass(scene: LitScene, scratch: Scratch) -> None:
    """Trace shadow rays from P along TO_LIGHT; where something other than clear glass stands between, LIGHT_PDF becomes 0.

    Glass takes its colour from LI.
    """
    lanes, surfaces, packet = scratch.lanes, scene.surfaces, scratch.shadow_rays.packet
    real, integer, alive = packet.real, packet.integer, packet.alive
    for k in range(LANES):
        for axis in range(0, 3 * LANES, LANES):
            real[ray.ORG_X + axis + k], real[ray.DIR_X + axis + k] = lanes[ln.P_X + axis + k], lanes[ln.TO_LIGHT_X + axis + k]
        end = lanes[ln.LIGHT_END + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, end
        integer[ray.MASK + k] = PASS_PANES if end > _ONE else MEET_ALL
        alive[k] = -1 if lanes[ln.LIGHT_PDF + k] > _ZERO else 0
    occluded16(alive.ctypes.data, scene.tree.address, real.ctypes.data, scene.tree.incoherent)
    scratch.traced[0] += LANES
    waiting = 0
    for k in range(LANES):
        blocked = (alive[k] != 0) & (real[ray.TFAR + k] < _ZERO)
        glazed = blocked and _meets_box(surfaces.glass_boxes, packet, k)
        if blocked and not glazed:
            lanes[ln.LIGHT_PDF + k] = _ZERO
        alive[k] = -1 if glazed else 0
        waiting += glazed
        real[ray.TFAR + k], integer[ray.GEOM_ID + k] = lanes[ln.LIGHT_END + k], INVALID_ID
    # What is blocked may be so by clear glass where there is any: it is traced on from face to face.
    for _ in range(_DEEPEST):
        if waiting == 0:
            break
        intersect16(alive.ctypes.data, scene.tree.address, real.ctypes.data, scene.tree.incoherent)
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
                    lanes[ln.LI_R + channel * LANES + k] *= clear_share(surfaces.materials, row, channel)
                real[ray.TNEAR + k] = real[ray.TFAR + k] + np.float32(1e-5)
                real[ray.TFAR + k], integer[ray.GEOM_ID + k] = lanes[ln.LIGHT_END + k], INVALID_ID
                waiting += 1
            else:
                lanes[ln.LIGHT_PDF + k] = _ZERO
                alive[k] = 0
    for k in range(LANES):
        if alive[k] != 0:
            lanes[ln.LIGHT_PDF + k] = _ZERO
