"""Final gathers: a fine node looks once around it at the light of the coarse ones, and samples the brightest of these as it would lamps."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import Reflector, reflected_share
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.kernel import entry, inlined
from renderer.core.random_numbers import mix_bits
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.hemisphere import (
    BEHIND,
    INDOORS,
    UNKNOWN,
    GatherScratch,
    Rays,
    aim_hemisphere,
    choose_node,
    follow,
    node_seed,
    sighted_light,
)
from renderer.irradiance_cache.lamp_images import LampImages, is_image, light_of_images
from renderer.irradiance_cache.nodes import NodeLight, arriving, reflector_of, scatterer_of, stand_on, unit_hash
from renderer.irradiance_cache.specular import pass_glass
from renderer.path.light_nodes import Atlas, find_nodes
from renderer.path.records import LitScene, Scratch
from renderer.path.surface_tables import Surfaces
from scene_description.products import matmul

_ZERO, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_PI = np.float32(np.pi)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_CLEAR_M = np.float32(1e-3)
_OPEN, _LEAST_WORTH = np.float32(0.3), np.float32(0.02)
_LEAST_COSINE = np.float32(0.05)
BRIGHT_RAYS = 2 * LANES
"""By how many points of bright nodes a node is lit, each of another run of all samples: all nodes by the same would be wrong alike."""


class Bright(NamedTuple):
    """Coarse nodes that are much brighter than others, sampled as lights are, for kernels.

    chosen: (n,) bool, which they are; point, normal, weight: (s, 3) float32 each, samples of them, metres and world, and luminance times
    area that each stands for where there is one ray for each of BRIGHT_RAYS runs of them, cd.  Light from nearer than ``near_m`` is
    gathered instead.
    """

    chosen: NDArray[np.bool_]
    point: NDArray[np.float32]
    normal: NDArray[np.float32]
    weight: NDArray[np.float32]
    near_m: np.float32


def choose_bright(
    luminance: NDArray[np.float32], certain: NDArray[np.float32], atlas: Atlas, times: float, samples: int, near_m: float
) -> Bright:
    """Choose the nodes that are brighter than ``times`` the room's mean, and sample them by flux.

    ``luminance``, ``certain``: (n, 3), cd/m2, what leaves them, and what of it they are chosen by: were they chosen by what few rays bring
    by chance, they would be too bright in the mean.
    """
    shown = matmul(luminance.astype(np.float64), LUMINANCE)
    area = atlas.area.astype(np.float64)
    least = times * max((shown * area).sum() / max(area.sum(), 1e-12), 1e-12)
    chosen = (matmul(certain.astype(np.float64), LUMINANCE) > least) & (shown > 0.0) & (area > 0.0)
    nodes = np.flatnonzero(chosen)
    flux = shown[nodes] * area[nodes]
    total = flux.sum()
    if total == 0.0:
        nothing = np.zeros((0, 3), np.float32)
        return Bright(np.zeros(len(shown), np.bool_), nothing, nothing, nothing, np.float32(near_m))
    picked = nodes[np.searchsorted(np.cumsum(flux), (np.arange(samples) + 0.5) / samples * total).clip(0, len(nodes) - 1)]
    weight = luminance[picked] / shown[picked, None] * (total / BRIGHT_RAYS)
    return Bright(chosen, atlas.position[picked], atlas.normal[picked], weight.astype(np.float32), np.float32(near_m))


class CoarseLight(NamedTuple):
    """What fine nodes gather: coarse nodes, what leaves them (n, 3), cd/m2, worth (n,), if known, bright ones, lamps in mirrors.

    caustics: (n, 6), illuminance, lux, by light that gloss has mirrored, and its luminance times direction over cosine, world.
    """

    atlas: Atlas
    luminance: NDArray[np.float32]
    worth: NDArray[np.float32]
    known: NDArray[np.bool_]
    bright: Bright
    images: LampImages
    caustics: NDArray[np.float32]


class Gathered(NamedTuple):
    """Sums over the rays of a node.

    r, g, b: luminance; x, y, z: luminance times direction over cosine; behind, unknown, far: how many rays see the inside of something,
    end at nodes about which nothing is known, and end far away; nearness: one over the distance, 1/m.
    """

    r: np.float32
    g: np.float32
    b: np.float32
    x: np.float32
    y: np.float32
    z: np.float32
    behind: np.float32
    unknown: np.float32
    far: np.float32
    nearness: np.float32


@entry
def gather_nodes(
    scene: LitScene, target: Atlas, source: CoarseLight, rays: Rays, nodes: NDArray[np.int64], memory: GatherScratch, light: NodeLight
) -> None:
    """Fill ``indirect`` and ``valid`` of some nodes of ``target``, and complete ``toward``, from the light of ``source``."""
    count = np.float32(len(rays.pattern))
    for i in range(len(nodes)):
        node = nodes[i]
        reflector = reflector_of(scene.surfaces, target.face[node], False)
        sums = _look_around(scene, target, source, rays, reflector, node, memory)
        # Rays that see the inside of something began within it: the others stand for them, and for those that tell nothing.
        scale = _PI / max(count - sums.behind - sums.unknown, _ONE)
        r, g, b, x, y, z = scale * sums.r, scale * sums.g, scale * sums.b, scale * sums.x, scale * sums.y, scale * sums.z
        if len(source.bright.point) > 0:
            stand_on(target, node, memory.trace)
            for begin in range(0, BRIGHT_RAYS, LANES):
                red, green, blue, dx, dy, dz = _light_of_bright(
                    scene, source.bright, reflector, node_seed(node, rays.key), begin, memory.trace
                )
                r, g, b, x, y, z = r + red, g + green, b + blue, x + dx, y + dy, z + dz
        red, green, blue, dx, dy, dz = _light_of_caustics(scene.surfaces, target, source, node, memory.trace)
        r, g, b, x, y, z = r + red, g + green, b + blue, x + dx, y + dy, z + dz
        known = r + g + b + light.indirect[node, 0] + light.indirect[node, 1] + light.indirect[node, 2]
        known += light.direct[node, 0] + light.direct[node, 1] + light.direct[node, 2]
        red, green, blue, dx, dy, dz = light_of_images(scene, target, source.atlas, source.images, reflector, node, known, rays.key, memory)
        x, y, z = x + dx, y + dy, z + dz
        light.indirect[node, 0] += r + red
        light.indirect[node, 1] += g + green
        light.indirect[node, 2] += b + blue
        light.open_m[node] = count / max(sums.nearness, _TINY)
        open_share = max(min(sums.far / (_OPEN * count), _ONE), _LEAST_WORTH)
        light.valid[node] = open_share if sums.behind <= rays.most_behind * count else _ZERO
        _complete_direction(light, node, x, y, z)


@entry
def light_from_bright(
    scene: LitScene, atlas: Atlas, bright: Bright, key: np.uint32, nodes: NDArray[np.int64], scratch: Scratch, lux: NDArray[np.float32]
) -> None:
    """Add to ``lux`` (n, 3) of some nodes what falls on them from bright ones, sampled as lights are."""
    for i in range(len(nodes)):
        node = nodes[i]
        reflector = reflector_of(scene.surfaces, atlas.face[node], True)
        stand_on(atlas, node, scratch)
        for begin in range(0, BRIGHT_RAYS, LANES):
            r, g, b, _, _, _ = _light_of_bright(scene, bright, reflector, node_seed(node, key), begin, scratch)
            lux[node, 0], lux[node, 1], lux[node, 2] = lux[node, 0] + r, lux[node, 1] + g, lux[node, 2] + b


@entry
def light_from_images(
    scene: LitScene, atlas: Atlas, images: LampImages, key: np.uint32, nodes: NDArray[np.int64], memory: GatherScratch, light: NodeLight
) -> None:
    """Add to ``indirect`` of some nodes what falls on them from lamps by way of flat mirrors and panes."""
    for i in range(len(nodes)):
        reflector = scatterer_of(scene.surfaces, atlas.face[nodes[i]])
        known = light.direct[nodes[i], 0] + light.direct[nodes[i], 1] + light.direct[nodes[i], 2]
        r, g, b, _, _, _ = light_of_images(scene, atlas, atlas, images, reflector, nodes[i], known, key, memory)
        light.indirect[nodes[i], 0] += r
        light.indirect[nodes[i], 1] += g
        light.indirect[nodes[i], 2] += b


def links_to_bright(atlas: Atlas, bright: Bright, links: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which links (n, s) end at bright nodes whose light :func:`light_from_bright` finds."""
    found = (links >= 0) & bright.chosen[links]
    node, i = np.nonzero(found)
    between = atlas.position[links[node, i]] - atlas.position[node]
    found[node, i] = (between * between).sum(axis=1) > bright.near_m * bright.near_m
    return found


