"""Light at the nodes of an atlas: what they reflect, what lights send them directly, and what a hemisphere of rays finds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.cache.atlas import GRID, Atlas, find_nodes, has_back
from renderer.cache.reflectance import total_albedo
from renderer.core import embree as ray
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.embree import INVALID_ID, LANES, SceneHandle, intersect16, occluded16
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.random_numbers import mix_bits
from renderer.core.sampling import coordinate_system, sample_cosine_hemisphere
from renderer.path import surface_tables as st
from renderer.path.direct_light import weigh_lights
from renderer.path.emission import surface_le
from renderer.path.infinite_light import infinite_le
from renderer.path.light_sampling import sample_groups, sample_infinite_light
from renderer.path.lights import BY_SKY, Lights
from renderer.path.records import Scratch
from renderer.path.scattering import build_bsdfs
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import evaluate_surfaces, lift_height

_ZERO, _HALF, _ONE, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(1e-20)
_PI, _INVERSE_PI = np.float32(np.pi), np.float32(1.0 / np.pi)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_MEAN_COSINE, _MEAN_SINE = np.float32(2.0 / 3.0), np.float32(np.sqrt(5.0) / 3.0)
_TO_UNIT = np.float32(2.0**-32)
_SMOOTH = np.float32(0.15)
_DEEPEST = 8
_STEP_U, _STEP_V = np.float32(0.7548777), np.float32(0.5698403)
_FREE_SAMPLES = 32
_LEAST_SAMPLES = np.float32(2.0)
_CLEAR_M = np.float32(1e-3)
_LEAST_COSINE = np.float32(0.05)

DARK, BEHIND = -1, -2
"""Links of rays that end at no node: at a light, a pane or nothing; at the inside of a closed part."""


class NodeLight(NamedTuple):
    """Light that falls on n nodes, float32.

    indirect, direct: (n, 3), illuminance in lux, by other surfaces and the sky in panes, and by lamps; sun: (n, 4), the sun's part of it, not in ``direct``, and the share of it that arrives;
    toward: (n, 3), luminance of the light times its direction, world, over the illuminance of both; valid: (n,), 1, or 0 within an object.
    """

    indirect: NDArray[np.float32]
    direct: NDArray[np.float32]
    sun: NDArray[np.float32]
    toward: NDArray[np.float32]
    valid: NDArray[np.float32]
    open_m: NDArray[np.float32]


class Bright(NamedTuple):
    """Coarse nodes that are much brighter than others, sampled as lights are, for kernels.

    chosen: (n,) bool, which they are; point, normal, weight: (s, 3) float32 each, samples of them, metres and world, and luminance times
    area that each stands for, cd.  Light from nearer than ``near_m`` is gathered instead.
    """

    chosen: NDArray[np.bool_]
    point: NDArray[np.float32]
    normal: NDArray[np.float32]
    weight: NDArray[np.float32]
    near_m: np.float32


def choose_bright(luminance: NDArray[np.float32], atlas: Atlas, times: float, samples: int, near_m: float) -> Bright:
    """Choose the nodes whose luminance (n, 3) is more than ``times`` the room's mean, and sample them by flux."""
    shown = luminance.astype(np.float64) @ LUMINANCE
    area = atlas.area.astype(np.float64)
    chosen = shown > times * max((shown * area).sum() / max(area.sum(), 1e-12), 1e-12)
    nodes = np.flatnonzero(chosen & (area > 0.0))
    flux = shown[nodes] * area[nodes]
    total = flux.sum()
    if total == 0.0:
        nothing = np.zeros((0, 3), np.float32)
        return Bright(np.zeros(len(shown), np.bool_), nothing, nothing, nothing, np.float32(near_m))
    picked = nodes[np.searchsorted(np.cumsum(flux), (np.arange(samples) + 0.5) / samples * total).clip(0, len(nodes) - 1)]
    weight = luminance[picked] / shown[picked, None] * (total / samples)
    return Bright(chosen, atlas.position[picked], atlas.normal[picked], weight.astype(np.float32), np.float32(near_m))


class GatherScratch(NamedTuple):
    """Memory of one thread: nodes, weights: (4,), those around a hit; links: (16,) int32, at: (48,), seen: (16, 3), of a packet; toward: (48,)."""

    nodes: NDArray[np.int32]
    weights: NDArray[np.float32]
    links: NDArray[np.int32]
    at: NDArray[np.float32]
    seen: NDArray[np.float32]
    toward: NDArray[np.float32]


