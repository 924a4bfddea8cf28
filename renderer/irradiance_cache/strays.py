"""Strays: hits about which no node knows anything, as all around lie within objects.  Light is computed for each alone, as for a node."""

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

_BUDGET = 32
"""About how many points on lights a stray samples."""


class Strays(NamedTuple):
    """Memory of one thread for the strays of a tile.

    gather: rays and lanes beside those of the tile; atlas, light: a node for each lane; lanes: (16,) int64, lanes that are strays; met:
    (1,) int64, how many strays there were in all.
    """

    gather: GatherScratch
    atlas: Atlas
    light: NodeLight
    lanes: NDArray[np.int64]
    met: NDArray[np.int64]


def make_strays(trace: Scratch) -> Strays:
    """Return that memory beside a thread's own."""
    apart = trace._replace(rays=make_packet(), lanes=aligned_floats(len(trace.lanes)), sampled=np.zeros(LANES, np.int32))
    colors, numbers = np.zeros((2, LANES, 3), np.float32), np.zeros(LANES, np.int32)
    tables = np.zeros((0, 4), np.int32), np.zeros((0, 6), np.float32), numbers[:0], np.zeros((0, 2), np.float32), numbers[:0]
    shares = np.zeros((LANES, 2), np.float32), np.zeros(LANES, np.float32)
    atlas = Atlas(*tables, colors[0], colors[1], numbers, *shares)
    return Strays(make_gather_scratch(apart), atlas, make_node_light(LANES), np.zeros(LANES, np.int64), np.zeros(1, np.int64))


@inlined
def add_stray(lanes: NDArray[np.float32], k: int, count: int, strays: Strays) -> int:
    """Let lane k be one more stray beside ``count``; return how many there are then."""
    for axis in range(3):
        strays.atlas.position[k, axis] = lanes[ln.P_X + LANES * axis + k]
        strays.atlas.normal[k, axis] = lanes[ln.NG_X + LANES * axis + k]
    strays.lanes[count] = k
    strays.met[0] += 1
    return count + 1


@inlined
def light_strays(scene: LitScene, source: CoarseLight, rays: Rays, count: int, strays: Strays) -> None:
    """Compute the light of that many strays."""
    chosen = strays.lanes[:count]
    light_nodes(scene, strays.atlas, rays.key, _BUDGET, rays.pattern, chosen, strays.gather.trace, strays.light)
    gather_nodes(scene, strays.atlas, source, rays, chosen, strays.gather, strays.light)
