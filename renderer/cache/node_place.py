"""Where a node stands: lanes that are hits there, and its random numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.cache.atlas import Atlas
from renderer.core import lanes as ln
from renderer.core.embree import LANES
from renderer.core.kernel import inlined
from renderer.core.random_numbers import mix_bits
from renderer.path.records import Scratch
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-20)


@inlined
def stand_on(atlas: Atlas, node: int, scratch: Scratch) -> None:
    """Let all lanes be hits at one node."""
    lanes = scratch.lanes
    x, y, z = atlas.position[node, 0], atlas.position[node, 1], atlas.position[node, 2]
    nx, ny, nz = atlas.normal[node, 0], atlas.normal[node, 1], atlas.normal[node, 2]
    lift = lift_height(x, y, z)
    for k in range(LANES):
        lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k] = x + lift * nx, y + lift * ny, z + lift * nz
        lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k] = nx, ny, nz
        lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k] = nx, ny, nz
        lanes[ln.HIT + k], lanes[ln.OUTSIDE + k] = _ONE, _ZERO


@inlined
def unit_hash(node: int, key: np.uint32) -> tuple[np.float32, np.float32]:
    """Return two numbers in [0, 1) that belong to a node."""
    first = mix_bits(np.uint32(mix_bits(np.uint32(node)) ^ key))
    second = mix_bits(np.uint32(first + np.uint32(0x9E3779B9)))
    return np.float32(first >> np.uint32(8)) * np.float32(2.0**-24), np.float32(second >> np.uint32(8)) * np.float32(2.0**-24)


@inlined
def turned(u: np.float32, shift: np.float32) -> np.float32:
    """Return u + shift within [0, 1)."""
    sum_ = u + shift
    return sum_ - _ONE if sum_ >= _ONE else sum_


@inlined
def arriving(lanes: NDArray[np.float32], k: int) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return 1 / LIGHT_PDF, the unit direction TO_LIGHT, and its cosine to NS."""
    x, y, z = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    scale = _ONE / np.sqrt(max(x * x + y * y + z * z, _TINY))
    x, y, z = x * scale, y * scale, z * scale
    cosine = max(x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k], _ZERO)
    return _ONE / lanes[ln.LIGHT_PDF + k], x, y, z, cosine
