"""Colour: direct light with soft shadows, and diffuse bounces, path by path, 16 paths of a 4 x 4 tile at a time.

At each hit one point on a light is drawn and tested with a shadow ray (next event); the ray of the next bounce may find a light as well.
Both estimate the same light, so they share it by the balance heuristic (Veach 1997, section 9.2).  At the last hit a ray follows only
near lights, where drawing points alone would be noisy; elsewhere the drawn point counts in full.  So n bounces in a closed room give the
Neumann series cut after n + 1 reflections, in the mean exactly.

Each ray's packet is fixed by tile and sample, and each random number by its key: bytes depend on neither threads nor order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cameras import Pinhole
from renderer.embree import (
    DIR_X,
    DIR_Y,
    DIR_Z,
    GEOM_ID,
    INVALID_ID,
    LANES,
    NG_X,
    NG_Y,
    NG_Z,
    ORG_X,
    ORG_Y,
    ORG_Z,
    TFAR,
    TNEAR,
    Packet,
    SceneHandle,
    aligned_floats,
    intersect16,
    make_packet,
    occluded16,
)
from renderer.ground_truth import TILE, aim_tile
from renderer.kernel import kernel
from renderer.lights import Lights, clamp_unit, find_emitter, importance, load_bounds, spread_over_triangle
from renderer.random_numbers import draw_pairs, mix
from renderer.surfaces import (
    ALBEDO_R,
    CHANCE,
    DRAW_U,
    DRAW_V,
    FROM_X,
    FROM_Y,
    FROM_Z,
    GLOW_CHANCE,
    GLOW_R,
    IMPORTANCE,
    LANES_SIZE,
    LIGHT_R,
    NEAR,
    PENDING_R,
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
    WEIGHT_R,
    Surfaces,
    emitted_luminance,
    find_surfaces,
    lift_height,
)

_ZERO, _ONE, _TWO, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(0.5), np.float32(1e-30)
_INVERSE_PI, _QUARTER_PI = np.float32(1.0 / np.pi), np.float32(0.25 * np.pi)
_SIN_3, _SIN_5, _SIN_7 = np.float32(-1.0 / 6.0), np.float32(1.0 / 120.0), np.float32(-1.0 / 5040.0)
_COS_4, _COS_6, _COS_8 = np.float32(1.0 / 24.0), np.float32(-1.0 / 720.0), np.float32(1.0 / 40320.0)
_NEAR = np.float32(2.25)
_THREE_CHANNELS = 3 * LANES


class Scratch(NamedTuple):
    """Memory of one thread: the path's rays, its shadow rays, the lanes, (g * 16,) importance of g light groups, seeds of 16 pixels."""

    rays: Packet
    shadows: Packet
    lanes: NDArray[np.float32]
    shares: NDArray[np.float32]
    seeds: NDArray[np.uint32]


class Work(NamedTuple):
    """A piece of an image: tiles [first_tile, end_tile), row by row, and samples [first_sample, end_sample) of their pixels."""

    first_tile: int
    end_tile: int
    first_sample: int
    end_sample: int


def make_scratch(group_count: int) -> Scratch:
    """Return the memory that one thread needs in a scene with ``group_count`` groups of lights."""
    shares = aligned_floats(group_count * LANES)
    return Scratch(make_packet(), make_packet(), aligned_floats(LANES_SIZE), shares, np.zeros(LANES, np.uint32))