def make_gather_scratch() -> GatherScratch:
    """Return the memory that one thread needs to gather."""
    return GatherScratch(
        np.zeros(4, np.int32), np.zeros(4, np.float32), np.zeros(LANES, np.int32), np.zeros(3 * LANES, np.float32), np.zeros((LANES, 3), np.float32), np.zeros(3 * LANES, np.float32)
    )


def make_node_light(count: int) -> NodeLight:
    """Return light of so many nodes, all dark."""
    return NodeLight(
        *(np.zeros((count, channels), np.float32) for channels in (3, 3, 4, 3)),
        np.zeros(count, np.float32),
        np.zeros(count, np.float32),
    )


@entry
def probe_insides(
    scene: SceneHandle,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    part: NDArray[np.int32],
    face_part: NDArray[np.int32],
    scratch: Scratch,
    inside: NDArray[np.bool_],
) -> None:
    """Tell for each ray, (r, 3) each, whether the first thing that it hits is the back of its own part's surface."""
    rays = scratch.rays
    real, integer = rays.real, rays.integer
    for begin in range(0, len(origin), LANES):
        for k in range(LANES):
            i = min(begin + k, len(origin) - 1)
            for axis in range(3):
                real[ray.ORG_X + LANES * axis + k], real[ray.DIR_X + LANES * axis + k] = origin[i, axis], direction[i, axis]
            real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, np.inf
            integer[ray.GEOM_ID + k] = INVALID_ID
            rays.alive[k] = -1
        intersect16(rays.alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
        for k in range(min(LANES, len(origin) - begin)):
            if integer[ray.GEOM_ID + k] != INVALID_ID:
                along = _ZERO
                for axis in range(0, 3 * LANES, LANES):
                    along += real[ray.DIR_X + axis + k] * real[ray.NG_X + axis + k]
                inside[begin + k] = (along > _ZERO) & (face_part[integer[ray.PRIM_ID + k]] == part[begin + k])


@entry
def reflect_nodes(
    atlas: Atlas,
    surfaces: Surfaces,
    lights: Lights,
    width_m: np.float32,
    scratch: Scratch,
    albedo: NDArray[np.float32],
    glow: NDArray[np.float32],
    first: int,
    end: int,
) -> None:
    """Fill ``albedo`` (n, 3) and ``glow`` (n, 3), luminance that no light sampling finds, of nodes [first, end)."""
    rays, lanes = scratch.rays, scratch.lanes
    real, integer = rays.real, rays.integer
    for begin in range(first, end, LANES):
        for k in range(LANES):
            node = min(begin + k, end - 1)
            nx, ny, nz = atlas.normal[node, 0], atlas.normal[node, 1], atlas.normal[node, 2]
            tx, ty, tz, _, _, _ = coordinate_system(nx, ny, nz)
            dx, dy, dz = (
                -_MEAN_COSINE * nx - _MEAN_SINE * tx,
                -_MEAN_COSINE * ny - _MEAN_SINE * ty,
                -_MEAN_COSINE * nz - _MEAN_SINE * tz,
            )
            real[ray.ORG_X + k] = atlas.position[node, 0] - dx
            real[ray.ORG_Y + k] = atlas.position[node, 1] - dy
            real[ray.ORG_Z + k] = atlas.position[node, 2] - dz
            real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx, dy, dz
            real[ray.TFAR + k] = _ONE
            real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = nx, ny, nz
            integer[ray.GEOM_ID + k], integer[ray.PRIM_ID + k] = 0, atlas.face[node]
            real[ray.BARY_U + k], real[ray.BARY_V + k] = atlas.weight[node, 0], atlas.weight[node, 1]
            rays.alive[k] = -1
            lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = width_m, _ZERO
        evaluate_surfaces(surfaces, lights, True, _ZERO, scratch)
        kinds = build_bsdfs(surfaces, True, scratch)
        for k in range(min(LANES, end - begin)):
            node, part = begin + k, scratch.parts[k]
            r, g, b = total_albedo(lanes, kinds, k)
            albedo[node, 0], albedo[node, 1], albedo[node, 2] = min(r, _ONE), min(g, _ONE), min(b, _ONE)
            if surfaces.materials[part * st.ROW_SIZE + st.GLOW] > _ZERO:
                glow[node, 0], glow[node, 1], glow[node, 2] = lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]


@inlined
def _stand_on(atlas: Atlas, node: int, scratch: Scratch) -> None:
    """Let all lanes be hits at one node."""
    lanes = scratch.lanes
    x, y, z = atlas.position[node, 0], atlas.position[node, 1], atlas.position[node, 2]
    nx, ny, nz = atlas.normal[node, 0], atlas.normal[node, 1], atlas.normal[node, 2]
    lift = lift_height(x, y, z)
    for k in range(LANES):
        lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz
        lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k] = nx, ny, nz
        lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k] = nx, ny, nz
        lanes[ln.HIT + k] = _ONE


