"""Radiosity: coarse nodes are linked by rays, once, and light passes along the links until it settles."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import ray_packet as ray
from renderer.core.kernel import entry
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.hemisphere import (
    BEHIND,
    ESCAPED,
    NO_MIRROR,
    OUTDOORS,
    SIGHT,
    GatherScratch,
    Rays,
    aim_hemisphere,
    choose_node,
    follow,
    node_seed,
    sighted_light,
)
from renderer.irradiance_cache.lamp_images import LampImages, is_image
from renderer.irradiance_cache.nodes import unit_hash
from renderer.irradiance_cache.outside import UnderSky
from renderer.path.light_nodes import Atlas
from renderer.path.records import LitScene
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE, _PI, _INVERSE_PI = np.float32(0.0), np.float32(1.0), np.float32(np.pi), np.float32(1.0 / np.pi)
_SETTLED = 1e-6


class Links(NamedTuple):
    """Where the s rays of n nodes end.

    ends: (n, s) int32, at: (n, 3, s) float32, as ``links`` and ``at`` of :func:`follow`; outdoors, straight: (n, s) bool, those that have
    left by a pane, and those that nothing has mirrored; far: (n,) float32, the share of rays that end far away; escaped: those that meet
    nothing.
    """

    ends: NDArray[np.int32]
    at: NDArray[np.float32]
    outdoors: NDArray[np.bool_]
    straight: NDArray[np.bool_]
    far: NDArray[np.float32]
    escaped: UnderSky


class Sightings(NamedTuple):
    """Rays that see lamps by mirrors: (r, 2) int32, node and part, and (r, SIGHT), as ``sights`` of :func:`follow`."""

    node_part: NDArray[np.int32]
    sights: NDArray[np.float32]


class Sheets(NamedTuple):
    """What nodes on cloth and leaves let through.

    behind: (n,) int32, the node on the other side, -1 where there is none; passed: (n, 3) float32, what of the light there leaves on this
    side; lit: (n, 3) float32, the luminance on this side, cd/m2, by lights on the other; light: (n, 3) float32, that by all light there.
    """

    behind: NDArray[np.int32]
    passed: NDArray[np.float32]
    lit: NDArray[np.float32]
    light: NDArray[np.float32]


def make_sightings(count: int) -> Sightings:
    """Return room for so many."""
    return Sightings(np.zeros((count, 2), np.int32), np.zeros((count, SIGHT), np.float32))


@entry
def link_nodes(
    scene: LitScene,
    atlas: Atlas,
    rays: Rays,
    images: LampImages,
    memory: GatherScratch,
    links: Links,
    sightings: Sightings,
    first: int,
    end: int,
) -> int:
    """Fill what the rays of nodes [first, end) hit, and the first rows of ``sightings``, without ``images``; return how many."""
    count, rows, traced = len(rays.pattern), 0, memory.trace.rays
    for node in range(first, end):
        u, v = unit_hash(node, rays.key)
        seed = node_seed(node, rays.key)
        for begin in range(0, count, LANES):
            aim_hemisphere(atlas, node, rays.pattern, begin, u, v, traced)
            follow(scene, atlas, seed + np.uint32(977 * begin), memory)
            for k in range(LANES):
                links.ends[node, begin + k] = memory.links[k]
                is_far = traced.real[ray.TFAR + k] > rays.far_m and memory.links[k] != BEHIND
                links.far[node] += (_ONE if is_far else _ZERO) / np.float32(count)
                if memory.links[k] == ESCAPED:
                    links.escaped.share[node] += _ONE / np.float32(count)
                    for axis in range(3):
                        links.escaped.way[node, axis] += traced.real[ray.DIR_X + LANES * axis + k] / np.float32(count)
                links.outdoors[node, begin + k] = memory.trace.sampled[k] == OUTDOORS
                links.straight[node, begin + k] = memory.mirror[k] == NO_MIRROR
                for axis in range(3):
                    links.at[node, axis, begin + k] = memory.at[LANES * axis + k]
                if memory.sighted[k] >= 0 and not is_image(images, k, memory):
                    sightings.node_part[rows, 0], sightings.node_part[rows, 1] = node, memory.sighted[k]
                    for field in range(SIGHT):
                        sightings.sights[rows, field] = memory.sights[k, field]
                    rows += 1
    return rows


@entry
def see_lights(surfaces: Surfaces, sightings: Sightings, light: NDArray[np.float32]) -> None:
    """Add to ``light`` (n, 3), luminance by mirrors, cd/m2, what all rays of each node have sighted."""
    for i in range(len(sightings.node_part)):
        node, color = sightings.node_part[i, 0], sighted_light(surfaces, sightings.node_part[i, 1], sightings.sights, i)
        for channel in range(3):
            light[node, channel] += color[channel]


@entry
def resolve_links(atlas: Atlas, worth: NDArray[np.float32], links: Links, memory: GatherScratch, first: int, end: int) -> None:
    """Replace the triangles that rays of nodes [first, end) end at by nodes around the hits."""
    ends, at = links.ends, links.at
    for node in range(first, end):
        for i in range(ends.shape[1]):
            if ends[node, i] >= 0:
                ends[node, i] = choose_node(atlas, worth, ends[node, i], at[node, 0, i], at[node, 1, i], at[node, 2, i], memory)


@entry
def solve_links(
    links: NDArray[np.int32],
    given: NDArray[np.float32],
    by_mirrors: NDArray[np.float32],
    albedo: NDArray[np.float32],
    shining: NDArray[np.float32],
    sheets: Sheets,
    most_sweeps: int,
    luminance: NDArray[np.float32],
) -> None:
    """Fill ``luminance`` (n, 3), cd/m2: what leaves each node once light has passed along the links until it settles (Gauss and Seidel).

    ``given``: (n, 3), illuminance by what no link brings, lux; ``by_mirrors``: as of :func:`see_lights`; ``shining``: (n, 3), what leaves
    by lights alone, cd/m2.  It has settled when no more than a millionth of all changes, so that what leaves is what arrives, reflected,
    and what shines.  What sheets let through is not part of
    it, but of ``sheets.light``; it passes along the links like all light.
    """
    count, (behind, passed, lit, through) = links.shape[1], sheets
    for _ in range(most_sweeps):
        total = change = 0.0
        for node in range(len(links)):
            r, g, b = by_mirrors[node, 0], by_mirrors[node, 1], by_mirrors[node, 2]
            free = 0
            for i in range(count):
                link = links[node, i]
                free += link >= ESCAPED
                if link >= 0:
                    r += luminance[link, 0] + through[link, 0]
                    g += luminance[link, 1] + through[link, 1]
                    b += luminance[link, 2] + through[link, 2]
            scale = _PI / np.float32(max(free, 1))
            before = luminance[node, 0] + luminance[node, 1] + luminance[node, 2]
            luminance[node, 0] = albedo[node, 0] * _INVERSE_PI * (scale * r + given[node, 0]) + shining[node, 0]
            luminance[node, 1] = albedo[node, 1] * _INVERSE_PI * (scale * g + given[node, 1]) + shining[node, 1]
            luminance[node, 2] = albedo[node, 2] * _INVERSE_PI * (scale * b + given[node, 2]) + shining[node, 2]
            after = luminance[node, 0] + luminance[node, 1] + luminance[node, 2]
            total, change = total + after, change + abs(after - before)
            other = behind[node]
            if other >= 0:
                through[other, 0] = passed[other, 0] * _INVERSE_PI * (scale * r + given[node, 0]) + lit[other, 0]
                through[other, 1] = passed[other, 1] * _INVERSE_PI * (scale * g + given[node, 1]) + lit[other, 1]
                through[other, 2] = passed[other, 2] * _INVERSE_PI * (scale * b + given[node, 2]) + lit[other, 2]
        if change <= _SETTLED * total:
            break
