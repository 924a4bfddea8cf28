"""Points on lights, sampled for the hits of a packet: a group of lights by importance, a triangle of it by area, a point on that evenly.

Each step goes over all lanes before the next begins, so that LLVM turns it into vector code, table look-ups included.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import lane_count
from renderer.core.ray_packet import LANES
from renderer.path import lights as lt
from renderer.path.emission import pane_transmittance, surface_le
from renderer.path.infinite_light import InfiniteLight, infinite_le, limb_darkening, sample_infinite, sky_le
from renderer.path.lights import Lights, choose_emitter, clamp_unit, sample_triangle
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_INFINITE = np.float32(np.inf)


@inlined
def sample_emitters(surfaces: Surfaces, lights: Lights, scratch: Scratch) -> None:
    """Fill TO_LIGHT, LIGHT_END, LI and LIGHT_PDF of all lanes with points on emitters; LIGHT_PDF is 0 where no light arrives.

    Shadow rays to portals go on through them: what stands outside shades too.
    """
    lanes, sampled = scratch.lanes, scratch.sampled
    if len(lights.part) == 0:
        for k in range(LANES):
            lanes[ln.LIGHT_PDF + k] = _ZERO
        return
    _choose_groups(scratch.importances, len(lights.groups.area), lanes, sampled)
    sample_groups(surfaces, lights, scratch)


@inlined
def sample_groups(surfaces: Surfaces, lights: Lights, scratch: Scratch) -> None:
    """Fill TO_LIGHT, LI and LIGHT_PDF with points on the groups in ``sampled``; U_REMAPPED and U_LIGHT_1 choose them."""
    _sample_points(lights, scratch.lanes, scratch.sampled)
    show_emitters(surfaces, lights, scratch)


@inlined
def show_emitters(surfaces: Surfaces, lights: Lights, scratch: Scratch) -> None:
    """Fill LI and LIGHT_END of the lanes whose point on the triangle in ``sampled`` does not shine alike in all directions."""
    lanes, sampled = scratch.lanes, scratch.sampled
    by_sky = by_profile = 0
    for k in range(LANES):
        kind = lights.varies[sampled[k]]
        by_sky += kind == lt.BY_SKY
        by_profile += kind == lt.BY_PROFILE
    if by_sky > 0:
        _add_sky_le(surfaces, lights, lanes, sampled)
    if by_profile > 0:
        _add_profile_le(surfaces, lights, lanes, sampled)


@inlined
def _add_sky_le(surfaces: Surfaces, lights: Lights, lanes: NDArray[np.float32], sampled: NDArray[np.int32]) -> None:
    """Fill LI with the luminance that portals let through, and LIGHT_END, in the lanes whose point lies on one.

    Of what is outside itself, other windows are lights that only paths find.
    """
    for k in range(lane_count(lanes)):
        e = sampled[k]
        dx, dy, dz, cos_light = _direction_to_emitter(lights, lanes, k, e)
        through = pane_transmittance(surfaces, lights.part[e], cos_light)
        r, g, b = sky_le(surfaces.sky, dx, dy, dz)
        is_portal = lights.varies[e] == lt.BY_SKY
        lanes[ln.LIGHT_END + k] = _INFINITE if is_portal else _ONE
        lanes[ln.LIGHT_PDF + k] = _ZERO if is_portal & (lanes[ln.OUTSIDE + k] > _ZERO) else lanes[ln.LIGHT_PDF + k]
        lanes[ln.LI_R + k] = through * r if is_portal else lanes[ln.LI_R + k]
        lanes[ln.LI_G + k] = through * g if is_portal else lanes[ln.LI_G + k]
        lanes[ln.LI_B + k] = through * b if is_portal else lanes[ln.LI_B + k]


@inlined
def _add_profile_le(surfaces: Surfaces, lights: Lights, lanes: NDArray[np.float32], sampled: NDArray[np.int32]) -> None:
    """Fill LI of the lanes whose point lies on a lamp with a profile."""
    for k in range(LANES):
        e = sampled[k]
        if lights.varies[e] == lt.BY_PROFILE:
            dx, dy, dz, cos_light = _direction_to_emitter(lights, lanes, k, e)
            r, g, b = surface_le(surfaces, lights.part[e], dx, dy, dz, cos_light)
            lanes[ln.LI_R + k], lanes[ln.LI_G + k], lanes[ln.LI_B + k] = r, g, b


@inlined
def _direction_to_emitter(
    lights: Lights, lanes: NDArray[np.float32], k: int, e: np.int32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return the unit direction from lane k to the point on emitter e, and the cosine there."""
    dx, dy, dz = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    squared = dx * dx + dy * dy + dz * dz
    scale = _ONE / np.sqrt(squared if squared > _TINY else _TINY)
    dx, dy, dz = dx * scale, dy * scale, dz * scale
    normal = lt.EMITTER_SIZE * e + lt.EMITTER_NORMAL
    return dx, dy, dz, -(dx * lights.emitters[normal] + dy * lights.emitters[normal + 1] + dz * lights.emitters[normal + 2])