@kernel
def trace_paths(
    scene: SceneHandle,
    surfaces: Surfaces,
    lights: Lights,
    camera: Pinhole,
    frame_key: np.uint32,
    bounces: int,
    work: Work,
    scratch: Scratch,
    image: NDArray[np.float32],
) -> None:
    """Add the luminance of a piece's samples to ``image``, (height, width, 3) float32, cd/m2."""
    rays, shadows, lanes, seeds = scratch.rays, scratch.shadows, scratch.lanes, scratch.seeds
    tiles_across = (camera.width + TILE - 1) // TILE
    for tile in range(work.first_tile, work.end_tile):
        column, row = TILE * (tile % tiles_across), TILE * (tile // tiles_across)
        for k in range(LANES):
            pixel = np.uint32((row + (k >> 2)) * camera.width + column + (k & 3))
            seeds[k] = mix(np.uint32(mix(pixel) ^ frame_key))
        for sample in range(work.first_sample, work.end_sample):
            draw_pairs(seeds, np.uint32(sample), np.uint32(0), lanes[DRAW_U:])
            _start_paths(camera, column, row, scratch)
            for depth in range(bounces + 2):
                if not _any_alive(rays):
                    break
                intersect16(
                    rays.alive.ctypes.data, scene.address, rays.real.ctypes.data, scene.coherent if depth == 0 else scene.incoherent
                )
                find_surfaces(rays, surfaces, lights, depth == 0, lanes)
                _gather_glow(lanes)
                if depth > bounces:
                    break
                last = depth == bounces
                _weigh_lights(lights, scratch)
                draw_pairs(seeds, np.uint32(sample), np.uint32(2 * depth + 1), lanes[DRAW_U:])
                _aim_at_lights(surfaces, lights, last, scratch)
                occluded16(shadows.alive.ctypes.data, scene.address, shadows.real.ctypes.data, scene.incoherent)
                _gather_unshadowed(scratch)
                draw_pairs(seeds, np.uint32(sample), np.uint32(2 * depth + 2), lanes[DRAW_U:])
                _bounce(last, scratch)
            for k in range(LANES):
                x, y = column + (k & 3), row + (k >> 2)
                if x < camera.width and y < camera.height:
                    for channel in range(3):
                        image[y, x, channel] += lanes[LIGHT_R + LANES * channel + k]


@kernel
def _any_alive(packet: Packet) -> bool:
    alive = 0
    for k in range(LANES):
        alive |= packet.alive[k]
    return bool(alive != 0)


@kernel
def _start_paths(camera: Pinhole, column: int, row: int, scratch: Scratch) -> None:
    """Aim camera rays at even points of the pixels; paths start with full weight and no light."""
    lanes = scratch.lanes
    for k in range(2 * LANES):
        lanes[DRAW_U + k] -= _HALF
    aim_tile(camera, column, row, lanes[DRAW_U:], scratch.rays)
    for k in range(LANES):
        lanes[CHANCE + k] = np.inf
    for k in range(_THREE_CHANNELS):
        lanes[WEIGHT_R + k] = _ONE
        lanes[LIGHT_R + k] = _ZERO


@kernel
def _gather_glow(lanes: NDArray[np.float32]) -> None:
    """Add the light that the hit surfaces send by themselves, with the weight of the balance heuristic."""
    for k in range(LANES):
        share = _ONE / (_ONE + lanes[GLOW_CHANCE + k] / lanes[CHANCE + k])
        for channel in range(0, _THREE_CHANNELS, LANES):
            lanes[LIGHT_R + channel + k] += lanes[WEIGHT_R + channel + k] * lanes[GLOW_R + channel + k] * share


@kernel
def _weigh_lights(lights: Lights, scratch: Scratch) -> None:
    """Fill the importance of every group of lights for every lane, their sums, and which lanes are near a group."""
    lanes, shares = scratch.lanes, scratch.shares
    for k in range(LANES):
        lanes[IMPORTANCE + k] = _ZERO
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
            lanes[IMPORTANCE + k] += value


@kernel
def _draw_group(scratch: Scratch, k: int, group_count: int) -> tuple[int, np.float32]:
    """Return the group that lane k's first random number falls on, and where within its share, in [0, 1)."""
    left = scratch.lanes[DRAW_U + k] * scratch.lanes[IMPORTANCE + k]
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
def _aim_at_lights(surfaces: Surfaces, lights: Lights, last: bool, scratch: Scratch) -> None:
    """Draw a point on a light for each lane, aim a shadow ray at it, and set PENDING to what it would bring.

    Where a ray will follow that can find the same light, the balance heuristic applies: everywhere but at far lanes of the ``last`` hit.
    """
    lanes, shadows = scratch.lanes, scratch.shadows
    real, groups = shadows.real, lights.groups
    for k in range(LANES):
        shadows.alive[k] = 0
        if lanes[REFLECTS + k] == _ZERO or lanes[IMPORTANCE + k] <= _ZERO:
            continue
        group, within = _draw_group(scratch, k, len(groups.area))
        e, within = find_emitter(lights, group, within)
        s, t = spread_over_triangle(within, lanes[DRAW_V + k])
        nx, ny, nz = lights.normal[e, 0], lights.normal[e, 1], lights.normal[e, 2]
        x = lights.corner[e, 0] + s * lights.edge_1[e, 0] + t * lights.edge_2[e, 0]
        y = lights.corner[e, 1] + s * lights.edge_1[e, 1] + t * lights.edge_2[e, 1]
        z = lights.corner[e, 2] + s * lights.edge_1[e, 2] + t * lights.edge_2[e, 2]
        lift = lift_height(x, y, z)
        dx, dy, dz = x + lift * nx - lanes[POINT_X + k], y + lift * ny - lanes[POINT_Y + k], z + lift * nz - lanes[POINT_Z + k]
        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
        scale = _ONE / max(distance, _TINY)
        at_light = -(dx * nx + dy * ny + dz * nz) * scale
        at_surface = (dx * lanes[SHADE_X + k] + dy * lanes[SHADE_Y + k] + dz * lanes[SHADE_Z + k]) * scale
        above = dx * lanes[SIDE_X + k] + dy * lanes[SIDE_Y + k] + dz * lanes[SIDE_Z + k]
        if at_light <= _ZERO or at_surface <= _ZERO or above <= _ZERO:
            continue
        part = lights.part[e]
        share = scratch.shares[group * LANES + k] / lanes[IMPORTANCE + k]
        chance = share * distance * distance / (groups.area[group] * at_light)
        if not last or lanes[NEAR + k] > _ZERO:
            chance += at_surface * _INVERSE_PI
        gain = at_surface * _INVERSE_PI / chance
        for channel in range(3):
            field = LANES * channel + k
            glow = emitted_luminance(surfaces, part, channel, dz * scale)
            lanes[PENDING_R + field] = lanes[WEIGHT_R + field] * lanes[ALBEDO_R + field] * glow * gain
        shadows.alive[k] = -1
        real[ORG_X + k], real[ORG_Y + k], real[ORG_Z + k] = lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k]
        real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k] = dx, dy, dz
        real[TNEAR + k], real[TFAR + k] = _ZERO, _ONE