@inlined
def _unit_hash(node: int, key: np.uint32) -> tuple[np.float32, np.float32]:
    """Return two numbers in [0, 1) that belong to a node."""
    first = mix_bits(np.uint32(mix_bits(np.uint32(node)) ^ key))
    second = mix_bits(np.uint32(first + np.uint32(0x9E3779B9)))
    return np.float32(first >> np.uint32(8)) * np.float32(2.0**-24), np.float32(second >> np.uint32(8)) * np.float32(2.0**-24)


@inlined
def _turned(u: np.float32, shift: np.float32) -> np.float32:
    """Return u + shift within [0, 1)."""
    sum_ = u + shift
    return sum_ - _ONE if sum_ >= _ONE else sum_


@inlined
def pass_glass(scene: SceneHandle, surfaces: Surfaces, lanes: NDArray[np.float32], scratch: Scratch) -> None:
    """Trace shadow rays from P along TO_LIGHT; where something other than clear glass stands between, LIGHT_PDF becomes 0.

    Glass takes its colour from LI.
    """
    packet = scratch.shadow_rays.packet
    real, integer, alive = packet.real, packet.integer, packet.alive
    for k in range(LANES):
        for axis in range(0, 3 * LANES, LANES):
            real[ray.ORG_X + axis + k], real[ray.DIR_X + axis + k] = lanes[ln.P_X + axis + k], lanes[ln.TO_LIGHT_X + axis + k]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _ONE
        alive[k] = -1 if lanes[ln.LIGHT_PDF + k] > _ZERO else 0
    occluded16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
    scratch.traced[0] += LANES
    waiting = 0
    for k in range(LANES):
        blocked = (alive[k] != 0) & (real[ray.TFAR + k] < _ZERO)
        alive[k] = -1 if blocked else 0
        waiting += blocked
        real[ray.TFAR + k], integer[ray.GEOM_ID + k] = _ONE, INVALID_ID
    if len(surfaces.albedos.glass) == 0:
        for k in range(LANES):
            if alive[k] != 0:
                lanes[ln.LIGHT_PDF + k] = _ZERO
        return
    for _ in range(_DEEPEST):
        if waiting == 0:
            break
        intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
        waiting = 0
        for k in range(LANES):
            if alive[k] == 0:
                continue
            if integer[ray.GEOM_ID + k] == INVALID_ID:
                alive[k] = 0
                continue
            row = surfaces.face_part[integer[ray.PRIM_ID + k]] * st.ROW_SIZE
            if surfaces.materials[row + st.TRANSMISSION] > _HALF and surfaces.materials[row + st.PORTAL] == _ZERO:
                for channel in range(3):
                    tint = np.sqrt(surfaces.materials[row + st.BASE + channel]) * np.float32(0.96)
                    lanes[ln.LI_R + channel * LANES + k] *= tint
                real[ray.TNEAR + k] = real[ray.TFAR + k] + np.float32(1e-5)
                real[ray.TFAR + k], integer[ray.GEOM_ID + k] = _ONE, INVALID_ID
                waiting += 1
            else:
                lanes[ln.LIGHT_PDF + k] = _ZERO
                alive[k] = 0
    for k in range(LANES):
        if alive[k] != 0:
            lanes[ln.LIGHT_PDF + k] = _ZERO


