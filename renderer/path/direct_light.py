"""Next events: a point on a light is drawn at a hit, and a shadow ray tells whether it is seen.

The ray that continues the path may find the same light; both estimate it, so they share it by the balance heuristic (Veach 1997, section
9.2).  Shadow rays wait in a packet until 16 are together.  Glass blocks them: light behind glass is found by the paths that go through it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.bsdf import evaluate
from renderer.core.embree import DIR_X, LANES, ORG_X, TFAR, TNEAR, SceneHandle, occluded16
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import (
    DENSITY,
    FOLLOWS,
    FRAME_UX,
    FRAME_UY,
    FRAME_UZ,
    FRAME_VX,
    FRAME_VY,
    FRAME_VZ,
    LIGHT_B,
    LIGHT_CHANCE,
    LIGHT_G,
    LIGHT_R,
    LIGHT_X,
    LIGHT_Y,
    LIGHT_Z,
    NEAR,
    OUT_B,
    OUT_G,
    OUT_R,
    POINT_X,
    POINT_Y,
    POINT_Z,
    SHADE_X,
    SHADE_Y,
    SHADE_Z,
    TOTAL,
    WAY_X,
    WAY_Y,
    WAY_Z,
    WEIGHT_B,
    WEIGHT_G,
    WEIGHT_R,
    count_chosen,
)
from renderer.core.packing import pack, pack_slots
from renderer.path.lights import Lights, importance, load_bounds
from renderer.path.records import STAGED, STAGED_LIGHT, STAGED_ORG, STAGED_SIZE, STAGED_WAY, WAVE, Scratch, Shadows, Surfaces

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_NEAR = np.float32(2.25)


@inlined
def weigh_lights(lights: Lights, scratch: Scratch) -> None:
    """Fill the importance of every group of lights for every lane, their sums, and how many groups each lane is near to."""
    lanes, shares = scratch.lanes, scratch.shares
    for k in range(LANES):
        lanes[TOTAL + k] = _ZERO
        lanes[NEAR + k] = _ZERO
    for g in range(len(lights.groups.area)):
        bounds = load_bounds(lights.groups, g)
        reach = _NEAR * bounds[3] * bounds[3]
        row = shares[g * LANES : (g + 1) * LANES]
        for k in range(LANES):
            x, y, z = lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k]
            value = importance(bounds, x, y, z, lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k])
            cx, cy, cz = x - bounds[0], y - bounds[1], z - bounds[2]
            near = (cx * cx + cy * cy + cz * cz < reach) & (value > _ZERO)
            lanes[NEAR + k] += _ONE if near else _ZERO
            row[k] = value
            lanes[TOTAL + k] += value


@inlined
def send_shadows(scene: SceneHandle, surfaces: Surfaces, kinds: int, limit: np.float32, waiting: int, scratch: Scratch) -> int:
    """Put rays to the lights that the lanes have drawn behind the ``waiting`` ones; return how many wait then.

    ``kinds``: of the packet (:mod:`renderer.bsdf.closure`).  ``limit``: most that each channel of one light may bring.
    """
    lanes, shadows = scratch.lanes, scratch.shadows
    _turn_to_lights(lanes)
    evaluate(lanes, kinds, surfaces.albedos.reflected)
    _weigh_light(lanes, limit)
    _line_up(lanes, scratch.lane_slot, shadows, waiting)
    waiting += count_chosen(lanes, LIGHT_CHANCE)
    if waiting < LANES:
        return waiting
    cast_shadows(scene, shadows, LANES, scratch.light)
    scratch.traced[0] += LANES
    _move_up(shadows)
    return waiting - LANES


@kernel
def _line_up(lanes: NDArray[np.float32], slots: NDArray[np.int32], shadows: Shadows, waiting: int) -> None:
    """Put the shadow rays of the lanes that have light behind those that wait."""
    staged = shadows.staged
    for axis in range(3):
        pack(lanes, POINT_X + LANES * axis, lanes, LIGHT_CHANCE, staged, STAGED_ORG + STAGED * axis + waiting)
        pack(lanes, LIGHT_X + LANES * axis, lanes, LIGHT_CHANCE, staged, STAGED_WAY + STAGED * axis + waiting)
        pack(lanes, LIGHT_R + LANES * axis, lanes, LIGHT_CHANCE, staged, STAGED_LIGHT + STAGED * axis + waiting)
    pack_slots(slots, lanes, LIGHT_CHANCE, shadows.slot, waiting)


@kernel
def _move_up(shadows: Shadows) -> None:
    """Let the waiting rays behind the first 16 take their places."""
    staged = shadows.staged
    for field in range(0, STAGED_SIZE, STAGED):
        for k in range(LANES):
            staged[field + k] = staged[field + LANES + k]
    for k in range(LANES):
        shadows.slot[k] = shadows.slot[LANES + k]


@kernel
def _turn_to_lights(lanes: NDArray[np.float32]) -> None:
    """Fill WAY with the directions to LIGHT."""
    for k in range(LANES):
        x, y, z = lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k]
        squared = x * x + y * y + z * z
        scale = _ONE / np.sqrt(squared if squared > _TINY else _TINY)
        x, y, z = x * scale, y * scale, z * scale
        lanes[WAY_X + k] = x * lanes[FRAME_UX + k] + y * lanes[FRAME_UY + k] + z * lanes[FRAME_UZ + k]
        lanes[WAY_Y + k] = x * lanes[FRAME_VX + k] + y * lanes[FRAME_VY + k] + z * lanes[FRAME_VZ + k]
        lanes[WAY_Z + k] = x * lanes[SHADE_X + k] + y * lanes[SHADE_Y + k] + z * lanes[SHADE_Z + k]


@kernel
def _weigh_light(lanes: NDArray[np.float32], limit: np.float32) -> None:
    """Replace luminance by what it brings to the pixel; where a ray follows that can find the same light, both share it.

    Where it brings nothing LIGHT_CHANCE becomes 0.
    """
    for k in range(LANES):
        gain = _ONE / (lanes[LIGHT_CHANCE + k] + lanes[FOLLOWS + k] * lanes[DENSITY + k])
        r = gain * lanes[LIGHT_R + k] * lanes[OUT_R + k] * lanes[WEIGHT_R + k]
        g = gain * lanes[LIGHT_G + k] * lanes[OUT_G + k] * lanes[WEIGHT_G + k]
        b = gain * lanes[LIGHT_B + k] * lanes[OUT_B + k] * lanes[WEIGHT_B + k]
        most = r if r > g else g
        most = most if most > b else b
        keep = limit / most if most > limit else _ONE
        lanes[LIGHT_R + k], lanes[LIGHT_G + k], lanes[LIGHT_B + k] = r * keep, g * keep, b * keep
        lanes[LIGHT_CHANCE + k] = lanes[LIGHT_CHANCE + k] if most > _ZERO else _ZERO


@kernel
def cast_shadows(scene: SceneHandle, shadows: Shadows, count: int, light: NDArray[np.float32]) -> None:
    """Trace the first ``count`` shadow rays that wait, and add the light of those that found nothing in their way to ``light``, by slot."""
    packet, staged = shadows.packet, shadows.staged
    real = packet.real
    for k in range(LANES):
        for axis in range(3):
            real[ORG_X + LANES * axis + k] = staged[STAGED_ORG + STAGED * axis + k]
            real[DIR_X + LANES * axis + k] = staged[STAGED_WAY + STAGED * axis + k]
        real[TNEAR + k], real[TFAR + k] = _ZERO, _ONE
        packet.alive[k] = -1 if k < count else 0
    occluded16(packet.alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
    for k in range(count):
        if real[TFAR + k] > _ZERO:
            slot = shadows.slot[k]
            for channel in range(3):
                light[channel * WAVE + slot] += staged[STAGED_LIGHT + channel * STAGED + k]