@kernel
def _choose_groups(importances: NDArray[np.float32], group_count: int, lanes: NDArray[np.float32], sampled: NDArray[np.int32]) -> None:
    """Choose groups by importance: write them into ``sampled``, and fill U_REMAPPED and GROUP."""
    for k in range(lane_count(lanes)):
        lanes[ln.U_REMAPPED + k] = lanes[ln.U_LIGHT_0 + k] * lanes[ln.IMPORTANCE + k]
        lanes[ln.GROUP_IMPORTANCE + k] = lanes[ln.GROUP_FOUND + k] = _ZERO
        sampled[k] = 0
    # Walk along the importances of all groups together until the random number falls on one.
    for group in range(group_count):
        row = importances[group * LANES : (group + 1) * LANES]
        number = np.int32(group)
        for k in range(lane_count(lanes)):
            weight, left = row[k], lanes[ln.U_REMAPPED + k]
            undecided = (weight > _ZERO) & (lanes[ln.GROUP_FOUND + k] == _ZERO)
            falls = left < weight
            sampled[k] = number if undecided else sampled[k]
            lanes[ln.GROUP_IMPORTANCE + k] = weight if undecided else lanes[ln.GROUP_IMPORTANCE + k]
            lanes[ln.GROUP_FOUND + k] = _ONE if undecided & falls else lanes[ln.GROUP_FOUND + k]
            lanes[ln.U_REMAPPED + k] = left if falls | (not undecided) else left - weight


@kernel
def _sample_points(lights: Lights, lanes: NDArray[np.float32], sampled: NDArray[np.int32]) -> None:
    """Replace groups in ``sampled`` by triangles, and sample points on them; LI as if they shone alike in all directions."""
    table = lights.emitters
    # Choose a triangle of the group by area.
    for k in range(lane_count(lanes)):
        share = lanes[ln.GROUP_IMPORTANCE + k]
        e, within = choose_emitter(lights, sampled[k], clamp_unit(lanes[ln.U_REMAPPED + k] / (share if share > _ZERO else _ONE)))
        sampled[k] = e
        lanes[ln.U_REMAPPED + k] = within
    # Sample a point on it; turn the density per area into one per steradian.
    for k in range(lane_count(lanes)):
        e = lt.EMITTER_SIZE * sampled[k]
        s, t = sample_triangle(lanes[ln.U_REMAPPED + k], lanes[ln.U_LIGHT_1 + k])
        nx, ny, nz = table[e + lt.EMITTER_NORMAL], table[e + lt.EMITTER_NORMAL + 1], table[e + lt.EMITTER_NORMAL + 2]
        x = table[e + lt.EMITTER_CORNER] + s * table[e + lt.EMITTER_EDGE_1] + t * table[e + lt.EMITTER_EDGE_2]
        y = table[e + lt.EMITTER_CORNER + 1] + s * table[e + lt.EMITTER_EDGE_1 + 1] + t * table[e + lt.EMITTER_EDGE_2 + 1]
        z = table[e + lt.EMITTER_CORNER + 2] + s * table[e + lt.EMITTER_EDGE_1 + 2] + t * table[e + lt.EMITTER_EDGE_2 + 2]
        lift = lift_height(x, y, z)
        dx, dy, dz = x + lift * nx - lanes[ln.P_X + k], y + lift * ny - lanes[ln.P_Y + k], z + lift * nz - lanes[ln.P_Z + k]
        squared = dx * dx + dy * dy + dz * dz
        distance = np.sqrt(squared)
        cos_light = -(dx * nx + dy * ny + dz * nz) / (distance if distance > _TINY else _TINY)
        lit = (cos_light > _ZERO) & _is_above(lanes, k, dx, dy, dz) & (lanes[ln.HIT + k] > _ZERO) & (lanes[ln.IMPORTANCE + k] > _ZERO)
        pdf = lanes[ln.GROUP_IMPORTANCE + k] * squared / (lanes[ln.IMPORTANCE + k] * table[e + lt.EMITTER_AREA] * cos_light)
        lanes[ln.LIGHT_PDF + k] = pdf if lit else _ZERO
        lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = dx, dy, dz
        lanes[ln.LIGHT_END + k] = _ONE
        lanes[ln.LI_R + k] = table[e + lt.EMITTER_LE]
        lanes[ln.LI_G + k] = table[e + lt.EMITTER_LE + 1]
        lanes[ln.LI_B + k] = table[e + lt.EMITTER_LE + 2]