@entry
def light_nodes(
    scene: SceneHandle,
    atlas: Atlas,
    surfaces: Surfaces,
    lights: Lights,
    key: np.uint32,
    budget: int,
    pattern: NDArray[np.float32],
    nodes: NDArray[np.int64],
    scratch: Scratch,
    light: NodeLight,
    first: int,
    end: int,
) -> None:
    """Fill ``direct`` and ``sun`` of the chosen nodes [first, end), and begin ``toward``.

    ``budget``: about how many points on lights are sampled, shared among groups of lights by importance; ``pattern``: (s, 2) float32, s a
    multiple of 16, points of the unit square by which the sun's disc is sampled.
    """
    lanes = scratch.lanes
    has_sun = len(lights.infinite.part) > 0
    for i in range(first, end):
        node = nodes[i]
        _stand_on(atlas, node, scratch)
        weigh_lights(lights, scratch)
        shift_u, shift_v = _unit_hash(node, key)
        r = g = b = vx = vy = vz = sky_r = sky_g = sky_b = _ZERO
        possible = lanes[ln.IMPORTANCE] > _ZERO
        if possible:
            scale = np.float32(budget) / lanes[ln.IMPORTANCE]
            for k in range(LANES):
                lanes[ln.IMPORTANCE + k] = lanes[ln.GROUP_IMPORTANCE + k] = _ONE
            for group in range(len(lights.groups.area)):
                wanted = scratch.importances[group * LANES] * scale
                if wanted > _ZERO:
                    red, green, blue, dx, dy, dz = _light_of_group(scene, surfaces, lights, group, wanted, shift_u, shift_v, scratch)
                    vx, vy, vz = vx + dx, vy + dy, vz + dz
                    if lights.varies[lights.groups.start[group]] == BY_SKY:
                        sky_r, sky_g, sky_b = sky_r + red, sky_g + green, sky_b + blue
                    else:
                        r, g, b = r + red, g + green, b + blue
        light.indirect[node, 0], light.indirect[node, 1], light.indirect[node, 2] = sky_r, sky_g, sky_b
        light.direct[node, 0], light.direct[node, 1], light.direct[node, 2] = r, g, b
        light.toward[node, 0], light.toward[node, 1], light.toward[node, 2] = vx, vy, vz
        light.sun[node, 0] = light.sun[node, 1] = light.sun[node, 2] = light.sun[node, 3] = _ZERO
        if has_sun and possible:
            for k in range(LANES):
                lanes[ln.HIT + k] = _ONE
            r = g = b = arrived = _ZERO
            for begin in range(0, len(pattern), LANES):
                for k in range(LANES):
                    lanes[ln.U_INFINITE_0 + k] = _turned(pattern[begin + k, 0], shift_u)
                    lanes[ln.U_INFINITE_1 + k] = _turned(pattern[begin + k, 1], shift_v)
                sample_infinite_light(surfaces, lights.infinite, scratch)
                through = _ZERO
                for k in range(LANES):
                    through += _ONE if lanes[ln.LIGHT_PDF + k] > _ZERO else _ZERO
                if through == _ZERO:
                    continue
                pass_glass(scene, surfaces, lanes, scratch)
                for k in range(LANES):
                    if lanes[ln.LIGHT_PDF + k] > _ZERO:
                        gain, _, _, _, cosine = _arriving(lanes, k)
                        gain *= cosine
                        r, g, b = r + gain * lanes[ln.LI_R + k], g + gain * lanes[ln.LI_G + k], b + gain * lanes[ln.LI_B + k]
                        arrived += _ONE
            scale = _ONE / np.float32(len(pattern))
            light.sun[node, 0], light.sun[node, 1], light.sun[node, 2] = r * scale, g * scale, b * scale
            light.sun[node, 3] = arrived * scale


@inlined
def _fraction(x: np.float32) -> np.float32:
    fraction: np.float32 = x - np.floor(x)
    return fraction


