"""Caustics: light of lamps, sky and sun that gloss mirrors, traced as photons to the first surface that scatters it.

A caustic map (Jensen, "Global Illumination using Photon Maps", 1996): a photon that meets gloss goes on by one of its microfacets, with
all that these reflect, and is left at the coarse nodes that it meets then.  Gathering by rays would find such light by chance only.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.layers import COAT_F0, boundary_reflectance, look_up_mean
from renderer.bsdf.microfacet import schlick_albedo
from renderer.bsdf.reflectance import reflected_share
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.embree import intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.random_numbers import mix_bits
from renderer.core.ray_packet import INVALID_ID, LANES, MEET_ALL
from renderer.core.sampling import coordinate_system, sample_cosine_hemisphere
from renderer.core.workers import Pieces
from renderer.irradiance_cache.nodes import scatterer_of, scatters_all
from renderer.irradiance_cache.photons import LEFT, MET, Photons, pass_smooth, unit
from renderer.irradiance_cache.specular import Lobe, metal_lobe, mirror_by_facet
from renderer.path import surface_tables as st
from renderer.path.emission import surface_le
from renderer.path.light_nodes import Atlas, find_nodes
from renderer.path.lights import (
    BY_SKY,
    EMITTER_CORNER,
    EMITTER_EDGE_1,
    EMITTER_EDGE_2,
    EMITTER_NORMAL,
    EMITTER_SIZE,
    Lights,
    sample_triangle,
)
from renderer.path.records import LitScene, Scratch
from renderer.path.sun_patches import aim, shine_in
from renderer.path.surface_tables import Surfaces

_ZERO, _HALF, _ONE, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(1e-20)
_PI = np.float32(np.pi)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
PHOTONS = 65536
"""How many the panes send of the sky's light, and lamps of theirs."""
_PIECE = 16384
_SKY, _SUN = 0x51ED270B, 2
_START_M = np.float32(2e-3)
_LEAST_COSINE = np.float32(0.05)
_DEEPEST = 12
_STRAIGHT, _MIRRORED = 0, 1
"""``Scratch.sampled`` of photons: whether gloss has mirrored them."""


class Caustics(NamedTuple):
    """What photons leave at n coarse nodes, float32.

    lumen: (n, 3), flux as far as it counts for what nodes scatter; toward: (n, 3), its luminance times direction over cosine, world;
    hits: (n,), how many photons these are.
    """

    lumen: NDArray[np.float32]
    toward: NDArray[np.float32]
    hits: NDArray[np.float32]


class CausticPhotons:
    """Photons of a scene's lamps, its sky and its sun, which are traced piece by piece, and what they leave.

    Threading: pieces may be traced by several threads.

    ``sun``: the photons of the sun; ``key``: of random numbers.
    """

    def __init__(self, surfaces: Surfaces, lights: Lights, sun: Photons, key: np.uint32) -> None:
        of_lamps = emit_photons(surfaces, lights, False, key)
        self._sources = (of_lamps, emit_photons(surfaces, lights, True, np.uint32(key ^ np.uint32(_SKY))), sun)
        counts = [len(source.flux) for source in self._sources]
        self._pieces = [(source, first) for source, count in enumerate(counts) for first in range(0, count, _PIECE)]
        self._left: dict[int, Caustics] = {}
        self.untraced = Pieces(len(self._pieces), 1)

    def trace(self, scene: LitScene, coarse: Atlas, piece: int, scratch: Scratch) -> None:
        """Trace a piece of them."""
        source, first = self._pieces[piece]
        photons = self._sources[source]
        left = self._left[piece] = make_caustics(len(coarse.face))
        trace_caustics(scene, coarse, photons, source > 0, first, min(first + _PIECE, len(photons.flux)), scratch, left)

    def light(self, of_sun: bool, count: int) -> Caustics:
        """Return what those of the sun, or the others, have left at ``count`` nodes."""
        total = make_caustics(count)
        for piece, left in sorted(self._left.items()):
            if (self._pieces[piece][0] == _SUN) == of_sun:
                for field, more in zip(total, left, strict=True):
                    field += more
        return total


def make_caustics(count: int) -> Caustics:
    """Return those of so many nodes, all dark."""
    lumen, toward = np.zeros((2, count, 3), np.float32)
    return Caustics(lumen, toward, np.zeros(count, np.float32))


