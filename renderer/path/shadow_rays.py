"""Shadow rays: they wait until 16 are together, are traced, and bring light to their pixels where nothing blocks them.

Blocked light is what the sampled lights would bring to the first hits if nothing stood between, and how much of it something takes away.
Its samples are those of direct light, emitters and infinite light alike, before the surface reflects any of it: black things and mirrors
have shadows as white ones do.  Rays of their own test what stands between, so that colour keeps its bytes.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.embree import SceneHandle, occluded16
from renderer.core.kernel import kernel
from renderer.core.layout import Layout
from renderer.core.packing import pack, pack_slots
from renderer.core.ray_packet import LANES, MEET_ALL, PASS_PANES, Packet, aligned_floats, make_packet
from renderer.path.queues import WAVE, slot_pixel

STRIDE = 2 * LANES
"""From one field to the next: fewer than 16 rays wait, and up to 16 more come."""

_WAITING = Layout(STRIDE)
_ORG = _WAITING.field(3)  # metres, world
_TO_LIGHT = _WAITING.field(3)  # from there to the point on the light
_END = _WAITING.field()  # where the ray ends, in lengths of _TO_LIGHT; infinite where it goes out by a pane
_LI = _WAITING.field(3)  # r, g, b that it brings, cd/m2
_KEPT = _WAITING.field()  # share of it that it adds to the pixel; the rest is clipped
_SIZE = _WAITING.size

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)


class ShadowRays(NamedTuple):
    """Shadow rays that wait, and the packet in which they are traced.

    waiting: float32 by field, ray i at ``waiting[FIELD + i]``; slot: (STRIDE,) int32, the pixel slot of each, WAVE more for a ray whose
    light is direct.
    """

    packet: Packet
    waiting: NDArray[np.float32]
    slot: NDArray[np.int32]


def make_shadow_rays() -> ShadowRays:
    """Return room for shadow rays."""
    return ShadowRays(make_packet(), aligned_floats(_SIZE), np.zeros(STRIDE, np.int32))


@kernel
def push_shadow_rays(lanes: NDArray[np.float32], slots: NDArray[np.int32], direct: bool, shadow_rays: ShadowRays, count: int) -> None:
    """Put the shadow rays of the lanes whose LIGHT_PDF is positive behind the ``count`` that wait; ``direct``: their light is."""
    waiting = shadow_rays.waiting
    for axis in range(3):
        pack(lanes, ln.P_X + LANES * axis, lanes, ln.LIGHT_PDF, waiting, _ORG + STRIDE * axis + count)
        pack(lanes, ln.TO_LIGHT_X + LANES * axis, lanes, ln.LIGHT_PDF, waiting, _TO_LIGHT + STRIDE * axis + count)
        pack(lanes, ln.LI_R + LANES * axis, lanes, ln.LIGHT_PDF, waiting, _LI + STRIDE * axis + count)
    pack(lanes, ln.LIGHT_END, lanes, ln.LIGHT_PDF, waiting, _END + count)
    pack(lanes, ln.KEPT, lanes, ln.LIGHT_PDF, waiting, _KEPT + count)
    pack_slots(slots, lanes, ln.LIGHT_PDF, shadow_rays.slot, count)
    if direct:
        for k in range(LANES):
            shadow_rays.slot[count + k] += WAVE


@kernel
def pop_shadow_rays(shadow_rays: ShadowRays) -> None:
    """Drop the first 16 shadow rays: those behind them move up."""
    waiting = shadow_rays.waiting
    for field in range(0, _SIZE, STRIDE):
        for k in range(LANES):
            waiting[field + k] = waiting[field + LANES + k]
    for k in range(LANES):
        shadow_rays.slot[k] = shadow_rays.slot[LANES + k]


@kernel
def trace_shadow_rays(scene: SceneHandle, shadow_rays: ShadowRays, count: int, light: NDArray[np.float32]) -> None:
    """Trace the first ``count`` shadow rays, and add the light of those that met nothing to ``light`` of the scratch memory."""
    packet, waiting = shadow_rays.packet, shadow_rays.waiting
    real, integer = packet.real, packet.integer
    for k in range(LANES):
        for axis in range(3):
            real[ray.ORG_X + LANES * axis + k] = waiting[_ORG + STRIDE * axis + k]
            real[ray.DIR_X + LANES * axis + k] = waiting[_TO_LIGHT + STRIDE * axis + k]
        end = waiting[_END + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, end
        integer[ray.MASK + k] = PASS_PANES if end > _ONE else MEET_ALL
        packet.alive[k] = -1 if k < count else 0
    occluded16(packet.alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
    # Embree sets the end of a blocked ray to minus infinity.
    for k in range(count):
        if real[ray.TFAR + k] > _ZERO:
            slot, kept = shadow_rays.slot[k] & (WAVE - 1), waiting[_KEPT + k]
            for channel in range(3):
                light[channel * WAVE + slot] += kept * waiting[_LI + channel * STRIDE + k]
            if kept < _ONE:
                for channel in range(3):
                    light[(6 + channel) * WAVE + slot] += (_ONE - kept) * waiting[_LI + channel * STRIDE + k]
            if shadow_rays.slot[k] >= WAVE:
                for channel in range(3):
                    light[(3 + channel) * WAVE + slot] += waiting[_LI + channel * STRIDE + k]


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
