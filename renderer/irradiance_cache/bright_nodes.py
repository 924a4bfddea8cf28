"""Coarse nodes that are much brighter than others, in the room and outside: few rays meet them, and by chance, so they are sampled."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import Reflector, reflected_share
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.random_numbers import mix_bits
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.hemisphere import node_seed
from renderer.irradiance_cache.nodes import arriving, reflector_of, stand_on
from renderer.irradiance_cache.panes import Panes
from renderer.irradiance_cache.specular import pass_glass
from renderer.path.emission import pane_transmittance
from renderer.path.light_nodes import Atlas
from renderer.path.records import LitScene, Scratch
from scene_description.products import matmul

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_CLEAR_M = np.float32(1e-3)
_LEAST_COSINE = np.float32(0.05)
BRIGHT_RAYS = 2 * LANES
"""By how many points of bright nodes a node is lit, each of another run of all samples: all nodes by the same would be wrong alike."""


class Bright(NamedTuple):
    """Coarse nodes that are much brighter than others, sampled as lights are, for kernels.

    chosen: (n,) bool, which they are; point, normal, weight: (s, 3) float32 each, samples of them, metres and world, and luminance times
    area that each stands for where there is one ray for each of BRIGHT_RAYS runs of them, cd; pane: (s,) int32, the one of ``panes``
    by which each is seen, -1 in the room.  Light from nearer than ``near_m`` is gathered instead.
    """

    chosen: NDArray[np.bool_]
    point: NDArray[np.float32]
    normal: NDArray[np.float32]
    weight: NDArray[np.float32]
    pane: NDArray[np.int32]
    panes: Panes
    near_m: np.float32


def choose_bright(
    luminance: NDArray[np.float32],
    certain: NDArray[np.float32],
    atlas: Atlas,
    least: float,
    samples: int,
    near_m: float,
    pane: NDArray[np.int32],
    panes: Panes,
) -> Bright:
    """Choose the nodes that are brighter than ``least``, cd/m2, and sample them by flux.

    ``luminance``, ``certain``: (n, 3), cd/m2, what leaves them, and what of it they are chosen by: were they chosen by what few rays bring
    by chance, they would be too bright in the mean.  ``pane``: (n,) int32, by which each is seen, -1 in the room.
    """
    shown = matmul(luminance.astype(np.float64), LUMINANCE)
    area = atlas.area.astype(np.float64)
    chosen = (matmul(certain.astype(np.float64), LUMINANCE) > max(least, 1e-12)) & (shown > 0.0) & (area > 0.0)
    nodes = np.flatnonzero(chosen)
    flux = shown[nodes] * area[nodes]
    total = flux.sum()
    if total == 0.0:
        nothing = np.zeros((0, 3), np.float32)
        return Bright(np.zeros(len(shown), np.bool_), nothing, nothing, nothing, np.zeros(0, np.int32), panes, np.float32(near_m))
    picked = nodes[np.searchsorted(np.cumsum(flux), (np.arange(samples) + 0.5) / samples * total).clip(0, len(nodes) - 1)]
    weight = (luminance[picked] / shown[picked, None] * (total / BRIGHT_RAYS)).astype(np.float32)
    return Bright(chosen, atlas.position[picked], atlas.normal[picked], weight, pane[picked], panes, np.float32(near_m))


@entry
def light_from_bright(
    scene: LitScene, atlas: Atlas, bright: Bright, key: np.uint32, nodes: NDArray[np.int64], scratch: Scratch, lux: NDArray[np.float32]
) -> None:
    """Add to ``lux`` (n, 3) of some nodes what falls on them from bright ones, sampled as lights are."""
    for i in range(len(nodes)):
        node = nodes[i]
        reflector = reflector_of(scene.surfaces, atlas.face[node], True)
        stand_on(atlas, node, scratch)
        r, g, b, _, _, _ = light_of_bright(scene, bright, reflector, node_seed(node, key), scratch)
        lux[node, 0], lux[node, 1], lux[node, 2] = lux[node, 0] + r, lux[node, 1] + g, lux[node, 2] + b


def links_to_bright(atlas: Atlas, bright: Bright, links: NDArray[np.int32], straight: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which links (n, s) end at bright nodes whose light :func:`light_from_bright` finds: those that are ``straight``."""
    found = straight & (links >= 0) & bright.chosen[links]
    node, i = np.nonzero(found)
    between = atlas.position[links[node, i]] - atlas.position[node]
    found[node, i] = (between * between).sum(axis=1) > bright.near_m * bright.near_m
    return found