@inlined
def _light_of_group(
    scene: SceneHandle,
    surfaces: Surfaces,
    lights: Lights,
    group: int,
    wanted: np.float32,
    shift_u: np.float32,
    shift_v: np.float32,
    scratch: Scratch,
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance (r, g, b) by one group of lights, and luminance times direction.

    Few samples tell which share of the light is blocked, many, without rays, how much there would be (a ratio estimator): where nothing
    stands between, no noise is left.
    """
    lanes = scratch.lanes
    samples = min(int(np.ceil(max(wanted, _LEAST_SAMPLES))), 2 * LANES)
    r = g = b = vx = vy = vz = free = filled = _ZERO
    for begin in range(0, samples, LANES):
        count = min(samples - begin, LANES)
        _sample_group(surfaces, lights, group, begin, count, shift_u, shift_v, scratch)
        for k in range(LANES):
            gain, _, _, _, cosine = _arriving(lanes, k)
            lanes[ln.U_LOBE + k] = gain if lanes[ln.LIGHT_PDF + k] > _ZERO else _ZERO
            filled += lanes[ln.U_LOBE + k] * cosine
            free += lanes[ln.U_LOBE + k] * cosine * _shown(lanes, k)
        pass_glass(scene, surfaces, lanes, scratch)
        for k in range(LANES):
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                _, dx, dy, dz, cosine = _arriving(lanes, k)
                gain = lanes[ln.U_LOBE + k]
                r, g, b = r + gain * cosine * lanes[ln.LI_R + k], g + gain * cosine * lanes[ln.LI_G + k], b + gain * cosine * lanes[ln.LI_B + k]
                weight = gain * _shown(lanes, k)
                vx, vy, vz = vx + weight * dx, vy + weight * dy, vz + weight * dz
    if free <= _ZERO:
        return _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO
    filled /= np.float32(samples)
    scale = _ONE / np.float32(samples)
    if r + g + b > _ZERO and wanted > _HALF:
        whole = filled = _ZERO
        for begin in range(0, _FREE_SAMPLES, LANES):
            _sample_group(surfaces, lights, group, begin, LANES, _HALF, _HALF, scratch)
            for k in range(LANES):
                gain, _, _, _, cosine = _arriving(lanes, k)
                gain = gain * cosine if lanes[ln.LIGHT_PDF + k] > _ZERO else _ZERO
                filled += gain / np.float32(_FREE_SAMPLES)
                whole += gain * _shown(lanes, k)
        scale = whole / (np.float32(_FREE_SAMPLES) * free)
    # No light fills more than the hemisphere, though few samples of one that is near may say so.
    scale *= min(_PI / max(filled, _TINY), _ONE)
    return scale * r, scale * g, scale * b, scale * vx, scale * vy, scale * vz


@inlined
def _shown(lanes: NDArray[np.float32], k: int) -> np.float32:
    """Return the luminance of LI."""
    shown: np.float32 = _RED * lanes[ln.LI_R + k] + _GREEN * lanes[ln.LI_G + k] + _BLUE * lanes[ln.LI_B + k]
    return shown


@inlined
def _sample_group(
    surfaces: Surfaces, lights: Lights, group: int, begin: int, count: int, shift_u: np.float32, shift_v: np.float32, scratch: Scratch
) -> None:
    """Fill TO_LIGHT, LI and LIGHT_PDF with points on a group of lights, in the first ``count`` lanes."""
    lanes = scratch.lanes
    for k in range(LANES):
        number = np.float32(begin + k)
        lanes[ln.U_REMAPPED + k] = _fraction(number * _STEP_U + shift_u)
        lanes[ln.U_LIGHT_1 + k] = _fraction(number * _STEP_V + shift_v)
        lanes[ln.HIT + k] = _ONE if k < count else _ZERO
        scratch.sampled[k] = group
    sample_groups(surfaces, lights, scratch)


@inlined
def _arriving(lanes: NDArray[np.float32], k: int) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return 1 / LIGHT_PDF, the unit direction TO_LIGHT, and its cosine to NS."""
    x, y, z = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    scale = _ONE / np.sqrt(max(x * x + y * y + z * z, _TINY))
    x, y, z = x * scale, y * scale, z * scale
    cosine = max(x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k], _ZERO)
    return _ONE / lanes[ln.LIGHT_PDF + k], x, y, z, cosine


@inlined
def _aim(atlas: Atlas, node: int, pattern: NDArray[np.float32], begin: int, u: np.float32, v: np.float32, scratch: Scratch) -> None:
    """Fill the packet with 16 rays of a node's hemisphere, with density cosine / pi."""
    rays = scratch.rays
    real, integer = rays.real, rays.integer
    x, y, z = atlas.position[node, 0], atlas.position[node, 1], atlas.position[node, 2]
    nx, ny, nz = atlas.normal[node, 0], atlas.normal[node, 1], atlas.normal[node, 2]
    ux, uy, uz, vx, vy, vz = coordinate_system(nx, ny, nz)
    lift = lift_height(x, y, z)
    x, y, z = x + lift * nx, y + lift * ny, z + lift * nz
    for k in range(LANES):
        a, b, c = sample_cosine_hemisphere(_turned(pattern[begin + k, 0], u), _turned(pattern[begin + k, 1], v))
        real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = x, y, z
        real[ray.DIR_X + k] = a * ux + b * vx + c * nx
        real[ray.DIR_Y + k] = a * uy + b * vy + c * ny
        real[ray.DIR_Z + k] = a * uz + b * vz + c * nz
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, np.inf
        real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = _ZERO, _ZERO, _ZERO
        integer[ray.GEOM_ID + k] = INVALID_ID
        rays.alive[k] = -1


@inlined
def is_wide(atlas: Atlas, face: int) -> bool:
    """Return whether a triangle belongs to a flat region of some size: smaller mirrors scatter light like matt things."""
    wide: bool = (atlas.cells[face, 3] == GRID) & (atlas.cells[face, 1] > 2) & (atlas.cells[face, 2] > 2)
    return wide