def emit_photons(surfaces: Surfaces, lights: Lights, of_sky: bool, key: np.uint32) -> Photons:
    """Return photons of the sky that panes let in, or of lamps; none where there are no such.

    Triangles send them by power, from points that are even over each, cosine-distributed.
    """
    first, last = lights.groups.start[:-1], lights.groups.start[1:]
    power = np.repeat(lights.groups.bounds[:, 10] / np.maximum(lights.groups.area, 1e-12), last - first).astype(np.float64)
    edges = lights.emitters.reshape(-1, EMITTER_SIZE)
    along, across = edges[:, EMITTER_EDGE_1 : EMITTER_EDGE_1 + 3], edges[:, EMITTER_EDGE_2 : EMITTER_EDGE_2 + 3]
    area = 0.5 * np.linalg.norm(np.cross(along.astype(np.float64), across), axis=1)
    power *= area * ((lights.varies == BY_SKY) == of_sky)
    total = power.sum()
    count = PHOTONS if total > 0.0 else 0
    origins, directions, flux = np.zeros((3, count, 3), np.float32)
    photons = Photons(origins, directions, flux, key)
    if count:
        chosen = np.searchsorted(np.cumsum(power), (np.arange(count) + 0.5) / count * total).clip(0, len(power) - 1)
        stands_for = np.pi * area[chosen] * total / (np.maximum(power[chosen], 1e-30) * count)
        _emit(surfaces, lights, chosen, stands_for.astype(np.float32), photons)
    return photons


@entry
def _emit(surfaces: Surfaces, lights: Lights, chosen: NDArray[np.int64], stands_for: NDArray[np.float32], photons: Photons) -> None:
    """Fill photons from the ``chosen`` triangles (n,); ``stands_for``: (n,), pi times area over probability, m2."""
    table = lights.emitters
    for i in range(len(chosen)):
        row = chosen[i] * EMITTER_SIZE
        seed = mix_bits(np.uint32(photons.key + np.uint32(i)))
        s, t = sample_triangle(unit(seed, 0), unit(seed, 1))
        a, b, c = sample_cosine_hemisphere(unit(seed, 2), unit(seed, 3))
        c = max(c, _TINY)
        nx, ny, nz = table[row + EMITTER_NORMAL], table[row + EMITTER_NORMAL + 1], table[row + EMITTER_NORMAL + 2]
        ux, uy, uz, vx, vy, vz = coordinate_system(nx, ny, nz)
        way = (a * ux + b * vx + c * nx, a * uy + b * vy + c * ny, a * uz + b * vz + c * nz)
        le = surface_le(surfaces, lights.part[chosen[i]], -way[0], -way[1], -way[2], c)
        normal = (nx, ny, nz)
        for axis in range(3):
            at = table[row + EMITTER_CORNER + axis] + s * table[row + EMITTER_EDGE_1 + axis] + t * table[row + EMITTER_EDGE_2 + axis]
            photons.origins[i, axis] = at + _START_M * normal[axis]
            photons.directions[i, axis] = way[axis]
            photons.flux[i, axis] = stands_for[i] * le[axis]


@entry
def trace_caustics(
    scene: LitScene, coarse: Atlas, photons: Photons, from_outside: bool, first: int, end: int, scratch: Scratch, caustics: Caustics
) -> None:
    """Trace photons [first, end), multiples of 16, by gloss to what they meet then, and add to ``caustics``.

    ``from_outside``: whether they come in by panes, so that what stands outside keeps them out.
    """
    rays, lanes = scratch.rays, scratch.lanes
    for begin in range(first, end, LANES):
        for k in range(LANES):
            scratch.sampled[k] = _STRAIGHT
            for channel in range(3):
                lanes[ln.BETA_R + LANES * channel + k] = photons.flux[begin + k, channel]
        if from_outside:
            shine_in(scene.tree, rays, photons.origins, photons.directions, begin)
        else:
            for k in range(LANES):
                aim(rays, k, photons.origins[begin + k], photons.directions[begin + k], _ONE)
                rays.integer[ray.MASK + k], rays.integer[ray.GEOM_ID + k], rays.alive[k] = MEET_ALL, INVALID_ID, -1
            intersect16(rays.alive.ctypes.data, scene.tree.address, rays.real.ctypes.data, scene.tree.incoherent)
        for depth in range(_DEEPEST):
            if depth > 0:
                intersect16(rays.alive.ctypes.data, scene.tree.address, rays.real.ctypes.data, scene.tree.incoherent)
            going = 0
            for k in range(LANES):
                met = rays.alive[k] != 0 and rays.integer[ray.GEOM_ID + k] != INVALID_ID
                rays.alive[k] = 0
                if met:
                    seed = mix_bits(np.uint32(mix_bits(np.uint32(photons.key + np.uint32(begin + k))) + np.uint32(16 * depth + 16)))
                    going += _meet(scene.surfaces, coarse, seed, k, scratch, caustics)
            if going == 0:
                break


