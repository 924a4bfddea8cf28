"""Strays: hits about which no node knows anything, as all around lie within objects.

The packets that have some wait; light is computed for all strays of a view as for nodes, and as far apart, then the packets are shaded.
Strays of a row that come soon after each other and lie closer together on one part have their light in common.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.nodes import NodeLight, make_node_light
from renderer.path.light_nodes import Atlas
from renderer.path.records import Scratch

_ZERO = np.float32(0.0)
_SAME_WAY = np.float32(0.9)
"""Least cosine between the normals of strays that have their light in common."""
_REMEMBERED = 32
"""Among how many of a row's last strays a new one looks for one that is near."""
_NONE = -1
_AXES = (ln.P_X, ln.P_Y, ln.P_Z, ln.NG_X, ln.NG_Y, ln.NG_Z)


class Strays(NamedTuple):
    """The strays of a view, by rows of packets, each with room for all that it may have.

    server: (rows, room) int32, of each hit, in the order of packets, the number in its row of the stray whose light it takes, -1 for those
    that are none; counts: (rows,) int32; places: (rows, room, 6) float32, metres and normal, world; part, face: (rows, room) int32.
    first: (rows,) int64, where a row's strays begin in ``light``, which is empty while it is not known.
    """

    server: NDArray[np.int32]
    counts: NDArray[np.int32]
    places: NDArray[np.float32]
    part: NDArray[np.int32]
    face: NDArray[np.int32]
    first: NDArray[np.int64]
    light: NodeLight


def make_strays(rows: int, room: int) -> Strays:
    """Return room for them; memory is taken as it is filled."""
    server, part, face = (np.empty((rows, room), np.int32) for _ in range(3))
    places = np.empty((rows, room, 6), np.float32)
    return Strays(server, np.zeros(rows, np.int32), places, part, face, np.zeros(rows, np.int64), make_node_light(0))


def places_of(strays: Strays) -> Atlas:
    """Return the strays of a view as nodes of no surface, and let ``first`` say which are a row's."""
    places, faces = (
        np.concatenate([row[:count] for row, count in zip(table, strays.counts, strict=True)]) for table in (strays.places, strays.face)
    )
    strays.first[:] = np.cumsum(strays.counts, dtype=np.int64) - strays.counts
    numbers, shares = np.zeros(len(places), np.int32), np.zeros((len(places), 2), np.float32)
    tables = np.zeros((0, 4), np.int32), np.zeros((0, 6), np.float32), numbers[:0], shares[:0], numbers[:0]
    return Atlas(*tables, places[:, :3].copy(), places[:, 3:].copy(), faces, shares, shares[:, 0].copy())


@inlined
def has_strays(strays: Strays, row: int, begin: int) -> bool:
    """Return whether the packet that begins at a place of a row has any."""
    if strays.counts[row] > 0:
        for k in range(LANES):
            if strays.server[row, begin + k] != _NONE:
                return True
    return False


@inlined
def expect_none(strays: Strays, row: int, begin: int) -> None:
    """Begin with a packet."""
    for k in range(LANES):
        strays.server[row, begin + k] = _NONE


@inlined
def add_stray(trace: Scratch, k: int, row: int, begin: int, apart_m: np.float32, strays: Strays) -> None:
    """Let lane k of a packet, which begins at a place of a row, be a stray, with the light of one of the row's last within ``apart_m``."""
    lanes, places, count = trace.lanes, strays.places, strays.counts[row]
    for i in range(count - 1, max(count - _REMEMBERED, 0) - 1, -1):
        squared = cosine = _ZERO
        for axis in range(3):
            between = places[row, i, axis] - lanes[_AXES[axis] + k]
            squared += between * between
            cosine += places[row, i, 3 + axis] * lanes[_AXES[3 + axis] + k]
        if strays.part[row, i] == trace.parts[k] and squared < apart_m * apart_m and cosine > _SAME_WAY:
            strays.server[row, begin + k] = i
            return
    for axis in range(6):
        places[row, count, axis] = lanes[_AXES[axis] + k]
    strays.part[row, count], strays.face[row, count] = trace.parts[k], trace.rays.integer[ray.PRIM_ID + k]
    strays.server[row, begin + k] = count
    strays.counts[row] = count + 1