@inlined
def _look_around(
    scene: LitScene, target: Atlas, source: CoarseLight, rays: Rays, reflector: Reflector, node: int, memory: GatherScratch
) -> Gathered:
    """Send the rays of a node's hemisphere and sum what they see."""
    real, directions = memory.trace.rays.real, memory.toward
    u, v = unit_hash(node, rays.key)
    seed = node_seed(node, rays.key)
    nx, ny, nz = target.normal[node, 0], target.normal[node, 1], target.normal[node, 2]
    r = g = b = x = y = z = behind = unknown = far = nearness = _ZERO
    for begin in range(0, len(rays.pattern), LANES):
        aim_hemisphere(target, node, rays.pattern, begin, u, v, memory.trace.rays)
        # Mirrors turn the rays: light arrives from where they first went.
        for j in range(3 * LANES):
            directions[j] = real[ray.DIR_X + j]
        follow(scene, source.atlas, seed + np.uint32(977 * begin), memory)
        for k in range(LANES):
            red, green, blue, link = _light_of_ray(scene.surfaces, source, k, memory)
            behind += _ONE if link == BEHIND else _ZERO
            unknown += _ONE if link == UNKNOWN else _ZERO
            far += _ONE if real[ray.TFAR + k] > rays.far_m and link != BEHIND else _ZERO
            nearness += _ONE / max(real[ray.TFAR + k], _CLEAR_M)
            dx, dy, dz = directions[k], directions[LANES + k], directions[2 * LANES + k]
            cosine = max(dx * nx + dy * ny + dz * nz, _LEAST_COSINE)
            share = reflected_share(reflector, cosine, scene.surfaces.albedos.reflected)
            red, green, blue = share * red, share * green, share * blue
            r, g, b = r + red, g + green, b + blue
            weight = (_RED * red + _GREEN * green + _BLUE * blue) / cosine
            x, y, z = x + weight * dx, y + weight * dy, z + weight * dz
    return Gathered(r, g, b, x, y, z, behind, unknown, far, nearness)


