"""What the nodes around the place where a ray ends say of its light."""

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames.records import ShadeScratch, Tables
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined
from renderer.irradiance_cache.nodes import LIGHT, VALID
from renderer.path.light_nodes import find_nodes

_ZERO, _ONE, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(np.inf)
_INVERSE_PI, _LEAST_VALID = np.float32(1.0 / np.pi), np.float32(1e-4)


@inlined
def look_up(
    tables: Tables, values: NDArray[np.float32], front: bool, k: int, memory: ShadeScratch
) -> tuple[np.float32, np.float32, np.float32, bool]:
    """Return what a table of the coarse nodes, (n, 3), says where ray k ends, and whether any of these nodes knows.

    It is their mean by weight and worth, or by weight alone where all have others that stand in for them.  Nodes that are black may lie in
    gaps that the ray ends outside of: they know nothing.
    """
    nodes, weights, rays, source = memory.trace.nodes, memory.trace.weights, memory.trace.rays, tables.source
    face, u, v = rays.integer[ray.PRIM_ID + k], rays.real[ray.BARY_U + k], rays.real[ray.BARY_V + k]
    count = find_nodes(source.atlas, face, u, v, front, nodes, weights)
    worth = by_weight = _ZERO
    for i in range(count):
        worth += weights[i] * source.worth[nodes[i]]
        by_weight += weights[i] if source.known[nodes[i]] else _ZERO
    total = worth if worth > _ZERO else by_weight
    r = g = b = _ZERO
    if total <= _ZERO:
        return r, g, b, False
    for i in range(count):
        weight = weights[i] / total * (source.worth[nodes[i]] if worth > _ZERO else _ONE if source.known[nodes[i]] else _ZERO)
        r, g, b = r + weight * values[nodes[i], 0], g + weight * values[nodes[i], 1], b + weight * values[nodes[i], 2]
    return r, g, b, bool(r + g + b > _ZERO)


@inlined
def light_on(
    tables: Tables, is_read: NDArray[np.bool_], sharp: bool, front: bool, k: int, memory: ShadeScratch
) -> tuple[np.float32, np.float32, np.float32, bool]:
    """Return the illuminance over pi where ray k ends, and whether a node knows it.

    If the ray is ``sharp`` that is by fine nodes, where the view reads all that lie around and one of these knows it; else by coarse ones.
    """
    nodes, weights, rows, rays = memory.trace.nodes, memory.trace.weights, tables.rows, memory.trace.rays
    if sharp:
        face, u, v = rays.integer[ray.PRIM_ID + k], rays.real[ray.BARY_U + k], rays.real[ray.BARY_V + k]
        count = find_nodes(tables.fine, face, u, v, front, nodes, weights)
        r = g = b = total = _ZERO
        for i in range(count):
            node = nodes[i]
            weight = weights[i] * rows[node, VALID] if is_read[node] else -_INFINITE
            total += weight
            r += weight * (rows[node, LIGHT] + tables.sun[node, 0])
            g += weight * (rows[node, LIGHT + 1] + tables.sun[node, 1])
            b += weight * (rows[node, LIGHT + 2] + tables.sun[node, 2])
        if total > _LEAST_VALID and r + g + b > _ZERO:
            scale = _INVERSE_PI / total
            return scale * r, scale * g, scale * b, True
    return look_up(tables, tables.even, front, k, memory)
