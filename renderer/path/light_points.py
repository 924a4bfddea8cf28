"""Points on lights, drawn for the hits of a packet: a group of lights by importance, a triangle of it by area, a point on that evenly.

Each step goes over all lanes before the next begins, so that LLVM turns it into vector code, table look-ups included.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import LANES
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import (
    DRAW_LIGHT_U,
    DRAW_LIGHT_V,
    DRAW_SUN_U,
    DRAW_SUN_V,
    DRAWN_FOUND,
    DRAWN_LEFT,
    DRAWN_SHARE,
    LIGHT_B,
    LIGHT_CHANCE,
    LIGHT_G,
    LIGHT_R,
    LIGHT_X,
    LIGHT_Y,
    LIGHT_Z,
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
    lane_count,
)
from renderer.path.lights import (
    BY_PROFILE,
    BY_SKY,
    EMITTER_AREA,
    EMITTER_CORNER,
    EMITTER_EDGE_1,
    EMITTER_EDGE_2,
    EMITTER_GLOW,
    EMITTER_NORMAL,
    EMITTER_SIZE,
    Lights,
    clamp_unit,
    find_emitter,
    spread_over_triangle,
)
from renderer.path.outside import Outside, draw_toward, hot_toward, sky_color
from renderer.path.records import Scratch, Surfaces
from renderer.path.surfaces import emitted_luminance, lift_height, pane_through

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_GRAZING, _INFINITE = np.float32(0.01), np.float32(np.inf)


@inlined
def aim_at_lights(surfaces: Surfaces, lights: Lights, scratch: Scratch) -> None:
    """Fill LIGHT of all lanes with points on lights, drawn by importance; LIGHT_CHANCE is 0 where they bring nothing."""
    lanes, drawn = scratch.lanes, scratch.drawn
    if len(lights.part) == 0:
        for k in range(LANES):
            lanes[LIGHT_CHANCE + k] = _ZERO
        return
    _draw_groups(scratch.shares, len(lights.groups.area), lanes, drawn)
    _draw_points(lights, lanes, drawn)
    by_sky = by_profile = 0
    for k in range(LANES):
        kind = lights.varies[drawn[k]]
        by_sky += kind == BY_SKY
        by_profile += kind == BY_PROFILE
    if by_sky > 0:
        _see_sky(surfaces, lights, lanes, drawn)
    if by_profile > 0:
        _see_profiles(surfaces, lights, lanes, drawn)


@inlined
def _see_sky(surfaces: Surfaces, lights: Lights, lanes: NDArray[np.float32], drawn: NDArray[np.int32]) -> None:
    """Write the luminance that panes let through into LIGHT of the lanes whose point lies on one."""
    for k in range(lane_count(lanes)):
        e = drawn[k]
        dx, dy, dz, at_light = _turn_to_emitter(lights, lanes, k, e)
        through = pane_through(surfaces, lights.part[e], at_light)
        r, g, b = sky_color(surfaces.sky, dx, dy, dz)
        pane = lights.varies[e] == BY_SKY
        lanes[LIGHT_R + k] = through * r if pane else lanes[LIGHT_R + k]
        lanes[LIGHT_G + k] = through * g if pane else lanes[LIGHT_G + k]
        lanes[LIGHT_B + k] = through * b if pane else lanes[LIGHT_B + k]


@inlined
def _see_profiles(surfaces: Surfaces, lights: Lights, lanes: NDArray[np.float32], drawn: NDArray[np.int32]) -> None:
    """Write luminance into LIGHT of the lanes whose point lies on a lamp with a profile."""
    for k in range(LANES):
        e = drawn[k]
        if lights.varies[e] == BY_PROFILE:
            dx, dy, dz, at_light = _turn_to_emitter(lights, lanes, k, e)
            r, g, b = emitted_luminance(surfaces, lights.part[e], dx, dy, dz, at_light)
            lanes[LIGHT_R + k], lanes[LIGHT_G + k], lanes[LIGHT_B + k] = r, g, b


@inlined
def _turn_to_emitter(
    lights: Lights, lanes: NDArray[np.float32], k: int, e: np.int32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return the unit direction from lane k to the point on emitter e, and the cosine there."""
    dx, dy, dz = lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k]
    squared = dx * dx + dy * dy + dz * dz
    scale = _ONE / np.sqrt(squared if squared > _TINY else _TINY)
    dx, dy, dz = dx * scale, dy * scale, dz * scale
    normal = EMITTER_SIZE * e + EMITTER_NORMAL
    return dx, dy, dz, -(dx * lights.emitters[normal] + dy * lights.emitters[normal + 1] + dz * lights.emitters[normal + 2])


