"""Photons: the sun's light, followed from the window panes on from surface to surface, and left at the coarse nodes that it meets.

Photon tracing (Jensen, "Global Illumination using Photon Maps", 1996).  All that comes in is counted, however narrow what it falls on is; a
strip of sun in a window's recess, which few rays of nodes would find, is as good as any.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import fresnel_thin_dielectric, sample_ggx_wm
from renderer.bsdf.reflectance import reflected_parts, reflected_share
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.embree import intersect16
from renderer.core.kernel import entry, inlined
from renderer.core.random_numbers import mix_bits, unit_of
from renderer.core.ray_packet import INVALID_ID, LANES
from renderer.core.sampling import Vector, coordinate_system, sample_cosine_hemisphere
from renderer.irradiance_cache.hemisphere import is_wide
from renderer.irradiance_cache.nodes import reflector_of, scatterer_of, scatters_all
from renderer.irradiance_cache.probing import Looks
from renderer.irradiance_cache.specular import clear_share, go_on, is_clear, is_mirror
from renderer.path import surface_tables as st
from renderer.path.emission import pane_transmittance
from renderer.path.infinite_light import InfiniteLight
from renderer.path.light_nodes import Atlas, find_nodes
from renderer.path.records import LitScene, Scratch
from renderer.path.sun_patches import make_beams, shine_in
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import lift_height
from scene_description.products import matmul

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
PHOTONS = 65536
_DEEPEST = 64
_LEAST_SHARE = 0.1
"""Least area of what shares flux, in squares of the width: the area of small things is not known well."""
_ENOUGH, _LEAST_M2 = 8, 1e-6
"""How many photons a node needs, in the mean over those around it, to have its own flux, and which area it has at least."""
LEFT, PASSED, REFLECTED, MET = range(4)
"""What smooth things do with a photon (:func:`pass_smooth`)."""
_STRAIGHT, _MIRRORED, _SCATTERED = range(3)
"""``Scratch.sampled`` of photons: such as come from the sun by panes and glass alone, also by gloss and mirrors, and others."""


class Photons(NamedTuple):
    """Where the sun's photons begin, and what each brings.

    origins: (n, 3) float32, metres, just within the panes; directions: (n, 3) float32, unit, away from the sun; flux: (n, 3) float32,
    lumens; key: of their random numbers.
    """

    origins: NDArray[np.float32]
    directions: NDArray[np.float32]
    flux: NDArray[np.float32]
    key: np.uint32


class SunLight(NamedTuple):
    """What photons leave.

    first, bounced: (n, 3) float32, lumens at coarse nodes that come from the sun, by gloss and mirrors at most, as far as they count for
    what is scattered (:func:`renderer.irradiance_cache.nodes.scatterer_of`), and that surfaces have scattered before, as far as they count
    for all that is reflected; hits: (n, 2) float32, how many photons these are; sunlit: (m,) bool, fine nodes around what the sun falls on.
    """

    first: NDArray[np.float32]
    bounced: NDArray[np.float32]
    hits: NDArray[np.float32]
    sunlit: NDArray[np.bool_]


def make_photons(surfaces: Surfaces, infinite: InfiniteLight, key: np.uint32) -> Photons:
    """Return the photons of a scene, none without a sun that shines on a pane."""
    beams = make_beams(infinite, PHOTONS)
    if beams is None:
        none = np.zeros((0, 3), np.float32)
        return Photons(none, none, none, key)
    cosine = matmul(-infinite.portals[:, 9:12].astype(np.float64), infinite.sun[:3].astype(np.float64))
    passed = np.zeros(len(cosine), np.float32)
    _pass_panes(surfaces, infinite.part, cosine.astype(np.float32), passed)
    # The sun's disc fills 2 pi (1 - cosine) of the view.
    lux = 2.0 * np.pi * float(infinite.sun[3]) * infinite.sun[4:7].astype(np.float64)
    flux = (passed[beams.portals, None] * (beams.section_m2 / PHOTONS) * lux).astype(np.float32)
    return Photons(beams.origins.astype(np.float32), np.tile(-infinite.sun[:3], (PHOTONS, 1)), flux, key)


def share_flux(
    atlas: Atlas, other: NDArray[np.int32], lumen: NDArray[np.float32], hits: NDArray[np.float32], width_m: float
) -> NDArray[np.float32]:
    """Return illuminance (n, c), lux, by the flux (n, c) that photons have left at nodes; ``hits``: (n,), how many they were.

    What nodes have for which an ``other`` (n,) stands in is that one's, and so is as much of their area as photons meet as densely as
    there: the rest is hidden.  Nodes in a cube of space of that width that face the same of six ways share what they have where photons
    are few, as on small things.
    """
    nodes = np.arange(len(other))
    cube, major = np.floor(atlas.position / width_m).astype(np.int64), np.abs(atlas.normal).argmax(axis=1)
    facing = 2 * major + (np.take_along_axis(atlas.normal, major[:, None], axis=1)[:, 0] < 0.0)
    x, y, z = (cube - cube.min(axis=0, initial=0)).T
    _, group = np.unique(((x * (y.max(initial=0) + 1) + y) * (z.max(initial=0) + 1) + z) * 6 + facing, return_inverse=True)
    per_m2 = np.maximum(hits / np.maximum(atlas.area, _LEAST_M2), 1e-12)
    met = np.where(other == nodes, atlas.area, np.minimum(atlas.area, hits / per_m2[other]))
    own = np.bincount(other, met, len(nodes)) * (other == nodes)
    shares = (np.bincount(group[other], hits, len(nodes)) < _ENOUGH * np.bincount(group, own > 0.0, len(nodes)))[group]
    group = np.where(shares, group, len(nodes) + nodes)
    least = np.repeat([_LEAST_SHARE * width_m * width_m, _LEAST_M2], len(nodes))
    area = np.maximum(np.bincount(group, own, len(least)), least)
    return np.column_stack([(np.bincount(group[other], channel, len(area)) / area)[group] for channel in lumen.T]).astype(np.float32)


@entry
def _pass_panes(surfaces: Surfaces, part: NDArray[np.int32], cosine: NDArray[np.float32], passed: NDArray[np.float32]) -> None:
    """Fill the share of light that the front of panes lets through, (p,)."""
    for i in range(len(part)):
        passed[i] = pane_transmittance(surfaces, part[i], max(cosine[i], _ZERO))


@entry
def trace_photons(
    scene: LitScene, coarse: Atlas, fine: Atlas, looks: Looks, photons: Photons, first: int, end: int, scratch: Scratch, light: SunLight
) -> None:
    """Trace photons [first, end), multiples of 16, until each is absorbed or leaves, and add to ``light``."""
    rays, lanes = scratch.rays, scratch.lanes
    for begin in range(first, end, LANES):
        for k in range(LANES):
            scratch.sampled[k] = _STRAIGHT
            for channel in range(3):
                lanes[ln.BETA_R + LANES * channel + k] = photons.flux[begin + k, channel]
        shine_in(scene.tree, rays, photons.origins, photons.directions, begin)
        for depth in range(_DEEPEST):
            if depth > 0:
                intersect16(rays.alive.ctypes.data, scene.tree.address, rays.real.ctypes.data, scene.tree.incoherent)
            going = 0
            for k in range(LANES):
                met = rays.alive[k] != 0 and rays.integer[ray.GEOM_ID + k] != INVALID_ID
                rays.alive[k] = 0
                if met:
                    seed = mix_bits(np.uint32(mix_bits(np.uint32(photons.key + np.uint32(begin + k))) + np.uint32(depth)))
                    going += _meet(scene.surfaces, coarse, fine, looks, seed, k, scratch, light)
            if going == 0:
                break


@inlined
def unit(seed: np.uint32, number: int) -> np.float32:
    """Return a number in [0, 1), one of several that belong to a seed."""
    return unit_of(mix_bits(np.uint32(seed + np.uint32(number))))


@inlined
def pass_smooth(surfaces: Surfaces, coarse: Atlas, cosine: np.float32, front: bool, seed: np.uint32, k: int, scratch: Scratch) -> int:
    """Send photon k on from a pane, clear glass or a wide mirror; return whether it has LEFT, PASSED, is REFLECTED, or MET all else.

    ``cosine``: between the photon and the normal of what it has hit; ``front``: whether it sees the triangle's front.
    """
    rays, lanes, table = scratch.rays, scratch.lanes, surfaces.materials
    face = rays.integer[ray.PRIM_ID + k]
    row = surfaces.face_part[face] * st.ROW_SIZE
    if table[row + st.PORTAL] > _ZERO:
        if not front or unit(seed, 0) >= fresnel_thin_dielectric(cosine, table[row + st.IOR]):
            return LEFT
        go_on(rays, k, True)
        return REFLECTED
    if is_clear(table, row):
        share = _RED * clear_share(table, row, 0) + _GREEN * clear_share(table, row, 1) + _BLUE * clear_share(table, row, 2)
        if not front or unit(seed, 0) < share:
            for channel in range(3):
                through = clear_share(table, row, channel)
                lanes[ln.BETA_R + LANES * channel + k] *= through / share if front else through
            go_on(rays, k, False)
            return PASSED
    elif is_mirror(table, row) and is_wide(coarse, face):
        for channel in range(3):
            lanes[ln.BETA_R + LANES * channel + k] *= table[row + st.BASE + channel]
        go_on(rays, k, True)
        return REFLECTED
    return MET


@inlined
def _meet(surfaces: Surfaces, coarse: Atlas, fine: Atlas, looks: Looks, seed: np.uint32, k: int, scratch: Scratch, light: SunLight) -> int:
    """Leave what photon k brings where it has hit, and send it on; return whether it goes on."""
    rays, lanes, table = scratch.rays, scratch.lanes, surfaces.materials
    real, face = rays.real, rays.integer[ray.PRIM_ID + k]
    part = surfaces.face_part[face]
    row = part * st.ROW_SIZE
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    toward = -(real[ray.DIR_X + k] * nx + real[ray.DIR_Y + k] * ny + real[ray.DIR_Z + k] * nz)
    front = toward > _ZERO
    cosine = min(abs(toward) / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY)), _ONE)
    way = pass_smooth(surfaces, coarse, cosine, front, seed, k, scratch)
    if way != MET:
        if way == REFLECTED:
            scratch.sampled[k] = max(scratch.sampled[k], _MIRRORED)
        return 0 if way == LEFT else 1
    nodes, weights, u, v = scratch.nodes, scratch.weights, real[ray.BARY_U + k], real[ray.BARY_V + k]
    direct = scratch.sampled[k] != _SCATTERED
    if scratch.sampled[k] == _STRAIGHT:
        for i in range(find_nodes(fine, face, u, v, front, nodes, weights)):
            light.sunlit[nodes[i]] = True
    reflector = reflector_of(surfaces, face, True)
    scattered, mirrored = reflected_parts(reflector, cosine, surfaces.albedos.reflected)
    counts = scattered + mirrored
    if direct:
        counts = reflected_share(scatterer_of(surfaces, face), cosine, surfaces.albedos.reflected)
    nearest, most = -1, _ZERO
    for i in range(find_nodes(coarse, face, u, v, front, nodes, weights)):
        nearest, most = (nodes[i], weights[i]) if weights[i] > most else (nearest, most)
        light.hits[nodes[i], 0 if direct else 1] += weights[i]
        for channel in range(3):
            lumen = weights[i] * counts * lanes[ln.BETA_R + LANES * channel + k]
            if direct:
                light.first[nodes[i], channel] += lumen
            else:
                light.bounced[nodes[i], channel] += lumen
    if nearest < 0:
        return 0
    # Russian roulette by what is reflected, and by what passes through a sheet, of the colour of which there is most.
    albedo, passed = looks.albedo[nearest], looks.passed[nearest]
    reflects, passes = (scattered + mirrored) * max(albedo[0], albedo[1], albedo[2]), max(passed[0], passed[1], passed[2])
    scale = _ONE / max(reflects + passes, _ONE)
    choice = unit(seed, 4)
    behind = choice < passes * scale
    if choice >= (passes + reflects) * scale:
        return 0
    for channel in range(3):
        lanes[ln.BETA_R + LANES * channel + k] *= (
            passed[channel] / (passes * scale) if behind else (scattered + mirrored) * albedo[channel] / (reflects * scale)
        )
    by_gloss = mirrored / max(scattered + mirrored, _TINY)
    if table[row + st.METALLIC] > _HALF:
        # What of it is no metal scatters.
        matt = looks.matt[nearest]
        by_gloss = _ONE - max(matt[0], matt[1], matt[2]) / max(albedo[0], albedo[1], albedo[2], _TINY)
    gloss = bool(not behind and unit(seed, 1) < by_gloss)
    roughness = reflector.coat_roughness if reflector.coat > _ZERO else table[row + st.ROUGHNESS]
    way = _MIRRORED if gloss and not scatters_all(table, row) else _SCATTERED
    _scatter(gloss, way, bool(behind == front), roughness * roughness, cosine, seed, k, scratch)
    return 1


@inlined
def _scatter(gloss: bool, way: int, back: bool, alpha: np.float32, cosine: np.float32, seed: np.uint32, k: int, scratch: Scratch) -> None:
    """Send photon k on from its hit: by microfacets, or, where it shows none, by a diffuse lobe.

    ``way``: what it is from now on, at least; ``back``: whether it goes from the triangle's back.
    """
    real, integer = scratch.rays.real, scratch.rays.integer
    sign = -_ONE if back else _ONE
    scale = sign / np.sqrt(max(real[ray.NG_X + k] ** 2 + real[ray.NG_Y + k] ** 2 + real[ray.NG_Z + k] ** 2, _TINY))
    nx, ny, nz = scale * real[ray.NG_X + k], scale * real[ray.NG_Y + k], scale * real[ray.NG_Z + k]
    ux, uy, uz, vx, vy, vz = coordinate_system(nx, ny, nz)
    dx, dy, dz, t = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k], real[ray.TFAR + k]
    a, b, c = sample_cosine_hemisphere(unit(seed, 2), unit(seed, 3))
    if gloss:
        x, y = -(dx * ux + dy * uy + dz * uz), -(dx * vx + dy * vy + dz * vz)
        a, b, c = _mirrored((x, y, cosine), sample_ggx_wm(x, y, cosine, alpha, unit(seed, 2), unit(seed, 3)), (a, b, c))
    px, py, pz = real[ray.ORG_X + k] + t * dx, real[ray.ORG_Y + k] + t * dy, real[ray.ORG_Z + k] + t * dz
    lift = lift_height(px, py, pz)
    real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k] = px + lift * nx, py + lift * ny, pz + lift * nz
    real[ray.DIR_X + k], real[ray.DIR_Y + k] = a * ux + b * vx + c * nx, a * uy + b * vy + c * ny
    real[ray.DIR_Z + k] = a * uz + b * vz + c * nz
    real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, np.float32(np.inf)
    integer[ray.GEOM_ID + k] = INVALID_ID
    scratch.rays.alive[k], scratch.sampled[k] = -1, max(scratch.sampled[k], way)


@inlined
def _mirrored(wo: Vector, wm: Vector, otherwise: Vector) -> Vector:
    """Return wo mirrored about a microfacet's normal, or another direction where that leads below the surface."""
    along = _TWO * (wo[0] * wm[0] + wo[1] * wm[1] + wo[2] * wm[2])
    x, y, z = along * wm[0] - wo[0], along * wm[1] - wo[1], along * wm[2] - wo[2]
    return (x, y, z) if z > _ZERO else otherwise
