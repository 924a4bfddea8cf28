"""The hemisphere of a node: rays that go on through clear glass and by mirrors, and the nodes that they end at."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import fresnel_thin_dielectric
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE, Rgb
from renderer.core.embree import intersect16
from renderer.core.kernel import inlined
from renderer.core.layout import Layout
from renderer.core.random_numbers import mix_bits, unit_of
from renderer.core.ray_packet import INVALID_ID, LANES, MEET_ALL, PASS_PANES, Packet
from renderer.core.sampling import coordinate_system, sample_cosine_hemisphere
from renderer.irradiance_cache.nodes import turned
from renderer.irradiance_cache.specular import SMOOTH, clear_share, go_on, is_clear, is_mirror
from renderer.path import surface_tables as st
from renderer.path.emission import pane_transmittance, surface_le
from renderer.path.light_nodes import GRID, Atlas, find_nodes, has_back
from renderer.path.records import LitScene, Scratch
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-20)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_DEEPEST = 8

DARK, ESCAPED, BEHIND, UNKNOWN = -1, -2, -3, -4
"""Links of rays that end at no node: at a light or beyond a pane; at nothing, from where no pane leads out; at the inside of a closed part;
where all nodes lie within things.

What arrives by the last two is not known, and the other rays of a node stand for them, so that no light is lost.
"""

INDOORS, MIRRORED, OUTDOORS = range(3)
"""``Scratch.sampled`` of rays: straight ones, those that have met a mirror, and those that have left by a pane."""
NO_MIRROR, _OTHER = -1, -2
"""``mirror`` of rays that nothing has mirrored, and of those that more than one flat mirror has, or a pane by chance, or one's back."""

# A row of sights: how a ray sees a lamp or the sky by way of a mirror.
_SIGHT = Layout()
AHEAD = _SIGHT.field(3)  # the ray's unit direction
COSINE = _SIGHT.field()  # between the ray and the lamp's normal
SIGHT = _SIGHT.size


class Rays(NamedTuple):
    """How nodes look around them.

    key: of their random numbers; pattern: (s, 2) float32, points of the unit square that stand for their rays, s a multiple of 16; far_m:
    what ends farther away does not count as close by; most_behind: share of the rays that may see the inside of something before a node
    counts as one within it.
    """

    key: np.uint32
    pattern: NDArray[np.float32]
    far_m: np.float32
    most_behind: np.float32


class GatherScratch(NamedTuple):
    """Memory of one thread.

    trace: rays and lanes; links: (16,) int32, at: (48,), sighted, mirror: (16,) int32 and sights: (16,
    SIGHT), of a packet, as :func:`follow` fills them; toward: (48,), directions of a packet; certain: (1,) int32, the mirror or pane, as
    in ``mirror``, that sends all rays on, not by chance, -1 for none.
    """

    trace: Scratch
    links: NDArray[np.int32]
    at: NDArray[np.float32]
    sighted: NDArray[np.int32]
    mirror: NDArray[np.int32]
    sights: NDArray[np.float32]
    toward: NDArray[np.float32]
    certain: NDArray[np.int32]


def make_gather_scratch(trace: Scratch) -> GatherScratch:
    """Return the memory that one thread needs to gather, beside its rays and lanes."""
    links, sighted, mirror = np.zeros((3, LANES), np.int32)
    at, toward = np.zeros((2, 3 * LANES), np.float32)
    return GatherScratch(trace, links, at, sighted, mirror, np.zeros((LANES, SIGHT), np.float32), toward, np.full(1, -1, np.int32))


@inlined
def node_seed(node: int, key: np.uint32) -> np.uint32:
    """Return the seed of a node's rays."""
    return mix_bits(np.uint32(np.uint32(node) * np.uint32(0x85EBCA6B)) ^ key)


@inlined
def aim_hemisphere(atlas: Atlas, node: int, pattern: NDArray[np.float32], begin: int, u: np.float32, v: np.float32, rays: Packet) -> None:
    """Aim 16 rays of a node's hemisphere, with density cosine / pi, by ``pattern`` from ``begin`` on, shifted by (u, v)."""
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