@inlined
def sample_infinite_light(surfaces: Surfaces, infinite: InfiniteLight, scratch: Scratch) -> None:
    """Fill TO_LIGHT, LIGHT_END, LI and LIGHT_PDF of all lanes with a direction to the sun, or to a bright part of the environment.

    Where no portal lies that way nothing comes in, and LIGHT_PDF is 0; what is outside itself needs none.
    """
    lanes, sampled = scratch.lanes, scratch.sampled
    # Sample a direction and find the portal that it leads through.
    for k in range(lane_count(lanes)):
        dx, dy, dz = sample_infinite(infinite, lanes[ln.U_INFINITE_0 + k], lanes[ln.U_INFINITE_1 + k])
        lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = dx, dy, dz
    intersect_portals(infinite, lanes, sampled)
    # Let the portal take its share of the light.
    portals = infinite.portals
    for k in range(lane_count(lanes)):
        dx, dy, dz = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
        portal = sampled[k] if sampled[k] >= 0 else np.int32(0)
        r, g, b, pdf = infinite_le(infinite, dx, dy, dz)
        facing = -(dx * portals[portal, 9] + dy * portals[portal, 10] + dz * portals[portal, 11])
        outside = lanes[ln.OUTSIDE + k] > _ZERO
        through = _ONE if outside else pane_transmittance(surfaces, infinite.part[portal], facing)
        reached = outside | ((sampled[k] >= 0) & (lanes[ln.IMPORTANCE + k] > _ZERO))
        lanes[ln.LIGHT_PDF + k] = pdf if reached & (lanes[ln.HIT + k] > _ZERO) & _is_above(lanes, k, dx, dy, dz) else _ZERO
        lanes[ln.LIGHT_END + k] = _INFINITE
        lanes[ln.LI_R + k], lanes[ln.LI_G + k], lanes[ln.LI_B + k] = through * r, through * g, through * b


@kernel
def intersect_portals(infinite: InfiniteLight, lanes: NDArray[np.float32], sampled: NDArray[np.int32]) -> None:
    """Write into ``sampled`` the nearest portal triangle that a ray from P along TO_LIGHT meets from inside, or -1; PORTAL_T: how far.

    After Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (1997).
    """
    for k in range(lane_count(lanes)):
        lanes[ln.PORTAL_T + k] = _INFINITE
        sampled[k] = -1
    for p in range(len(infinite.part)):
        row = infinite.portals[p]
        corner_x, corner_y, corner_z, nx, ny, nz = row[0], row[1], row[2], row[9], row[10], row[11]
        ax, ay, az, bx, by, bz = row[3], row[4], row[5], row[6], row[7], row[8]
        number = np.int32(p)
        for k in range(lane_count(lanes)):
            dx, dy, dz = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
            cx, cy, cz = lanes[ln.P_X + k] - corner_x, lanes[ln.P_Y + k] - corner_y, lanes[ln.P_Z + k] - corner_z
            px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
            scale = _ONE / (ax * px + ay * py + az * pz)
            s = (cx * px + cy * py + cz * pz) * scale
            qx, qy, qz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
            t = (dx * qx + dy * qy + dz * qz) * scale
            distance = (bx * qx + by * qy + bz * qz) * scale
            inward = nx * dx + ny * dy + nz * dz < _ZERO
            inside = (s >= _ZERO) & (t >= _ZERO) & (s + t <= _ONE)
            met = inward & inside & (distance > _ZERO) & (distance < lanes[ln.PORTAL_T + k])
            lanes[ln.PORTAL_T + k] = distance if met else lanes[ln.PORTAL_T + k]
            sampled[k] = number if met else sampled[k]


@inlined
def _is_above(lanes: NDArray[np.float32], k: int, dx: np.float32, dy: np.float32, dz: np.float32) -> bool:
    """Return whether a direction leaves lane k's surface on the viewer's side, by both of its normals."""
    above_ns = dx * lanes[ln.NS_X + k] + dy * lanes[ln.NS_Y + k] + dz * lanes[ln.NS_Z + k]
    above_ng = dx * lanes[ln.NG_X + k] + dy * lanes[ln.NG_Y + k] + dz * lanes[ln.NG_Z + k]
    above: bool = (above_ns > _ZERO) & (above_ng > _ZERO)
    return above


_HALF, _THREE_QUARTERS = np.float32(0.5), np.float32(0.75)


@inlined
def sample_sun(surfaces: Surfaces, lights: Lights, scratch: Scratch) -> None:
    """Fill lanes as :func:`renderer.path.light_sampling.sample_infinite_light` does, but the sun's disc in proportion to its luminance."""
    lanes: NDArray[np.float32] = scratch.lanes
    is_disc = len(lights.infinite.sun) > 0
    if is_disc:
        for k in range(LANES):
            lanes[ln.U_INFINITE_0 + k] = _share_of_disc(lanes[ln.U_INFINITE_0 + k])
    sample_infinite_light(surfaces, lights.infinite, scratch)
    if is_disc:
        for k in range(LANES):
            lanes[ln.LIGHT_PDF + k] *= limb_darkening(lanes[ln.U_INFINITE_0 + k])


@inlined
def _share_of_disc(light: np.float32) -> np.float32:
    """Return the share of the disc's area, from its middle on, that sends this share of its light (Newton's method).

    The share of the light within the area a is the integral of the limb darkening, a / 2 + (1 - (1 - a)^1.5) / 2.
    """
    area = light
    for _ in range(3):
        mu = np.sqrt(_ONE - area)
        within = _HALF * area + _HALF * (_ONE - mu * mu * mu)
        area = min(max(area - (within - light) / (_HALF + _THREE_QUARTERS * mu), _ZERO), _ONE)
    return area
