"""Rays that ask about nodes once: what stands between two of them, what their surface reflects, what lies before or behind triangles."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import WIDE, coat_albedo, diffuse_albedo, passed_albedo, specular_albedo
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.core.sampling import coordinate_system
from renderer.irradiance_cache.specular import is_clear, scattered_share
from renderer.path import surface_tables as st
from renderer.path.light_nodes import Atlas
from renderer.path.records import LitScene, Scratch
from renderer.path.scattering import build_bsdfs
from renderer.path.surfaces import evaluate_surfaces

_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_LOW_M, _HIGH_M = np.float32(3e-3), np.float32(15e-3)
_FARTHEST = np.float32(1.005)


@entry
def find_cuts(scene: SceneHandle, atlas: Atlas, grids: NDArray[np.int32], scratch: Scratch, first: int, end: int) -> None:
    """Fill ``cuts`` of grids [first, end): where the way to the next node is blocked, 3 mm above the surface or 15 mm, as by shelves.

    ``grids``: (c, 3), first place, width and height.  A way is seen from either end, and a little beyond the other, as a sheet may stand
    on a node; what blocks it stands midway between the two hits.
    """
    for grid in range(first, end):
        for begin in range(0, 2 * grids[grid, 1] * grids[grid, 2], LANES // 2):
            # Eight ways, two rays each: there and back.
            for above_m in (_LOW_M, _HIGH_M):
                if _find_ways(scene, atlas, grids[grid], begin, above_m, scratch):
                    _cut_ways(atlas, grids[grid], begin, scratch.rays)


@inlined
def _find_ways(scene: SceneHandle, atlas: Atlas, grid: NDArray[np.int32], begin: int, above_m: np.float32, scratch: Scratch) -> bool:
    """Trace eight ways of a grid, from number ``begin`` on, as far as they are not cut; return whether there are any."""
    packet = scratch.rays
    real, integer, alive = packet.real, packet.integer, packet.alive
    offset, width, height = grid[0], grid[1], grid[2]
    count = 0
    for k in range(LANES):
        way = begin + (k >> 1)
        alive[k] = 0
        integer[ray.GEOM_ID + k] = INVALID_ID
        place, upward = way >> 1, way & 1
        if way >= 2 * width * height or (place // width + 1 >= height if upward else place % width + 1 >= width):
            continue
        a, b = atlas.grid[offset + place], atlas.grid[offset + place + (width if upward else 1)]
        if a < 0 or b < 0 or not np.isnan(atlas.cuts[offset + place, upward]):
            continue
        if k & 1:
            a, b = b, a
        for axis in range(3):
            at = LANES * axis + k
            real[ray.ORG_X + at] = atlas.position[a, axis] + above_m * atlas.normal[a, axis]
            real[ray.DIR_X + at] = atlas.position[b, axis] - atlas.position[a, axis]
        real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, _FARTHEST
        alive[k] = -1
        count += 1
    if count == 0:
        return False
    intersect16(alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
    scratch.traced[0] += count
    return True


@inlined
def _cut_ways(atlas: Atlas, grid: NDArray[np.int32], begin: int, packet: Packet) -> None:
    """Cut those of eight ways that are blocked; where one of its two rays met nothing, the other's hit stands for both."""
    for k in range(0, LANES, 2):
        hence, thence = packet.integer[ray.GEOM_ID + k] != INVALID_ID, packet.integer[ray.GEOM_ID + k + 1] != INVALID_ID
        if hence or thence:
            way, far = begin + (k >> 1), _ONE - packet.real[ray.TFAR + k + 1]
            near = packet.real[ray.TFAR + k] if hence else far
            atlas.cuts[grid[0] + (way >> 1), way & 1] = _HALF * (near + (far if thence else near))


class Looks(NamedTuple):
    """What the surfaces of n nodes do with light, (n, 3) float32 each: means over the hemisphere of directions to the eye.

    albedo: what they reflect, for clear glass over all that does not go on through it; matt: what of that is not mirrored by lobes narrower
    than :data:`renderer.bsdf.reflectance.WIDE`; passed: what they let through of light on their other side; glow: luminance of their own
    that no light sampling finds, cd/m2.
    """

    albedo: NDArray[np.float32]
    matt: NDArray[np.float32]
    passed: NDArray[np.float32]
    glow: NDArray[np.float32]


_SLANTS = np.array([0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263], np.float32)
"""Cosines from which a node is looked at, those of Gauss's and Legendre's rule: exact means over the hemisphere of (1 - cosine)^5."""
_SHARES = _SLANTS * np.array([0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538], np.float32)
"""What each counts of the hemisphere: the rule's weight, times the cosine."""


NOTHING, OWN_BACK, OTHER = range(3)
"""What a ray hits first: nothing, the back of its own part's surface, all else."""