def find_mirrors(surfaces: Surfaces, atlas: Atlas) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which triangles (m,) are mirrors for the rays of nodes, and which are panes of such a size."""
    rows, cells = surfaces.materials.reshape(-1, st.ROW_SIZE)[surfaces.face_part], atlas.cells
    wide = (cells[:, 3] == GRID) & (cells[:, 1] > 2) & (cells[:, 2] > 2)
    return (rows[:, st.METALLIC] > 0.5) & (rows[:, st.ROUGHNESS] < SMOOTH) & wide, (rows[:, st.PORTAL] > 0.0) & wide


@inlined
def sighted_light(surfaces: Surfaces, part: int, sights: NDArray[np.float32], i: int) -> Rgb:
    """Return the luminance (r, g, b) that the ray of row ``i`` of ``sights`` (n, SIGHT) sees of a part, cd/m2."""
    return surface_le(surfaces, part, sights[i, AHEAD], sights[i, AHEAD + 1], sights[i, AHEAD + 2], sights[i, COSINE])


@inlined
def follow(scene: LitScene, atlas: Atlas, seed: np.uint32, memory: GatherScratch) -> None:
    """Trace the packet's rays, on through clear glass and by mirrors, and write where each ends: a node, DARK, ESCAPED or BEHIND.

    ``sighted``: the part whose light only such rays find, or -1: lamps and the sky by way of a mirror; ``mirror``: where the
    nodes of the only mirror on its way begin in ``grid``, NO_MIRROR if there is none, another negative number if all that is not known.
    """
    scratch, rays = memory.trace, memory.trace.rays
    real, integer, alive = rays.real, rays.integer, rays.alive
    for k in range(LANES):
        memory.links[k], scratch.sampled[k], memory.sighted[k], memory.mirror[k] = DARK, INDOORS, -1, NO_MIRROR
    going = LANES
    for depth in range(_DEEPEST):
        if going == 0:
            break
        intersect16(alive.ctypes.data, scene.tree.address, real.ctypes.data, scene.tree.incoherent)
        scratch.traced[0] += going
        going = 0
        for k in range(LANES):
            traced, met = alive[k] != 0, integer[ray.GEOM_ID + k] != INVALID_ID
            alive[k] = 0
            if traced and not met and scratch.sampled[k] != OUTDOORS:
                memory.links[k] = ESCAPED
            elif traced and met:
                going += _meet(scene, atlas, np.uint32(seed + np.uint32(LANES * depth + k)), k, memory)
    # The packet serves others, whose rays panes stop.
    for k in range(LANES):
        integer[ray.MASK + k] = MEET_ALL


@inlined
def _meet(scene: LitScene, atlas: Atlas, seed: np.uint32, k: int, memory: GatherScratch) -> int:
    """Send ray k on from what it has hit and return 1, or write where it ends and return 0."""
    surfaces, ways, rays = scene.surfaces, memory.trace.sampled, memory.trace.rays
    real, table = rays.real, surfaces.materials
    face = rays.integer[ray.PRIM_ID + k]
    part = surfaces.face_part[face]
    row = part * st.ROW_SIZE
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    toward = -(dx * nx + dy * ny + dz * nz)
    u, front = unit_of(mix_bits(seed)), toward > _ZERO
    certain = front and atlas.cells[face, 0] == memory.certain[0] and atlas.cells[face, 3] == GRID
    # What stands before the sky that a mirror shows hides it.
    if memory.sighted[k] >= 0:
        hidden, memory.sighted[k] = memory.sighted[k], -1
        if u >= pane_transmittance(surfaces, hidden, memory.sights[k, COSINE]):
            return 0
    # Lamps and panes.  Nodes sample them as lights, so rays take note of them by way of mirrors only; panes mirror surfaces.
    if front and ways[k] != OUTDOORS:
        cosine = toward / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY))
        if scene.lights.face_group[face] >= 0 and ways[k] == MIRRORED:
            _sight(part, dx, dy, dz, cosine, k, memory)
            return _leave(bool(table[row + st.PORTAL] > _ZERO), k, memory)
        if table[row + st.PORTAL] > _ZERO:
            mirrored = fresnel_thin_dielectric(cosine, table[row + st.IOR])
            if certain or u < mirrored:
                # Lamps that panes show by chance are sampled as their images are.
                memory.mirror[k] = atlas.cells[face, 0] if certain and memory.mirror[k] == NO_MIRROR else _OTHER
                ways[k] = MIRRORED if certain else ways[k]
                go_on(rays, k, True)
                return 1
            return _leave(bool(u < mirrored + pane_transmittance(surfaces, part, cosine)), k, memory)
    # Clear glass and mirrors send on the share of the rays that they send on of the light; others see what the front of glass scatters.
    indoors = ways[k] != OUTDOORS
    clear, mirror = indoors and is_clear(table, row), indoors and is_mirror(table, row) and is_wide(atlas, face)
    if clear and front:
        share = _RED * clear_share(table, row, 0) + _GREEN * clear_share(table, row, 1) + _BLUE * clear_share(table, row, 2)
        if u < share:
            go_on(rays, k, False)
            return 1
        u = (u - share) / (_ONE - share)
    elif clear or mirror:
        share = _RED * table[row + st.BASE] + _GREEN * table[row + st.BASE + 1] + _BLUE * table[row + st.BASE + 2]
        # What the far face of glass sends back sees a room that is about as bright: only its colour takes light away.
        if u >= (np.sqrt(share) if clear else share) and not certain:
            return 0
        go_on(rays, k, mirror)
        if mirror:
            memory.mirror[k] = atlas.cells[face, 0] if front and memory.mirror[k] == NO_MIRROR else _OTHER
            ways[k] = MIRRORED
        return 1
    # All else: a node near the hit, which is chosen later.
    if front or has_back(atlas, face):
        memory.links[k] = face if front else face + len(atlas.cells)
        memory.at[k], memory.at[LANES + k], memory.at[2 * LANES + k] = real[ray.BARY_U + k], real[ray.BARY_V + k], u
    else:
        memory.links[k] = BEHIND
    return 0


@inlined
def _sight(part: int, x: np.float32, y: np.float32, z: np.float32, cosine: np.float32, k: int, memory: GatherScratch) -> None:
    """Let ray k see the light of a part along a unit direction."""
    sights = memory.sights
    memory.sighted[k], sights[k, AHEAD], sights[k, AHEAD + 1], sights[k, AHEAD + 2], sights[k, COSINE] = part, x, y, z, cosine


@inlined
def _leave(passes: bool, k: int, memory: GatherScratch) -> int:
    """Send ray k on through a pane to what stands outside, if it passes, and return whether; the sky itself is sampled as a light."""
    if not passes:
        return 0
    rays = memory.trace.rays
    memory.trace.sampled[k] = OUTDOORS
    rays.real[ray.TNEAR + k], rays.real[ray.TFAR + k] = rays.real[ray.TFAR + k], np.inf
    rays.integer[ray.GEOM_ID + k], rays.integer[ray.MASK + k] = INVALID_ID, PASS_PANES
    rays.alive[k] = -1
    return 1


@inlined
def choose_node(
    atlas: Atlas, worth: NDArray[np.float32], link: int, s: np.float32, t: np.float32, u: np.float32, memory: GatherScratch
) -> int:
    """Return one of the nodes around a hit, by weight times ``worth`` (n,); the first where none is worth anything, UNKNOWN without any.

    ``link``: the triangle, plus the number of all where its back is hit; ``s``, ``t``: barycentric weights; ``u``: in [0, 1).
    """
    front = link < len(atlas.cells)
    face = link if front else link - len(atlas.cells)
    nodes, weights = memory.trace.nodes, memory.trace.weights
    count = find_nodes(atlas, face, s, t, front, nodes, weights)
    total = _ZERO
    for i in range(count):
        weights[i] *= worth[nodes[i]]
        total += weights[i]
    if total <= _ZERO:
        return int(nodes[0]) if count > 0 else UNKNOWN
    rest, chosen = u * total, 0
    while chosen + 1 < count and rest >= weights[chosen]:
        rest -= weights[chosen]
        chosen += 1
    return int(nodes[chosen])