@inlined
def follow(
    scene: SceneHandle,
    atlas: Atlas,
    surfaces: Surfaces,
    lights: Lights,
    seed: np.uint32,
    scratch: Scratch,
    found: GatherScratch,
) -> None:
    """Trace the packet's rays, on through clear glass and by mirrors, and write where each ends: a node, DARK or BEHIND.

    ``seen``: (16, 3), luminance of lights and of the sky that only rays by way of a mirror find.
    """
    rays = scratch.rays
    real, integer, alive = rays.real, rays.integer, rays.alive
    mirrored, links, seen = scratch.sampled, found.links, found.seen
    for k in range(LANES):
        links[k], mirrored[k] = DARK, 0
        seen[k, 0] = seen[k, 1] = seen[k, 2] = _ZERO
    going = LANES
    for depth in range(_DEEPEST):
        if going == 0:
            break
        intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
        scratch.traced[0] += going
        going = 0
        for k in range(LANES):
            if alive[k] == 0:
                continue
            alive[k] = 0
            if integer[ray.GEOM_ID + k] == INVALID_ID:
                continue
            face = integer[ray.PRIM_ID + k]
            part = surfaces.face_part[face]
            row = part * st.ROW_SIZE
            dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
            nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
            toward = -(dx * nx + dy * ny + dz * nz)
            table = surfaces.materials
            number = mix_bits(np.uint32(seed + np.uint32(LANES * depth + k)))
            u = np.float32(number >> np.uint32(8)) * np.float32(2.0**-24)
            if lights.face_group[face] >= 0 and toward > _ZERO:
                if mirrored[k] != 0:
                    cosine = toward / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY))
                    seen[k, 0], seen[k, 1], seen[k, 2] = surface_le(surfaces, part, dx, dy, dz, cosine)
                    continue
                if table[row + st.PORTAL] > _ZERO:
                    continue
            clear = (table[row + st.TRANSMISSION] > _HALF) & (table[row + st.PORTAL] == _ZERO)
            mirror = (table[row + st.METALLIC] > _HALF) & (table[row + st.ROUGHNESS] < _SMOOTH) & is_wide(atlas, face)
            if clear or mirror:
                share = _RED * table[row + st.BASE] + _GREEN * table[row + st.BASE + 1] + _BLUE * table[row + st.BASE + 2]
                share = np.sqrt(share) * np.float32(0.96) if clear else share
                if u >= share:
                    continue
                if mirror:
                    scale = np.float32(2.0) * toward / max(nx * nx + ny * ny + nz * nz, _TINY)
                    t = real[ray.TFAR + k]
                    real[ray.ORG_X + k] += t * dx
                    real[ray.ORG_Y + k] += t * dy
                    real[ray.ORG_Z + k] += t * dz
                    real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx + scale * nx, dy + scale * ny, dz + scale * nz
                    real[ray.TNEAR + k] = np.float32(1e-4)
                    mirrored[k] = 1
                else:
                    real[ray.TNEAR + k] = real[ray.TFAR + k] + np.float32(1e-4)
                real[ray.TFAR + k] = np.inf
                integer[ray.GEOM_ID + k] = INVALID_ID
                alive[k] = -1
                going += 1
                continue
            front = toward > _ZERO
            if not front and not has_back(atlas, face):
                links[k] = BEHIND
                continue
            links[k] = face if front else face + len(atlas.cells)
            found.at[k], found.at[LANES + k], found.at[2 * LANES + k] = real[ray.BARY_U + k], real[ray.BARY_V + k], u


@inlined
def choose_node(atlas: Atlas, worth: NDArray[np.float32], link: int, s: np.float32, t: np.float32, u: np.float32, found: GatherScratch) -> int:
    """Return one of the nodes around a hit, by weight times ``worth`` (n,); DARK where none is worth anything.

    ``link``: the triangle, plus the number of all where its back is hit; ``s``, ``t``: barycentric weights; ``u``: in [0, 1).
    """
    front = link < len(atlas.cells)
    face = link if front else link - len(atlas.cells)
    nodes, weights = found.nodes, found.weights
    count = find_nodes(atlas, face, s, t, front, nodes, weights)
    total = _ZERO
    for i in range(count):
        weights[i] *= worth[nodes[i]]
        total += weights[i]
    if total <= _ZERO:
        return nodes[0] if count > 0 else DARK
    left, chosen = u * total, 0
    while chosen + 1 < count and left >= weights[chosen]:
        left -= weights[chosen]
        chosen += 1
    return nodes[chosen]


