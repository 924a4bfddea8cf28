"""Next events: a point on a light is drawn at a hit, and a shadow ray tells whether it is seen.

The ray that continues the path may find the same light; both estimate it, so they share it by the balance heuristic (Veach 1997, section
9.2).  Shadow rays wait in a packet until 16 are together.  Glass blocks them: light behind glass is found by the paths that go through it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf import evaluate
from renderer.embree import DIR_X, LANES, ORG_X, TFAR, TNEAR, SceneHandle, occluded16
from renderer.kernel import inlined, kernel
from renderer.lights import Lights, clamp_unit, find_emitter, importance, load_bounds, spread_over_triangle
from renderer.outside import draw_toward, hot_toward, pane_ahead
from renderer.records import (
    DENSITY,
    DRAW_LIGHT_U,
    DRAW_LIGHT_V,
    DRAW_SUN_U,
    DRAW_SUN_V,
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
    REFLECTS,
    SHADE_X,
    SHADE_Y,
    SHADE_Z,
    SIDE_X,
    SIDE_Y,
    SIDE_Z,
    TOTAL,
    WAVE,
    WAY_X,
    WAY_Y,
    WAY_Z,
    WEIGHT_B,
    WEIGHT_G,
    WEIGHT_R,
    Scratch,
    Surfaces,
)
from renderer.surfaces import emitted_luminance, lift_height, pane_through

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_NEAR, _GRAZING = np.float32(2.25), np.float32(0.01)


@kernel
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
def _draw_group(scratch: Scratch, k: int, group_count: int) -> tuple[int, np.float32]:
    """Return the group that lane k's random number falls on, and where within its share, in [0, 1)."""
    left = scratch.lanes[DRAW_LIGHT_U + k] * scratch.lanes[TOTAL + k]
    last = 0
    for g in range(group_count):
        share = scratch.shares[g * LANES + k]
        if share > _ZERO:
            last = g
            if left < share:
                break
            left -= share
    return last, clamp_unit(left / scratch.shares[last * LANES + k])


@kernel
def meet_lights(
    scene: SceneHandle, surfaces: Surfaces, lights: Lights, scratch: Scratch, kinds: int, limit: np.float32, waiting: int
) -> int:
    """Draw light for all lanes and put rays to it behind the ``waiting`` ones; return how many wait then.

    ``kinds``: of the packet (:mod:`renderer.closure`).  ``limit``: most that each channel of one light may bring.
    """
    lanes = scratch.lanes
    for k in range(LANES):
        lanes[LIGHT_CHANCE + k] = _ZERO
        if lanes[REFLECTS + k] > _ZERO and lanes[TOTAL + k] > _ZERO:
            _aim_at_light(surfaces, lights, scratch, k)
    waiting = _send_shadows(scene, surfaces, scratch, kinds, limit, waiting)
    if len(lights.outside.part) > 0:
        for k in range(LANES):
            lanes[LIGHT_CHANCE + k] = _ZERO
            if lanes[REFLECTS + k] > _ZERO and lanes[TOTAL + k] > _ZERO:
                _aim_outside(surfaces, lights, lanes, k)
        waiting = _send_shadows(scene, surfaces, scratch, kinds, limit, waiting)
    return waiting


@inlined
def _aim_at_light(surfaces: Surfaces, lights: Lights, scratch: Scratch, k: int) -> None:
    """Fill LIGHT of lane k with a point on a light, drawn by importance; LIGHT_CHANCE stays 0 where it brings none."""
    lanes, groups = scratch.lanes, lights.groups
    group, within = _draw_group(scratch, k, len(groups.area))
    e, within = find_emitter(lights, group, within)
    s, t = spread_over_triangle(within, lanes[DRAW_LIGHT_V + k])
    nx, ny, nz = lights.normal[e, 0], lights.normal[e, 1], lights.normal[e, 2]
    x = lights.corner[e, 0] + s * lights.edge_1[e, 0] + t * lights.edge_2[e, 0]
    y = lights.corner[e, 1] + s * lights.edge_1[e, 1] + t * lights.edge_2[e, 1]
    z = lights.corner[e, 2] + s * lights.edge_1[e, 2] + t * lights.edge_2[e, 2]
    lift = lift_height(x, y, z)
    dx, dy, dz = x + lift * nx - lanes[POINT_X + k], y + lift * ny - lanes[POINT_Y + k], z + lift * nz - lanes[POINT_Z + k]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    scale = _ONE / max(distance, _TINY)
    at_light = -(dx * nx + dy * ny + dz * nz) * scale
    if at_light <= _ZERO or not _rises(lanes, k, dx, dy, dz):
        return
    share = scratch.shares[group * LANES + k] / lanes[TOTAL + k]
    lanes[LIGHT_CHANCE + k] = share * distance * distance / (groups.area[group] * at_light)
    lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k] = dx, dy, dz
    r, g, b = emitted_luminance(surfaces, lights.part[e], dx * scale, dy * scale, dz * scale, at_light)
    lanes[LIGHT_R + k], lanes[LIGHT_G + k], lanes[LIGHT_B + k] = r, g, b


