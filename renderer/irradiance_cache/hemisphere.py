"""The hemisphere of a node: rays that go on through clear glass and by mirrors, and the nodes that they end at."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import embree as ray
from renderer.core.color import LUMINANCE, Rgb
from renderer.core.embree import INVALID_ID, LANES, MEET_ALL, PASS_PANES, SceneHandle, intersect16
from renderer.core.kernel import inlined
from renderer.core.layout import Layout
from renderer.core.random_numbers import mix_bits
from renderer.core.sampling import coordinate_system, sample_cosine_hemisphere
from renderer.irradiance_cache.atlas import GRID, Atlas, find_nodes, has_back
from renderer.irradiance_cache.nodes import turned
from renderer.irradiance_cache.specular import go_on, is_clear, is_mirror
from renderer.path import surface_tables as st
from renderer.path.emission import pane_transmittance, surface_le
from renderer.path.infinite_light import sky_le
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import lift_height
from renderer.scene.flat_scene import Sky

_ZERO, _HALF, _ONE, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(1e-20)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_DEEPEST = 8
_LEAN = np.float32(0.7)

DARK, BEHIND = -1, -2
"""Links of rays that end at no node: at a light, a pane or nothing; at the inside of a closed part."""

# A row of sights: how a ray sees a lamp or the sky by way of a mirror, or what is outside.
_SIGHT = Layout()
PASSED = _SIGHT.field()  # what panes let through of rays that go outside, 0 of others
AHEAD = _SIGHT.field(3)  # the ray's unit direction; outside, the normal of what it sees
COSINE = _SIGHT.field()  # between the ray and the lamp's normal
SIGHT = _SIGHT.size


class GatherScratch(NamedTuple):
    """Memory of one thread.

    nodes, weights: (4,), those around a hit; links: (16,) int32, at: (48,), sighted: (16,) int32 and sights: (16, SIGHT), of a packet, as
    :func:`follow` fills them; toward: (48,), directions of a packet.
    """

    nodes: NDArray[np.int32]
    weights: NDArray[np.float32]
    links: NDArray[np.int32]
    at: NDArray[np.float32]
    sighted: NDArray[np.int32]
    sights: NDArray[np.float32]
    toward: NDArray[np.float32]


def make_gather_scratch() -> GatherScratch:
    """Return the memory that one thread needs to gather."""
    return GatherScratch(
        np.zeros(4, np.int32),
        np.zeros(4, np.float32),
        np.zeros(LANES, np.int32),
        np.zeros(3 * LANES, np.float32),
        np.zeros(LANES, np.int32),
        np.zeros((LANES, SIGHT), np.float32),
        np.zeros(3 * LANES, np.float32),
    )


@inlined
def aim_hemisphere(
    atlas: Atlas, node: int, pattern: NDArray[np.float32], begin: int, u: np.float32, v: np.float32, scratch: Scratch
) -> None:
    """Fill the packet with 16 rays of a node's hemisphere, with density cosine / pi."""
    rays = scratch.rays
    real, integer = rays.real, rays.integer
    x, y, z = atlas.position[node, 0], atlas.position[node, 1], atlas.position[node, 2]
    nx, ny, nz = atlas.normal[node, 0], atlas.normal[node, 1], atlas.normal[node, 2]
    ux, uy, uz, vx, vy, vz = coordinate_system(nx, ny, nz)
    lift = lift_height(x, y, z)
    x, y, z = x + lift * nx, y + lift * ny, z + lift * nz
    for k in range(LANES):
        a, b, c = sample_cosine_hemisphere(turned(pattern[begin + k, 0], u), turned(pattern[begin + k, 1], v))
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
def outside_light(sky: Sky, nx: np.float32, ny: np.float32, nz: np.float32) -> Rgb:
    """Return about the mean luminance (r, g, b) of the sky around a unit normal of the world, weighted by the cosine, cd/m2.

    From two directions, 35 degrees above and below.
    """
    up, down = nz + _LEAN, nz - _LEAN
    high = _ONE / np.sqrt(max(nx * nx + ny * ny + up * up, _TINY))
    low = _ONE / np.sqrt(max(nx * nx + ny * ny + down * down, _TINY))
    r, g, b = sky_le(sky, nx * high, ny * high, up * high)
    red, green, blue = sky_le(sky, nx * low, ny * low, down * low)
    return _HALF * (r + red), _HALF * (g + green), _HALF * (b + blue)


