"""Final gathers: a fine node looks once around it at the light of the coarse ones, and samples the brightest of these."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import Reflector, reflected_share
from renderer.core import ray_packet as ray
from renderer.core.color import LUMINANCE
from renderer.core.kernel import entry, inlined
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.bright_nodes import Bright, light_of_bright
from renderer.irradiance_cache.hemisphere import (
    BEHIND,
    NO_MIRROR,
    OUTDOORS,
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
from renderer.irradiance_cache.nodes import NodeLight, reflector_of, scatterer_of, stand_on, unit_hash
from renderer.path.light_nodes import Atlas, find_nodes
from renderer.path.records import LitScene, Scratch
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_PI = np.float32(np.pi)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_CLEAR_M = np.float32(1e-3)
_OPEN, _LEAST_WORTH = np.float32(0.3), np.float32(0.02)
_LEAST_COSINE = np.float32(0.05)


class CoarseLight(NamedTuple):
    """What fine nodes gather: coarse nodes, what leaves them (n, 3), cd/m2, worth (n,), if known, bright ones in the room and outside.

    images: lamps in mirrors.
    caustics: (n, 6), illuminance, lux, by light that gloss has mirrored, and its luminance times direction over cosine, world.
    """

    atlas: Atlas
    luminance: NDArray[np.float32]
    worth: NDArray[np.float32]
    known: NDArray[np.bool_]
    bright: Bright
    outside: Bright
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
        seed = node_seed(node, rays.key)
        stand_on(target, node, memory.trace)
        red, green, blue, dx, dy, dz = light_of_bright(scene, source.bright, reflector, seed, memory.trace)
        r, g, b, x, y, z = r + red, g + green, b + blue, x + dx, y + dy, z + dz
        red, green, blue, dx, dy, dz = light_of_bright(scene, source.outside, reflector, seed, memory.trace)
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
    way = memory.trace.sampled[k]
    if memory.sighted[k] >= 0 and not is_image(source.images, k, memory):
        red, green, blue = sighted_light(surfaces, memory.sighted[k], memory.sights, k)
    link, at = memory.links[k], memory.at
    if link >= 0:
        link = choose_node(source.atlas, source.worth, link, at[k], at[LANES + k], at[2 * LANES + k], memory)
    if link >= 0 and not source.known[link]:
        link = UNKNOWN
    if link >= 0:
        way, far = memory.trace.sampled[k], memory.trace.rays.real[ray.TFAR + k] > source.bright.near_m
        bright = source.outside if way == OUTDOORS else source.bright
        if not (far and memory.mirror[k] == NO_MIRROR and bright.chosen[link]):
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