@kernel
def _gather_unshadowed(scratch: Scratch) -> None:
    """Add PENDING where a shadow ray was sent and found nothing in its way."""
    lanes, shadows = scratch.lanes, scratch.shadows
    for k in range(LANES):
        if shadows.alive[k] != 0 and shadows.real[TFAR + k] > _ZERO:
            for channel in range(0, _THREE_CHANNELS, LANES):
                lanes[LIGHT_R + channel + k] += lanes[PENDING_R + channel + k]


@kernel
def _bounce(last: bool, scratch: Scratch) -> None:
    """Aim each lane's next ray, cosine-distributed about the shading normal (concentric map); lanes that do not reflect end.

    After the ``last`` hit only lanes near lights go on, to find them.
    """
    lanes, rays = scratch.lanes, scratch.rays
    real, integer = rays.real, rays.integer
    threshold = _ZERO if last else -_ONE
    for k in range(LANES):
        a, b = _TWO * lanes[DRAW_U + k] - _ONE, _TWO * lanes[DRAW_V + k] - _ONE
        steep = abs(b) > abs(a)
        radius, other = b if steep else a, a if steep else b
        angle = _QUARTER_PI * other / (radius if radius != _ZERO else _ONE)
        q = angle * angle
        cosine = _ONE + q * (-_HALF + q * (_COS_4 + q * (_COS_6 + q * _COS_8)))
        sine = angle * (_ONE + q * (_SIN_3 + q * (_SIN_5 + q * _SIN_7)))
        x, y = radius * (sine if steep else cosine), radius * (cosine if steep else sine)
        z = _ONE - x * x - y * y
        z = np.sqrt(z if z > _ZERO else _ZERO)
        nx, ny, nz = lanes[SHADE_X + k], lanes[SHADE_Y + k], lanes[SHADE_Z + k]
        # Basis after Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
        sign = _ONE if nz >= _ZERO else -_ONE
        p = -_ONE / (sign + nz)
        r = nx * ny * p
        dx = x * (_ONE + sign * nx * nx * p) + y * r + z * nx
        dy = x * sign * r + y * (sign + ny * ny * p) + z * ny
        dz = -x * sign * nx - y * ny + z * nz
        above = dx * lanes[SIDE_X + k] + dy * lanes[SIDE_Y + k] + dz * lanes[SIDE_Z + k]
        alive = (lanes[REFLECTS + k] > _ZERO) & (lanes[NEAR + k] > threshold) & (above > _ZERO) & (z > _ZERO)
        rays.alive[k] = -1 if alive else 0
        lanes[CHANCE + k] = (z if z > _TINY else _TINY) * _INVERSE_PI
        for channel in range(0, _THREE_CHANNELS, LANES):
            lanes[WEIGHT_R + channel + k] *= lanes[ALBEDO_R + channel + k]
        lanes[FROM_X + k], lanes[FROM_Y + k], lanes[FROM_Z + k] = nx, ny, nz
        real[ORG_X + k], real[ORG_Y + k], real[ORG_Z + k] = lanes[POINT_X + k], lanes[POINT_Y + k], lanes[POINT_Z + k]
        real[DIR_X + k], real[DIR_Y + k], real[DIR_Z + k] = dx, dy, dz
        real[TNEAR + k], real[TFAR + k] = _ZERO, np.inf
        real[NG_X + k], real[NG_Y + k], real[NG_Z + k] = _ZERO, _ZERO, _ZERO
        integer[GEOM_ID + k] = INVALID_ID
