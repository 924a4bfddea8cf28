"""Next events: a point on a light is drawn at a hit, and a shadow ray tells whether it is seen.

The ray that continues the path may find the same light; both estimate it, so they share it by the balance heuristic (Veach 1997, section
9.2).  Shadow rays wait in a packet until 16 are together.  Glass blocks them: light behind glass is found by the paths that go through it.
"""

from __future__ import annotations

import numpy as np

from renderer.bsdf import Closure, evaluate
from renderer.embree import DIR_X, DIR_Y, DIR_Z, LANES, ORG_X, ORG_Y, ORG_Z, TFAR, TNEAR, SceneHandle, occluded16
from renderer.kernel import inlined, kernel
from renderer.lights import Lights, clamp_unit, find_emitter, importance, load_bounds, spread_over_triangle
from renderer.microfacet import frame_about
from renderer.outside import draw_toward, hot_toward, pane_ahead
from renderer.records import (
    DRAW_LIGHT_U,
    DRAW_LIGHT_V,
    DRAW_SUN_U,
    DRAW_SUN_V,
    NEAR,
    POINT_X,
    POINT_Y,
    POINT_Z,
    SHADE_X,
    SHADE_Y,
    SHADE_Z,
    SIDE_X,
    SIDE_Y,
    SIDE_Z,
    TOTAL,
    WAVE,
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


@inlined
def aim_at_light(
    surfaces: Surfaces, lights: Lights, scratch: Scratch, closure: Closure, k: int, shared: bool, limit: np.float32, count: int
) -> int:
    """Draw a point on a light for lane k; where it would bring light, put its ray behind the ``count`` that wait, and return the new count.

    ``shared``: whether a ray will follow that can find the same light.  ``limit``: most that each channel may bring.
    """
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
    ax, ay, az = lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k]
    at_surface = (dx * ax + dy * ay + dz * az) * scale
    above = dx * lanes[SIDE_X + k] + dy * lanes[SIDE_Y + k] + dz * lanes[SIDE_Z + k]
    if at_light <= _ZERO or at_surface <= _ZERO or above <= _ZERO:
        return count
    ux, uy, uz, vx, vy, vz = frame_about(ax, ay, az)
    r, g, b, density = evaluate(closure, surfaces, (dx * ux + dy * uy + dz * uz) * scale, (dx * vx + dy * vy + dz * vz) * scale, at_surface)
    share = scratch.shares[group * LANES + k] / lanes[TOTAL + k]
    chance = share * distance * distance / (groups.area[group] * at_light)
    gain = _ONE / (chance + density if shared else chance)
    shine_r, shine_g, shine_b = emitted_luminance(surfaces, lights.part[e], dx * scale, dy * scale, dz * scale, at_light)
    return _await_light(scratch, k, limit, count, r * gain * shine_r, g * gain * shine_g, b * gain * shine_b, dx, dy, dz)


@inlined
def aim_outside(
    surfaces: Surfaces, lights: Lights, scratch: Scratch, closure: Closure, k: int, shared: bool, limit: np.float32, count: int
) -> int:
    """Draw a direction to the sun, or to a bright part of the environment, for lane k, as :func:`aim_at_light` does for lights.

    Where no pane lies that way nothing comes in, and no ray is traced.
    """
    lanes, outside = scratch.lanes, lights.outside
    dx, dy, dz = draw_toward(outside, lanes[DRAW_SUN_U + k], lanes[DRAW_SUN_V + k])
    ax, ay, az = lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k]
    at_surface = dx * ax + dy * ay + dz * az
    if at_surface <= _ZERO or dx * lanes[SIDE_X + k] + dy * lanes[SIDE_Y + k] + dz * lanes[SIDE_Z + k] <= _ZERO:
        return count
    pane, distance = pane_ahead(outside, lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k], dx, dy, dz)
    if pane < 0:
        return count
    hot_r, hot_g, hot_b, chance = hot_toward(outside, dx, dy, dz)
    if not chance > _ZERO:
        return count
    row = outside.panes[pane]
    through = pane_through(surfaces, outside.part[pane], -(dx * row[9] + dy * row[10] + dz * row[11]))
    ux, uy, uz, vx, vy, vz = frame_about(ax, ay, az)
    r, g, b, density = evaluate(closure, surfaces, dx * ux + dy * uy + dz * uz, dx * vx + dy * vy + dz * vz, at_surface)
    gain = through / (chance + density if shared else chance)
    # Shadow rays end as far before the pane as they begin off their own surface.
    reach = max(distance - lift_height(row[0], row[1], row[2]) / max(-(dx * row[9] + dy * row[10] + dz * row[11]), _GRAZING), _TINY)
    return _await_light(scratch, k, limit, count, r * gain * hot_r, g * gain * hot_g, b * gain * hot_b, reach * dx, reach * dy, reach * dz)


@inlined
def _await_light(
    scratch: Scratch,
    k: int,
    limit: np.float32,
    count: int,
    r: np.float32,
    g: np.float32,
    b: np.float32,
    dx: np.float32,
    dy: np.float32,
    dz: np.float32,
) -> int:
    """Put light (r, g, b) times lane k's weight behind the ``count`` that wait for their shadow rays, and return the new count."""
    lanes, shadows = scratch.lanes, scratch.shadows
    r, g, b = r * lanes[WEIGHT_R + k], g * lanes[WEIGHT_G + k], b * lanes[WEIGHT_B + k]
    most = max(r, g, b)
    if not most > _ZERO:
        return count
    keep = min(_ONE, limit / most)
    real, pending = shadows.packet.real, shadows.pending
    pending[count], pending[LANES + count], pending[2 * LANES + count] = r * keep, g * keep, b * keep
    real[ORG_X + count], real[ORG_Y + count], real[ORG_Z + count] = lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k]
    real[DIR_X + count], real[DIR_Y + count], real[DIR_Z + count] = dx, dy, dz
    real[TNEAR + count], real[TFAR + count] = _ZERO, _ONE
    shadows.slot[count] = scratch.lane_slot[k]
    return count + 1


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
