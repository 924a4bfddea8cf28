"""Strays: hits about which no node knows anything, as all around lie within objects.

Light is computed for them as for nodes, and as far apart: those of a packet that lie closer together on one part have it in common.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES, aligned_floats, make_packet
from renderer.irradiance_cache.gathering import CoarseLight, gather_nodes
from renderer.irradiance_cache.hemisphere import GatherScratch, Rays, make_gather_scratch
from renderer.irradiance_cache.node_direct import light_nodes
from renderer.irradiance_cache.nodes import NodeLight, make_node_light
from renderer.path.light_nodes import Atlas
from renderer.path.records import LitScene, Scratch

_ZERO = np.float32(0.0)
_BUDGET = 32
"""About how many points on lights a stray samples."""
_SAME_WAY = np.float32(0.9)
"""Least cosine between the normals of strays that have their light in common."""
NONE = -1


class Strays(NamedTuple):
    """Memory of one thread for the strays of a tile.

    gather: rays and lanes beside those of the tile; atlas, light: a node for each lane; lanes: (16,) int64, lanes whose light is computed;
    server: (16,) int64, of each lane the one whose light it takes, NONE for those that are no strays; met: (1,) int64, how many strays
    there were in all.
    """

    gather: GatherScratch
    atlas: Atlas
    light: NodeLight
    lanes: NDArray[np.int64]
    server: NDArray[np.int64]
    met: NDArray[np.int64]


def make_strays(trace: Scratch) -> Strays:
    """Return that memory beside a thread's own."""
    apart = trace._replace(rays=make_packet(), lanes=aligned_floats(len(trace.lanes)), sampled=np.zeros(LANES, np.int32))
    colors, numbers = np.zeros((2, LANES, 3), np.float32), np.zeros(LANES, np.int32)
    tables = np.zeros((0, 4), np.int32), np.zeros((0, 6), np.float32), numbers[:0], np.zeros((0, 2), np.float32), numbers[:0]
    shares = np.zeros((LANES, 2), np.float32), np.zeros(LANES, np.float32)
    atlas = Atlas(*tables, colors[0], colors[1], numbers, *shares)
    lists = np.zeros((2, LANES), np.int64)
    return Strays(make_gather_scratch(apart), atlas, make_node_light(LANES), lists[0], lists[1], np.zeros(1, np.int64))


@inlined
def add_stray(trace: Scratch, k: int, count: int, apart_m: np.float32, strays: Strays) -> int:
    """Let lane k be one more stray beside ``count`` whose light is computed, unless one is within ``apart_m``; return how many are then."""
    lanes, atlas = trace.lanes, strays.atlas
    strays.met[0] += 1
    for axis in range(3):
        atlas.position[k, axis] = lanes[ln.P_X + LANES * axis + k]
        atlas.normal[k, axis] = lanes[ln.NG_X + LANES * axis + k]
    for i in range(count):
        other = strays.lanes[i]
        squared = cosine = _ZERO
        for axis in range(3):
            between = atlas.position[other, axis] - atlas.position[k, axis]
            squared += between * between
            cosine += atlas.normal[other, axis] * atlas.normal[k, axis]
        if trace.parts[other] == trace.parts[k] and squared < apart_m * apart_m and cosine > _SAME_WAY:
            strays.server[k] = other
            return count
    strays.lanes[count] = strays.server[k] = k
    return count + 1


@inlined
def light_strays(scene: LitScene, source: CoarseLight, rays: Rays, count: int, strays: Strays) -> None:
    """Compute the light of that many strays."""
    chosen = strays.lanes[:count]
    light_nodes(scene, strays.atlas, rays.key, _BUDGET, rays.pattern, chosen, strays.light.valid[:0], strays.gather.trace, strays.light)
    gather_nodes(scene, strays.atlas, source, rays, chosen, strays.gather, strays.light)