@entry
def probe(
    scene: SceneHandle,
    origin: NDArray[np.float32],
    direction: NDArray[np.float32],
    part: NDArray[np.int32],
    face_part: NDArray[np.int32],
    scratch: Scratch,
    met: NDArray[np.int8],
) -> None:
    """Tell for each ray, (r, 3) each, what it hits first: NOTHING, OWN_BACK or OTHER."""
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
            met[begin + k] = NOTHING
            if integer[ray.GEOM_ID + k] != INVALID_ID:
                along = _ZERO
                for axis in range(0, 3 * LANES, LANES):
                    along += real[ray.DIR_X + axis + k] * real[ray.NG_X + axis + k]
                is_own = face_part[integer[ray.PRIM_ID + k]] == part[begin + k]
                met[begin + k] = OWN_BACK if (along > _ZERO) & is_own else OTHER


@entry
def reflect_nodes(
    scene: LitScene,
    atlas: Atlas,
    width_m: np.float32,
    scratch: Scratch,
    looks: Looks,
    first: int,
    end: int,
) -> None:
    """Add to ``looks`` of nodes [first, end).  ``width_m``: over how much of the surface textures are averaged."""
    rays, lanes, surfaces = scratch.rays, scratch.lanes, scene.surfaces
    albedo, matt, passed, glow = looks.albedo, looks.matt, looks.passed, looks.glow
    real, integer = rays.real, rays.integer
    for begin in range(first, end, LANES):
        for slant in range(len(_SLANTS)):
            cosine, share = _SLANTS[slant], _SHARES[slant]
            sine = np.sqrt(_ONE - cosine * cosine)
            # Rays that have hit the nodes, each from one slope, as Embree would leave them.
            for k in range(LANES):
                node = min(begin + k, end - 1)
                nx, ny, nz = atlas.normal[node, 0], atlas.normal[node, 1], atlas.normal[node, 2]
                tx, ty, tz, _, _, _ = coordinate_system(nx, ny, nz)
                dx, dy, dz = -cosine * nx - sine * tx, -cosine * ny - sine * ty, -cosine * nz - sine * tz
                real[ray.ORG_X + k] = atlas.position[node, 0] - dx
                real[ray.ORG_Y + k] = atlas.position[node, 1] - dy
                real[ray.ORG_Z + k] = atlas.position[node, 2] - dz
                real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k] = dx, dy, dz
                real[ray.TFAR + k] = _ONE
                real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = nx, ny, nz
                integer[ray.GEOM_ID + k], integer[ray.PRIM_ID + k] = 0, atlas.face[node]
                real[ray.BARY_U + k], real[ray.BARY_V + k] = atlas.weight[node, 0], atlas.weight[node, 1]
                rays.alive[k] = -1
                lanes[ln.WIDTH + k], lanes[ln.SPREAD + k], lanes[ln.OUTSIDE + k] = width_m, _ZERO, _ZERO
                lanes[ln.RAY_PDF + k] = np.inf
            evaluate_surfaces(scene, True, False, _ZERO, scratch)
            kinds = build_bsdfs(surfaces, True, scratch)
            for k in range(min(LANES, end - begin)):
                node, part = begin + k, scratch.parts[k]
                row = part * st.ROW_SIZE
                matt_r, matt_g, matt_b = diffuse_albedo(lanes, kinds, k)
                r, g, b = specular_albedo(lanes, kinds, k)
                coat = coat_albedo(lanes, kinds, k)
                r, g, b = matt_r + r + coat, matt_g + g + coat, matt_b + b + coat
                clear = is_clear(surfaces.materials, row)
                if clear:
                    r = scattered_share(surfaces.materials, row, 0, r)
                    g = scattered_share(surfaces.materials, row, 1, g)
                    b = scattered_share(surfaces.materials, row, 2, b)
                if clear or (lanes[ln.ROUGHNESS + k] >= WIDE and coat == _ZERO):
                    matt_r, matt_g, matt_b = r, g, b
                albedo[node, 0], matt[node, 0] = albedo[node, 0] + share * min(r, _ONE), matt[node, 0] + share * min(matt_r, _ONE)
                albedo[node, 1], matt[node, 1] = albedo[node, 1] + share * min(g, _ONE), matt[node, 1] + share * min(matt_g, _ONE)
                albedo[node, 2], matt[node, 2] = albedo[node, 2] + share * min(b, _ONE), matt[node, 2] + share * min(matt_b, _ONE)
                r, g, b = passed_albedo(lanes, kinds, k)
                passed[node, 0], passed[node, 1], passed[node, 2] = (
                    passed[node, 0] + share * r,
                    passed[node, 1] + share * g,
                    passed[node, 2] + share * b,
                )
                if surfaces.materials[row + st.GLOW] > _ZERO:
                    for channel in range(3):
                        glow[node, channel] += share * lanes[ln.LE_R + LANES * channel + k]