@inlined
def _light_of_caustics(
    surfaces: Surfaces, target: Atlas, source: CoarseLight, node: int, scratch: Scratch
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance (r, g, b) by caustics at the coarse nodes around a node of ``target``, and luminance times direction."""
    face, nodes, weights = target.face[node], scratch.nodes, scratch.weights
    along = _ZERO
    for axis in range(3):
        along += target.normal[node, axis] * surfaces.normals[9 * np.int64(face) + axis]
    r = g = b = x = y = z = _ZERO
    for i in range(find_nodes(source.atlas, face, target.weight[node, 0], target.weight[node, 1], bool(along > _ZERO), nodes, weights)):
        row, weight = source.caustics[nodes[i]], weights[i]
        r, g, b = r + weight * row[0], g + weight * row[1], b + weight * row[2]
        x, y, z = x + weight * row[3], y + weight * row[4], z + weight * row[5]
    return r, g, b, x, y, z


@inlined
def _light_of_ray(surfaces: Surfaces, source: CoarseLight, k: int, memory: GatherScratch) -> tuple[np.float32, np.float32, np.float32, int]:
    """Return the luminance (r, g, b) that ray k has found, and its link; what is sampled, bright nodes and images of lamps, brings none."""
    red = green = blue = _ZERO
    if memory.sighted[k] >= 0 and not is_image(source.images, k, memory):
        red, green, blue = sighted_light(surfaces, memory.sighted[k], memory.sights, k)
    link, at, bright = memory.links[k], memory.at, source.bright
    if link >= 0:
        link = choose_node(source.atlas, source.worth, link, at[k], at[LANES + k], at[2 * LANES + k], memory)
    if link >= 0 and not source.known[link]:
        link = UNKNOWN
    far = memory.trace.rays.real[ray.TFAR + k] > bright.near_m
    if link >= 0 and not (bright.chosen[link] and memory.trace.sampled[k] == INDOORS and far):
        red, green, blue = red + source.luminance[link, 0], green + source.luminance[link, 1], blue + source.luminance[link, 2]
    return red, green, blue, link


@inlined
def _complete_direction(light: NodeLight, node: int, x: np.float32, y: np.float32, z: np.float32) -> None:
    """Add (x, y, z) to ``toward`` of a node whose illuminance is known, and divide it by that."""
    total = (
        _RED * (light.indirect[node, 0] + light.direct[node, 0])
        + _GREEN * (light.indirect[node, 1] + light.direct[node, 1])
        + _BLUE * (light.indirect[node, 2] + light.direct[node, 2])
    )
    over = _ONE / max(total, _TINY)
    light.toward[node, 0] = (light.toward[node, 0] + x) * over
    light.toward[node, 1] = (light.toward[node, 1] + y) * over
    light.toward[node, 2] = (light.toward[node, 2] + z) * over


@inlined
def _light_of_bright(
    scene: LitScene, bright: Bright, reflector: Reflector, seed: np.uint32, begin: int, scratch: Scratch
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance (r, g, b) by 16 samples of bright nodes, and luminance times direction; ``seed`` chooses within their runs."""
    lanes, run = scratch.lanes, len(bright.point) // BRIGHT_RAYS
    for k in range(LANES):
        i = (begin + k) * run + int(mix_bits(np.uint32(seed + np.uint32(begin + k)))) % run
        x, y, z = (bright.point[i, 0] - lanes[ln.P_X + k], bright.point[i, 1] - lanes[ln.P_Y + k], bright.point[i, 2] - lanes[ln.P_Z + k])
        squared = x * x + y * y + z * z
        inverse = _ONE / np.sqrt(max(squared, _TINY))
        here = (x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]) * inverse
        there = -(x * bright.normal[i, 0] + y * bright.normal[i, 1] + z * bright.normal[i, 2]) * inverse
        arrives = (here > _ZERO) & (there > _ZERO) & (squared > bright.near_m * bright.near_m)
        weight = there / max(squared, _TINY) if arrives else _ZERO
        lanes[ln.LI_R + k] = weight * bright.weight[i, 0]
        lanes[ln.LI_G + k] = weight * bright.weight[i, 1]
        lanes[ln.LI_B + k] = weight * bright.weight[i, 2]
        lanes[ln.LIGHT_PDF + k], lanes[ln.LIGHT_END + k] = _ONE if arrives else _ZERO, _ONE
        # The ray ends off the surface that shines.
        reach = _ONE - _CLEAR_M * inverse / max(there, _LEAST_COSINE)
        lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = reach * x, reach * y, reach * z
    pass_glass(scene, scratch)
    r = g = b = vx = vy = vz = _ZERO
    for k in range(LANES):
        if lanes[ln.LIGHT_PDF + k] > _ZERO:
            _, dx, dy, dz, cosine = arriving(lanes, k)
            share = reflected_share(reflector, cosine, scene.surfaces.albedos.reflected)
            red, green, blue = share * lanes[ln.LI_R + k], share * lanes[ln.LI_G + k], share * lanes[ln.LI_B + k]
            r, g, b = r + cosine * red, g + cosine * green, b + cosine * blue
            weight = _RED * red + _GREEN * green + _BLUE * blue
            vx, vy, vz = vx + weight * dx, vy + weight * dy, vz + weight * dz
    return r, g, b, vx, vy, vz