@kernel
def _draw_groups(shares: NDArray[np.float32], group_count: int, lanes: NDArray[np.float32], drawn: NDArray[np.int32]) -> None:
    """Write the groups that the lanes' random numbers fall on into ``drawn``, and DRAWN."""
    for k in range(lane_count(lanes)):
        lanes[DRAWN_LEFT + k] = lanes[DRAW_LIGHT_U + k] * lanes[TOTAL + k]
        lanes[DRAWN_SHARE + k] = lanes[DRAWN_FOUND + k] = _ZERO
        drawn[k] = 0
    for group in range(group_count):
        row = shares[group * LANES : (group + 1) * LANES]
        number = np.int32(group)
        for k in range(lane_count(lanes)):
            share, left = row[k], lanes[DRAWN_LEFT + k]
            here = (share > _ZERO) & (lanes[DRAWN_FOUND + k] == _ZERO)
            falls = left < share
            drawn[k] = number if here else drawn[k]
            lanes[DRAWN_SHARE + k] = share if here else lanes[DRAWN_SHARE + k]
            lanes[DRAWN_FOUND + k] = _ONE if here & falls else lanes[DRAWN_FOUND + k]
            lanes[DRAWN_LEFT + k] = left if falls | (not here) else left - share


@kernel
def _draw_points(lights: Lights, lanes: NDArray[np.float32], drawn: NDArray[np.int32]) -> None:
    """Replace groups in ``drawn`` by triangles and fill LIGHT with points on them, as if they shone alike in all directions."""
    table = lights.emitters
    for k in range(lane_count(lanes)):
        share = lanes[DRAWN_SHARE + k]
        e, within = find_emitter(lights, drawn[k], clamp_unit(lanes[DRAWN_LEFT + k] / (share if share > _ZERO else _ONE)))
        drawn[k] = e
        lanes[DRAWN_LEFT + k] = within
    for k in range(lane_count(lanes)):
        e = EMITTER_SIZE * drawn[k]
        s, t = spread_over_triangle(lanes[DRAWN_LEFT + k], lanes[DRAW_LIGHT_V + k])
        nx, ny, nz = table[e + EMITTER_NORMAL], table[e + EMITTER_NORMAL + 1], table[e + EMITTER_NORMAL + 2]
        x = table[e + EMITTER_CORNER] + s * table[e + EMITTER_EDGE_1] + t * table[e + EMITTER_EDGE_2]
        y = table[e + EMITTER_CORNER + 1] + s * table[e + EMITTER_EDGE_1 + 1] + t * table[e + EMITTER_EDGE_2 + 1]
        z = table[e + EMITTER_CORNER + 2] + s * table[e + EMITTER_EDGE_1 + 2] + t * table[e + EMITTER_EDGE_2 + 2]
        lift = lift_height(x, y, z)
        dx, dy, dz = x + lift * nx - lanes[POINT_X + k], y + lift * ny - lanes[POINT_Y + k], z + lift * nz - lanes[POINT_Z + k]
        squared = dx * dx + dy * dy + dz * dz
        distance = np.sqrt(squared)
        at_light = -(dx * nx + dy * ny + dz * nz) / (distance if distance > _TINY else _TINY)
        lit = (at_light > _ZERO) & _rises(lanes, k, dx, dy, dz) & (lanes[REFLECTS + k] > _ZERO) & (lanes[TOTAL + k] > _ZERO)
        chance = lanes[DRAWN_SHARE + k] * squared / (lanes[TOTAL + k] * table[e + EMITTER_AREA] * at_light)
        lanes[LIGHT_CHANCE + k] = chance if lit else _ZERO
        lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k] = dx, dy, dz
        lanes[LIGHT_R + k] = table[e + EMITTER_GLOW]
        lanes[LIGHT_G + k] = table[e + EMITTER_GLOW + 1]
        lanes[LIGHT_B + k] = table[e + EMITTER_GLOW + 2]