@entry
def link_nodes(
    scene: SceneHandle,
    atlas: Atlas,
    surfaces: Surfaces,
    lights: Lights,
    key: np.uint32,
    pattern: NDArray[np.float32],
    scratch: Scratch,
    found: GatherScratch,
    links: NDArray[np.int32],
    at: NDArray[np.float32],
    far: NDArray[np.float32],
    seen: NDArray[np.float32],
    far_m: np.float32,
    first: int,
    end: int,
) -> None:
    """Fill what the s rays of nodes [first, end) hit: ``links`` (n, s), as of :func:`follow`, and ``at`` (n, 3, s), as of its ``at``.

    ``far``: (n,), the share of rays that end farther away than ``far_m``; ``seen``: (n, 3), illuminance by mirrors.
    """
    count = len(pattern)
    scale = _PI / np.float32(count)
    for node in range(first, end):
        u, v = _unit_hash(node, key)
        seed = mix_bits(np.uint32(np.uint32(node) * np.uint32(0x85EBCA6B)) ^ key)
        for begin in range(0, count, LANES):
            _aim(atlas, node, pattern, begin, u, v, scratch)
            follow(scene, atlas, surfaces, lights, seed + np.uint32(977 * begin), scratch, found)
            for k in range(LANES):
                links[node, begin + k] = found.links[k]
                far[node] += (_ONE if scratch.rays.real[ray.TFAR + k] > far_m and found.links[k] != BEHIND else _ZERO) / np.float32(count)
                for axis in range(3):
                    at[node, axis, begin + k] = found.at[LANES * axis + k]
                for channel in range(3):
                    seen[node, channel] += scale * found.seen[k, channel]


@entry
def resolve_links(atlas: Atlas, worth: NDArray[np.float32], at: NDArray[np.float32], found: GatherScratch, links: NDArray[np.int32], first: int, end: int) -> None:
    """Replace the triangles in ``links`` of nodes [first, end) by nodes around the hits."""
    for node in range(first, end):
        for i in range(links.shape[1]):
            if links[node, i] >= 0:
                links[node, i] = choose_node(atlas, worth, links[node, i], at[node, 0, i], at[node, 1, i], at[node, 2, i], found)


@entry
def gather_nodes(
    scene: SceneHandle,
    target: Atlas,
    source: Atlas,
    luminance: NDArray[np.float32],
    worth: NDArray[np.float32],
    bright: Bright,
    surfaces: Surfaces,
    lights: Lights,
    key: np.uint32,
    pattern: NDArray[np.float32],
    most_behind: np.float32,
    chosen: NDArray[np.int64],
    scratch: Scratch,
    found: GatherScratch,
    light: NodeLight,
    first: int,
    end: int,
) -> None:
    """Fill ``indirect`` and ``valid`` of the chosen nodes [first, end) of ``target``, and complete ``toward``, from light of ``source``.

    ``luminance``: (n, 3) that leaves the nodes of ``source``, cd/m2.
    """
    rays, directions = scratch.rays, found.toward
    count = len(pattern)
    for i in range(first, end):
        node = chosen[i]
        u, v = _unit_hash(node, key)
        seed = mix_bits(np.uint32(np.uint32(node) * np.uint32(0x85EBCA6B)) ^ key)
        nx, ny, nz = target.normal[node, 0], target.normal[node, 1], target.normal[node, 2]
        r = g = b = vx = vy = vz = behind = nearness = _ZERO
        for begin in range(0, count, LANES):
            _aim(target, node, pattern, begin, u, v, scratch)
            for j in range(3 * LANES):
                directions[j] = rays.real[ray.DIR_X + j]
            follow(scene, source, surfaces, lights, seed + np.uint32(977 * begin), scratch, found)
            for k in range(LANES):
                red, green, blue = found.seen[k, 0], found.seen[k, 1], found.seen[k, 2]
                link = found.links[k]
                if link >= 0:
                    link = choose_node(source, worth, link, found.at[k], found.at[LANES + k], found.at[2 * LANES + k], found)
                if link >= 0 and not (bright.chosen[link] and scratch.sampled[k] == 0 and rays.real[ray.TFAR + k] > bright.near_m):
                    red, green, blue = red + luminance[link, 0], green + luminance[link, 1], blue + luminance[link, 2]
                behind += _ONE if link == BEHIND else _ZERO
                nearness += _ONE / max(rays.real[ray.TFAR + k], _CLEAR_M)
                r, g, b = r + red, g + green, b + blue
                dx, dy, dz = directions[k], directions[LANES + k], directions[2 * LANES + k]
                cosine = max(dx * nx + dy * ny + dz * nz, _LEAST_COSINE)
                weight = (_RED * red + _GREEN * green + _BLUE * blue) / cosine
                vx, vy, vz = vx + weight * dx, vy + weight * dy, vz + weight * dz
        # Rays that see the inside of something began within it: the others stand for them.
        scale = _PI / max(np.float32(count) - behind, _ONE)
        r, g, b, vx, vy, vz = scale * r, scale * g, scale * b, scale * vx, scale * vy, scale * vz
        if len(bright.point) > 0:
            _stand_on(target, node, scratch)
            for begin in range(0, len(bright.point), LANES):
                red, green, blue, dx, dy, dz = _light_of_bright(scene, surfaces, bright, begin, scratch)
                r, g, b, vx, vy, vz = r + red, g + green, b + blue, vx + dx, vy + dy, vz + dz
        light.indirect[node, 0] += r
        light.indirect[node, 1] += g
        light.indirect[node, 2] += b
        light.open_m[node] = np.float32(count) / max(nearness, _TINY)
        light.valid[node] = _ONE if behind <= most_behind * np.float32(count) else _ZERO
        total = (
            _RED * (light.indirect[node, 0] + light.direct[node, 0])
            + _GREEN * (light.indirect[node, 1] + light.direct[node, 1])
            + _BLUE * (light.indirect[node, 2] + light.direct[node, 2])
        )
        over = _ONE / max(total, _TINY)
        light.toward[node, 0] = (light.toward[node, 0] + vx) * over
        light.toward[node, 1] = (light.toward[node, 1] + vy) * over
        light.toward[node, 2] = (light.toward[node, 2] + vz) * over


