"""Radiosity: coarse nodes are linked by rays, once, and light passes along the links until it settles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core import embree as ray
from renderer.core.embree import LANES, SceneHandle
from renderer.core.kernel import entry
from renderer.core.random_numbers import mix_bits
from renderer.irradiance_cache.atlas import Atlas
from renderer.irradiance_cache.hemisphere import BEHIND, SIGHT, GatherScratch, aim_hemisphere, choose_node, follow, sighted_light
from renderer.irradiance_cache.nodes import unit_hash
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE, _PI, _INVERSE_PI = np.float32(0.0), np.float32(1.0), np.float32(np.pi), np.float32(1.0 / np.pi)


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
    sighted: NDArray[np.int32],
    sights: NDArray[np.float32],
    far_m: np.float32,
    first: int,
    end: int,
) -> int:
    """Fill what the s rays of nodes [first, end) hit: ``links`` (n, s), as of :func:`follow`, and ``at`` (n, 3, s), as of its ``at``.

    ``far``: (n,), the share of rays that end farther away than ``far_m``.  Rays that see lamps by mirrors, or what is outside, fill rows of
    ``sighted`` (r, 2), node and part, and ``sights`` (r, SIGHT), as of :func:`follow`; return how many.
    """
    count, rows = len(pattern), 0
    for node in range(first, end):
        u, v = unit_hash(node, key)
        seed = mix_bits(np.uint32(np.uint32(node) * np.uint32(0x85EBCA6B)) ^ key)
        for begin in range(0, count, LANES):
            aim_hemisphere(atlas, node, pattern, begin, u, v, scratch)
            follow(scene, atlas, surfaces, lights, seed + np.uint32(977 * begin), scratch, found)
            for k in range(LANES):
                links[node, begin + k] = found.links[k]
                far[node] += (_ONE if scratch.rays.real[ray.TFAR + k] > far_m and found.links[k] != BEHIND else _ZERO) / np.float32(count)
                for axis in range(3):
                    at[node, axis, begin + k] = found.at[LANES * axis + k]
                if found.sighted[k] >= 0:
                    sighted[rows, 0], sighted[rows, 1] = node, found.sighted[k]
                    for field in range(SIGHT):
                        sights[rows, field] = found.sights[k, field]
                    rows += 1
    return rows


@entry
def see_lights(surfaces: Surfaces, sighted: NDArray[np.int32], sights: NDArray[np.float32], rays: int, seen: NDArray[np.float32]) -> None:
    """Fill ``seen`` (n, 3), illuminance by mirrors and from outside, lux, from what the ``rays`` rays of each node have sighted."""
    scale = _PI / np.float32(rays)
    for i in range(len(sighted)):
        node, light = sighted[i, 0], sighted_light(surfaces, sighted[i, 1], sights, i)
        for channel in range(3):
            seen[node, channel] += scale * light[channel]


@entry
def resolve_links(
    atlas: Atlas, worth: NDArray[np.float32], at: NDArray[np.float32], found: GatherScratch, links: NDArray[np.int32], first: int, end: int
) -> None:
    """Replace the triangles in ``links`` of nodes [first, end) by nodes around the hits."""
    for node in range(first, end):
        for i in range(links.shape[1]):
            if links[node, i] >= 0:
                links[node, i] = choose_node(atlas, worth, links[node, i], at[node, 0, i], at[node, 1, i], at[node, 2, i], found)


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

    ``given``: (n, 3), illuminance by lights and sun, lux; ``seen``: as of :func:`see_lights`.
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