@inlined
def _meet(surfaces: Surfaces, coarse: Atlas, seed: np.uint32, k: int, scratch: Scratch, caustics: Caustics) -> int:
    """Send photon k on from where it has hit, or leave what it brings if gloss has mirrored it; return whether it goes on."""
    rays, lanes, table = scratch.rays, scratch.lanes, surfaces.materials
    real, face = rays.real, rays.integer[ray.PRIM_ID + k]
    row = surfaces.face_part[face] * st.ROW_SIZE
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    toward = -(dx * nx + dy * ny + dz * nz)
    front = toward > _ZERO
    cosine = min(abs(toward) / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY)), _ONE)
    way = pass_smooth(surfaces, coarse, cosine, front, seed, k, scratch)
    if way != MET:
        return 0 if way == LEFT else 1
    if scratch.sampled[k] == _MIRRORED:
        _leave(surfaces, coarse, face, front, cosine, k, scratch, caustics)
    before = max(lanes[ln.BETA_R + k], lanes[ln.BETA_G + k], lanes[ln.BETA_B + k])
    if before <= _ZERO or scatters_all(table, row) or not _by_gloss(surfaces, row, seed, k, scratch):
        return 0
    # What gloss has mirrored once goes on with a chance only (Russian roulette).
    if scratch.sampled[k] == _MIRRORED:
        chance = max(lanes[ln.BETA_R + k], lanes[ln.BETA_G + k], lanes[ln.BETA_B + k]) / before
        if unit(seed, 3) >= chance:
            rays.alive[k] = 0
            return 0
        scale = _ONE / min(chance, _ONE)
        for channel in range(0, 3 * LANES, LANES):
            lanes[ln.BETA_R + channel + k] *= scale
    scratch.sampled[k] = _MIRRORED
    return 1


@inlined
def _leave(
    surfaces: Surfaces, coarse: Atlas, face: int, front: bool, cosine: np.float32, k: int, scratch: Scratch, caustics: Caustics
) -> None:
    """Leave what photon k brings at the nodes around its hit."""
    lanes, real, nodes, weights = scratch.lanes, scratch.rays.real, scratch.nodes, scratch.weights
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    counts = reflected_share(scatterer_of(surfaces, face), cosine, surfaces.albedos.reflected)
    r, g, b = counts * lanes[ln.BETA_R + k], counts * lanes[ln.BETA_G + k], counts * lanes[ln.BETA_B + k]
    shown = (_RED * r + _GREEN * g + _BLUE * b) / max(cosine, _LEAST_COSINE)
    for i in range(find_nodes(coarse, face, real[ray.BARY_U + k], real[ray.BARY_V + k], front, nodes, weights)):
        lumen, way, weight = caustics.lumen[nodes[i]], caustics.toward[nodes[i]], weights[i]
        lumen[0], lumen[1], lumen[2] = lumen[0] + weight * r, lumen[1] + weight * g, lumen[2] + weight * b
        caustics.hits[nodes[i]] += weight
        weight *= shown
        way[0], way[1], way[2] = way[0] - weight * dx, way[1] - weight * dy, way[2] - weight * dz


@inlined
def _by_gloss(surfaces: Surfaces, row: int, seed: np.uint32, k: int, scratch: Scratch) -> bool:
    """Send photon k on from gloss whose material begins at ``row``, with what its coat or what lies under it reflects, one of the two."""
    table, reflected = surfaces.materials, surfaces.albedos.reflected
    if table[row + st.METALLIC] > _HALF:
        return mirror_by_facet(surfaces, metal_lobe(table, row), seed, k, scratch)
    ior, roughness, coat = table[row + st.IOR], table[row + st.ROUGHNESS], table[row + st.COAT]
    if ior <= _ONE:
        return False
    f0, f90 = boundary_reflectance(ior)
    rough, by_coat = table[row + st.COAT_ROUGHNESS], _ZERO
    if coat > _ZERO:
        mean, schlick = look_up_mean(reflected, rough)
        by_coat = coat * schlick_albedo(COAT_F0, _ONE, mean, schlick)
    mean, schlick = look_up_mean(reflected, roughness)
    by_boundary = (_ONE - by_coat) * schlick_albedo(f0, f90, mean, schlick)
    chance, scale = by_coat / max(by_coat + by_boundary, _TINY), _ZERO
    lobe = Lobe(roughness * roughness, f0, f0, f0, f90)
    if unit(seed, 1) < chance:
        lobe, scale = Lobe(rough * rough, COAT_F0, COAT_F0, COAT_F0, _ONE), coat / chance
    else:
        scale = (_ONE - by_coat) / (_ONE - chance)
    for channel in range(3):
        lanes_at = ln.BETA_R + LANES * channel + k
        scratch.lanes[lanes_at] *= scale
    return mirror_by_facet(surfaces, lobe, mix_bits(np.uint32(seed + np.uint32(2))), k, scratch)