@inlined
def sighted_light(surfaces: Surfaces, part: int, sights: NDArray[np.float32], i: int) -> Rgb:
    """Return the luminance (r, g, b) that the ray of row ``i`` of ``sights`` (n, SIGHT) sees of a part, cd/m2."""
    passed, x, y, z = sights[i, PASSED], sights[i, AHEAD], sights[i, AHEAD + 1], sights[i, AHEAD + 2]
    if passed > _ZERO:
        row, table = part * st.ROW_SIZE, surfaces.materials
        r, g, b = outside_light(surfaces.sky, x, y, z)
        return passed * table[row + st.BASE] * r, passed * table[row + st.BASE + 1] * g, passed * table[row + st.BASE + 2] * b
    return surface_le(surfaces, part, x, y, z, sights[i, COSINE])


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

    ``sighted``: (16,), the part whose light only such rays find, or -1: lamps and the sky by way of a mirror, and what is outside.
    """
    rays = scratch.rays
    real, integer, alive = rays.real, rays.integer, rays.alive
    mirrored, links, sighted, sights = scratch.sampled, found.links, found.sighted, found.sights
    for k in range(LANES):
        links[k], mirrored[k], sighted[k], sights[k, PASSED] = DARK, 0, -1, _ZERO
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
            if sights[k, PASSED] > _ZERO:
                scale = (_ONE if toward > _ZERO else -_ONE) / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY))
                sighted[k], sights[k, AHEAD], sights[k, AHEAD + 1], sights[k, AHEAD + 2] = part, scale * nx, scale * ny, scale * nz
                continue
            if lights.face_group[face] >= 0 and toward > _ZERO:
                if mirrored[k] != 0:
                    sighted[k], sights[k, AHEAD], sights[k, AHEAD + 1], sights[k, AHEAD + 2] = part, dx, dy, dz
                    sights[k, COSINE] = toward / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY))
                    continue
                if table[row + st.PORTAL] > _ZERO:
                    # On to what stands outside; the sky itself is sampled as a light.
                    cosine = toward / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY))
                    sights[k, PASSED] = pane_transmittance(surfaces, part, cosine)
                    real[ray.TNEAR + k], real[ray.TFAR + k] = real[ray.TFAR + k], np.inf
                    integer[ray.GEOM_ID + k], integer[ray.MASK + k] = INVALID_ID, PASS_PANES
                    alive[k] = -1
                    going += 1
                    continue
            clear, mirror = is_clear(table, row), is_mirror(table, row) and is_wide(atlas, face)
            if clear or mirror:
                share = _RED * table[row + st.BASE] + _GREEN * table[row + st.BASE + 1] + _BLUE * table[row + st.BASE + 2]
                # What a face of glass mirrors sees a room that is about as bright: only its colour takes light away.
                share = np.sqrt(share) if clear else share
                if u >= share:
                    continue
                go_on(rays, k, mirror)
                mirrored[k] = 1 if mirror else mirrored[k]
                going += 1
                continue
            front = toward > _ZERO
            if not front and not has_back(atlas, face):
                links[k] = BEHIND
                continue
            links[k] = face if front else face + len(atlas.cells)
            found.at[k], found.at[LANES + k], found.at[2 * LANES + k] = real[ray.BARY_U + k], real[ray.BARY_V + k], u
    # The packet serves others, whose rays panes stop.
    for k in range(LANES):
        integer[ray.MASK + k] = MEET_ALL


@inlined
def choose_node(
    atlas: Atlas, worth: NDArray[np.float32], link: int, s: np.float32, t: np.float32, u: np.float32, found: GatherScratch
) -> int:
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
        return int(nodes[0]) if count > 0 else DARK
    left, chosen = u * total, 0
    while chosen + 1 < count and left >= weights[chosen]:
        left -= weights[chosen]
        chosen += 1
    return int(nodes[chosen])