@kernel
def light_of_bright(
    scene: LitScene, bright: Bright, reflector: Reflector, seed: np.uint32, scratch: Scratch
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance (r, g, b) at the lanes' hit by BRIGHT_RAYS samples of bright nodes, and luminance times direction.

    ``seed``: chooses within their runs.
    """
    lanes = scratch.lanes
    r = g = b = vx = vy = vz = _ZERO
    for begin in range(0, BRIGHT_RAYS if len(bright.point) > 0 else 0, LANES):
        for k in range(LANES):
            _aim(scene, bright, begin + k, seed, k, lanes)
        pass_glass(scene, scratch)
        for k in range(LANES):
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                _, dx, dy, dz, cosine = arriving(lanes, k)
                share = reflected_share(reflector, cosine, scene.surfaces.albedos.reflected)
                red, green, blue = share * lanes[ln.LI_R + k], share * lanes[ln.LI_G + k], share * lanes[ln.LI_B + k]
                r, g, b = r + cosine * red, g + cosine * green, b + cosine * blue
                weight = _RED * red + _GREEN * green + _BLUE * blue
                vx, vy, vz = vx + weight * dx, vy + weight * dy, vz + weight * dz
    return r, g, b, vx, vy, vz


@inlined
def _aim(scene: LitScene, bright: Bright, turn: int, seed: np.uint32, k: int, lanes: NDArray[np.float32]) -> None:
    """Fill TO_LIGHT, LIGHT_END, LI and LIGHT_PDF of lane k with a sample of run ``turn``."""
    run = len(bright.point) // BRIGHT_RAYS
    i = turn * run + int(mix_bits(np.uint32(seed + np.uint32(turn)))) % run
    px, py, pz = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
    x, y, z = bright.point[i, 0] - px, bright.point[i, 1] - py, bright.point[i, 2] - pz
    squared = x * x + y * y + z * z
    inverse = _ONE / np.sqrt(max(squared, _TINY))
    here = (x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]) * inverse
    there = -(x * bright.normal[i, 0] + y * bright.normal[i, 1] + z * bright.normal[i, 2]) * inverse
    arrives = (here > _ZERO) & (there > _ZERO) & (squared > bright.near_m * bright.near_m)
    weight = there / max(squared, _TINY) if arrives else _ZERO
    # The ray ends off the surface that shines.
    reach = _ONE - _CLEAR_M * inverse / max(there, _LEAST_COSINE)
    pane, panes = bright.pane[i], bright.panes
    if pane >= 0:
        nx, ny, nz = panes.inward[pane, 0], panes.inward[pane, 1], panes.inward[pane, 2]
        px, py, pz = px - panes.middle[pane, 0], py - panes.middle[pane, 1], pz - panes.middle[pane, 2]
        if px * nx + py * ny + pz * nz > _ZERO:
            weight *= pane_transmittance(scene.surfaces, panes.part[pane], abs(x * nx + y * ny + z * nz) * inverse)
        # Such rays go beyond panes by going on beyond TO_LIGHT.
        reach *= _HALF
    for axis in range(3):
        lanes[ln.LI_R + LANES * axis + k] = weight * bright.weight[i, axis]
    lanes[ln.LIGHT_PDF + k], lanes[ln.LIGHT_END + k] = _ONE if arrives else _ZERO, _TWO if pane >= 0 else _ONE
    lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = reach * x, reach * y, reach * z