@inlined
def _aim_outside(surfaces: Surfaces, lights: Lights, lanes: NDArray[np.float32], k: int) -> None:
    """Fill LIGHT of lane k with a direction to the sun, or to a bright part of the environment, as :func:`_aim_at_light` does for lights.

    Where no pane lies that way nothing comes in, and no ray is traced.
    """
    outside = lights.outside
    dx, dy, dz = draw_toward(outside, lanes[DRAW_SUN_U + k], lanes[DRAW_SUN_V + k])
    if not _rises(lanes, k, dx, dy, dz):
        return
    pane, distance = pane_ahead(outside, lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k], dx, dy, dz)
    if pane < 0:
        return
    r, g, b, chance = hot_toward(outside, dx, dy, dz)
    row = outside.panes[pane]
    facing = -(dx * row[9] + dy * row[10] + dz * row[11])
    through = pane_through(surfaces, outside.part[pane], facing)
    # Shadow rays end as far before the pane as they begin off their own surface.
    reach = max(distance - lift_height(row[0], row[1], row[2]) / max(facing, _GRAZING), _TINY)
    lanes[LIGHT_CHANCE + k] = chance
    lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k] = reach * dx, reach * dy, reach * dz
    lanes[LIGHT_R + k], lanes[LIGHT_G + k], lanes[LIGHT_B + k] = through * r, through * g, through * b


@inlined
def _rises(lanes: NDArray[np.float32], k: int, dx: np.float32, dy: np.float32, dz: np.float32) -> bool:
    """Return whether a way leaves lane k's surface on the viewer's side, by both of its normals."""
    shading = dx * lanes[SHADE_X + k] + dy * lanes[SHADE_Y + k] + dz * lanes[SHADE_Z + k]
    true = dx * lanes[SIDE_X + k] + dy * lanes[SIDE_Y + k] + dz * lanes[SIDE_Z + k]
    return bool((shading > _ZERO) & (true > _ZERO))


@kernel
def _send_shadows(scene: SceneHandle, surfaces: Surfaces, scratch: Scratch, kinds: int, limit: np.float32, waiting: int) -> int:
    """Weigh what LIGHT brings to the lanes where its chance is not 0, and let its shadow rays wait; return how many do."""
    lanes, shadows = scratch.lanes, scratch.shadows
    _turn_to_lights(lanes)
    evaluate(lanes, kinds, surfaces)
    _weigh_light(lanes, limit)
    real, pending = shadows.packet.real, shadows.pending
    for k in range(LANES):
        r, g, b = lanes[LIGHT_R + k], lanes[LIGHT_G + k], lanes[LIGHT_B + k]
        if not lanes[LIGHT_CHANCE + k] > _ZERO or not r + g + b > _ZERO:
            continue
        if waiting == LANES:
            cast_shadows(scene, scratch, waiting)
            waiting = 0
        pending[waiting], pending[LANES + waiting], pending[2 * LANES + waiting] = r, g, b
        for field in range(0, 3 * LANES, LANES):
            real[ORG_X + field + waiting] = lanes[POINT_X + field + k]
            real[DIR_X + field + waiting] = lanes[LIGHT_X + field + k]
        real[TNEAR + waiting], real[TFAR + waiting] = _ZERO, _ONE
        shadows.slot[waiting] = scratch.lane_slot[k]
        waiting += 1
    return waiting


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
    """Replace luminance by what it brings to the pixel; where a ray follows that can find the same light, both share it."""
    for k in range(LANES):
        gain = _ONE / (lanes[LIGHT_CHANCE + k] + lanes[FOLLOWS + k] * lanes[DENSITY + k])
        r = gain * lanes[LIGHT_R + k] * lanes[OUT_R + k] * lanes[WEIGHT_R + k]
        g = gain * lanes[LIGHT_G + k] * lanes[OUT_G + k] * lanes[WEIGHT_G + k]
        b = gain * lanes[LIGHT_B + k] * lanes[OUT_B + k] * lanes[WEIGHT_B + k]
        most = r if r > g else g
        most = most if most > b else b
        keep = limit / most if most > limit else _ONE
        lanes[LIGHT_R + k], lanes[LIGHT_G + k], lanes[LIGHT_B + k] = r * keep, g * keep, b * keep


@kernel
def cast_shadows(scene: SceneHandle, scratch: Scratch, count: int) -> None:
    """Trace the first ``count`` shadow rays that wait, and gather the light of those that found nothing in their way."""
    shadows, light = scratch.shadows, scratch.light
    packet = shadows.packet
    for k in range(LANES):
        packet.alive[k] = -1 if k < count else 0
    occluded16(packet.alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.incoherent)
    for k in range(count):
        if packet.real[TFAR + k] > _ZERO:
            slot = shadows.slot[k]
            for channel in range(3):
                light[channel * WAVE + slot] += shadows.pending[channel * LANES + k]