@inlined
def aim_outside(surfaces: Surfaces, outside: Outside, scratch: Scratch) -> None:
    """Fill LIGHT of all lanes with a direction to the sun, or to a bright part of the environment, as :func:`aim_at_lights` does.

    Where no pane lies that way nothing comes in, and LIGHT_CHANCE is 0.
    """
    lanes, drawn = scratch.lanes, scratch.drawn
    for k in range(lane_count(lanes)):
        dx, dy, dz = draw_toward(outside, lanes[DRAW_SUN_U + k], lanes[DRAW_SUN_V + k])
        lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k] = dx, dy, dz
    meet_panes(outside, lanes, drawn)
    panes = outside.panes
    for k in range(lane_count(lanes)):
        dx, dy, dz = lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k]
        pane = drawn[k] if drawn[k] >= 0 else np.int32(0)
        r, g, b, chance = hot_toward(outside, dx, dy, dz)
        facing = -(dx * panes[pane, 9] + dy * panes[pane, 10] + dz * panes[pane, 11])
        through = pane_through(surfaces, outside.part[pane], facing)
        # Shadow rays end as far before the pane as they begin off their own surface.
        slope = facing if facing > _GRAZING else _GRAZING
        reach = lanes[DRAWN_LEFT + k] - lift_height(panes[pane, 0], panes[pane, 1], panes[pane, 2]) / slope
        reach = reach if reach > _TINY else _TINY
        lit = (drawn[k] >= 0) & (lanes[REFLECTS + k] > _ZERO) & (lanes[TOTAL + k] > _ZERO) & _rises(lanes, k, dx, dy, dz)
        lanes[LIGHT_CHANCE + k] = chance if lit else _ZERO
        lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k] = reach * dx, reach * dy, reach * dz
        lanes[LIGHT_R + k], lanes[LIGHT_G + k], lanes[LIGHT_B + k] = through * r, through * g, through * b


@kernel
def meet_panes(outside: Outside, lanes: NDArray[np.float32], drawn: NDArray[np.int32]) -> None:
    """Write into ``drawn`` the nearest pane triangle that a ray from POINT along LIGHT meets from inside, or -1; DRAWN_LEFT: how far."""
    for k in range(lane_count(lanes)):
        lanes[DRAWN_LEFT + k] = _INFINITE
        drawn[k] = -1
    for p in range(len(outside.part)):
        row = outside.panes[p]
        corner_x, corner_y, corner_z, nx, ny, nz = row[0], row[1], row[2], row[9], row[10], row[11]
        ax, ay, az, bx, by, bz = row[3], row[4], row[5], row[6], row[7], row[8]
        number = np.int32(p)
        for k in range(lane_count(lanes)):
            dx, dy, dz = lanes[LIGHT_X + k], lanes[LIGHT_Y + k], lanes[LIGHT_Z + k]
            cx, cy, cz = lanes[POINT_X + k] - corner_x, lanes[POINT_Y + k] - corner_y, lanes[POINT_Z + k] - corner_z
            px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
            scale = _ONE / (ax * px + ay * py + az * pz)
            s = (cx * px + cy * py + cz * pz) * scale
            qx, qy, qz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
            t = (dx * qx + dy * qy + dz * qz) * scale
            distance = (bx * qx + by * qy + bz * qz) * scale
            inward = nx * dx + ny * dy + nz * dz < _ZERO
            inside = (s >= _ZERO) & (t >= _ZERO) & (s + t <= _ONE)
            met = inward & inside & (distance > _ZERO) & (distance < lanes[DRAWN_LEFT + k])
            lanes[DRAWN_LEFT + k] = distance if met else lanes[DRAWN_LEFT + k]
            drawn[k] = number if met else drawn[k]


@inlined
def _rises(lanes: NDArray[np.float32], k: int, dx: np.float32, dy: np.float32, dz: np.float32) -> bool:
    """Return whether a way leaves lane k's surface on the viewer's side, by both of its normals."""
    shading = dx * lanes[SHADE_X + k] + dy * lanes[SHADE_Y + k] + dz * lanes[SHADE_Z + k]
    true = dx * lanes[SIDE_X + k] + dy * lanes[SIDE_Y + k] + dz * lanes[SIDE_Z + k]
    rises: bool = (shading > _ZERO) & (true > _ZERO)
    return rises