@inlined
def _light_of_bright(
    scene: SceneHandle, surfaces: Surfaces, bright: Bright, begin: int, scratch: Scratch
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance (r, g, b) by 16 samples of bright nodes, and luminance times direction."""
    lanes = scratch.lanes
    for k in range(LANES):
        i = begin + k
        x, y, z = (
            bright.point[i, 0] - lanes[ln.P_X + k],
            bright.point[i, 1] - lanes[ln.P_Y + k],
            bright.point[i, 2] - lanes[ln.P_Z + k],
        )
        squared = x * x + y * y + z * z
        inverse = _ONE / np.sqrt(max(squared, _TINY))
        here = (x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]) * inverse
        there = -(x * bright.normal[i, 0] + y * bright.normal[i, 1] + z * bright.normal[i, 2]) * inverse
        arrives = (here > _ZERO) & (there > _ZERO) & (squared > bright.near_m * bright.near_m)
        weight = there / max(squared, _TINY) if arrives else _ZERO
        lanes[ln.LI_R + k] = weight * bright.weight[i, 0]
        lanes[ln.LI_G + k] = weight * bright.weight[i, 1]
        lanes[ln.LI_B + k] = weight * bright.weight[i, 2]
        lanes[ln.LIGHT_PDF + k] = _ONE if arrives else _ZERO
        # The ray ends off the surface that shines.
        reach = _ONE - _CLEAR_M * inverse / max(there, _LEAST_COSINE)
        lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = reach * x, reach * y, reach * z
    pass_glass(scene, surfaces, lanes, scratch)
    r = g = b = vx = vy = vz = _ZERO
    for k in range(LANES):
        if lanes[ln.LIGHT_PDF + k] > _ZERO:
            _, dx, dy, dz, cosine = _arriving(lanes, k)
            red, green, blue = lanes[ln.LI_R + k], lanes[ln.LI_G + k], lanes[ln.LI_B + k]
            r, g, b = r + cosine * red, g + cosine * green, b + cosine * blue
            weight = _RED * red + _GREEN * green + _BLUE * blue
            vx, vy, vz = vx + weight * dx, vy + weight * dy, vz + weight * dz
    return r, g, b, vx, vy, vz


@entry
def solve_links(
    links: NDArray[np.int32],
    given: NDArray[np.float32],
    seen: NDArray[np.float32],
    albedo: NDArray[np.float32],
    glow: NDArray[np.float32],
    sweeps: int,
    luminance: NDArray[np.float32],
) -> None:
    """Fill ``luminance`` (n, 3), cd/m2: what leaves each node once light has passed along the links until it settles (Gauss and Seidel).

    ``given``: (n, 3), illuminance by lights and sun, lux; ``seen``: as of :func:`link_nodes`.
    """
    count = links.shape[1]
    for _ in range(sweeps):
        for node in range(len(links)):
            r = g = b = _ZERO
            free = 0
            for i in range(count):
                link = links[node, i]
                free += link != BEHIND
                if link >= 0:
                    r, g, b = r + luminance[link, 0], g + luminance[link, 1], b + luminance[link, 2]
            scale = _PI / np.float32(max(free, 1))
            luminance[node, 0] = albedo[node, 0] * _INVERSE_PI * (scale * r + seen[node, 0] + given[node, 0]) + glow[node, 0]
            luminance[node, 1] = albedo[node, 1] * _INVERSE_PI * (scale * g + seen[node, 1] + given[node, 1]) + glow[node, 1]
            luminance[node, 2] = albedo[node, 2] * _INVERSE_PI * (scale * b + seen[node, 2] + given[node, 2]) + glow[node, 2]
