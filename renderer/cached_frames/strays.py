"""Strays: hits about which no node knows anything, as all around lie within objects.

The packets that have some wait; light is computed for all strays of a view as for nodes, and as far apart, then the packets are shaded.
Strays that lie closer together on one part have their light in common: at once where they come soon after each other in a row, then all
of a picture, and those of its edges with these.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import entry, inlined
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
    lit_by: NDArray[np.int32]
    light: NodeLight


class LitStrays(NamedTuple):
    """The strays of a view for which light is computed.

    places: (n, 6) float32, part, face: (n,) int32, as of :class:`Strays`; before: (n,) int32, the one before on the same part, -1 for none;
    newest: (p,) int32, the last of each part, -1 for none; light: of all of them, or of those of the picture while its edges' are new.
    """

    places: NDArray[np.float32]
    part: NDArray[np.int32]
    face: NDArray[np.int32]
    before: NDArray[np.int32]
    newest: NDArray[np.int32]
    light: NodeLight


def make_strays(rows: int, room: int) -> Strays:
    """Return room for them; memory is taken as it is filled."""
    server, part, face, lit_by = (np.empty((rows, room), np.int32) for _ in range(4))
    return Strays(server, np.zeros(rows, np.int32), np.empty((rows, room, 6), np.float32), part, face, lit_by, make_node_light(0))


def none_lit(parts: int) -> LitStrays:
    """Return those of a view of so many parts before it is shaded."""
    numbers = np.empty(0, np.int32)
    return LitStrays(np.empty((0, 6), np.float32), numbers, numbers, numbers, np.full(parts, _NONE, np.int32), make_node_light(0))


def share_strays(strays: Strays, lit: LitStrays, apart_m: np.float32) -> LitStrays:
    """Return ``lit`` with those of ``strays`` that are not within ``apart_m`` of one there, and fill ``lit_by``."""
    known, room = len(lit.part), len(lit.part) + int(strays.counts.sum())
    places, (part, face, before) = np.empty((room, 6), np.float32), np.empty((3, room), np.int32)
    places[:known], part[:known], face[:known], before[:known] = lit.places, lit.part, lit.face, lit.before
    newest = lit.newest.copy()
    count = _share(strays, LitStrays(places, part, face, before, newest, lit.light), known, apart_m)
    return LitStrays(places[:count], part[:count], face[:count], before[:count], newest, lit.light)


@entry
def _share(strays: Strays, lit: LitStrays, known: int, apart_m: np.float32) -> int:
    """Do it in place, ``known`` of whose rows are filled; return how many are then."""
    count = known
    for row in range(len(strays.counts)):
        for i in range(strays.counts[row]):
            place, part = strays.places[row, i], strays.part[row, i]
            other = lit.newest[part]
            while other != _NONE and not _is_near(lit.places[other], place, apart_m):
                other = lit.before[other]
            if other == _NONE:
                other, count = count, count + 1
                for axis in range(6):
                    lit.places[other, axis] = place[axis]
                lit.part[other], lit.face[other] = part, strays.face[row, i]
                lit.before[other], lit.newest[part] = lit.newest[part], other
            strays.lit_by[row, i] = other
    return count


def places_of(lit: LitStrays) -> Atlas:
    """Return those whose light is not known as nodes of no surface."""
    places, faces = lit.places[len(lit.light.valid) :], lit.face[len(lit.light.valid) :]
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
    for axis in range(6):
        places[row, count, axis] = lanes[_AXES[axis] + k]
    for i in range(count - 1, max(count - _REMEMBERED, 0) - 1, -1):
        if strays.part[row, i] == trace.parts[k] and _is_near(places[row, i], places[row, count], apart_m):
            strays.server[row, begin + k] = i
            return
    strays.part[row, count], strays.face[row, count] = trace.parts[k], trace.rays.integer[ray.PRIM_ID + k]
    strays.server[row, begin + k] = count
    strays.counts[row] = count + 1


@inlined
def _is_near(place: NDArray[np.float32], other: NDArray[np.float32], apart_m: np.float32) -> bool:
    """Return whether two places of :class:`Strays` on one part have their light in common."""
    squared = cosine = _ZERO
    for axis in range(3):
        between = place[axis] - other[axis]
        squared += between * between
        cosine += place[3 + axis] * other[3 + axis]
    return bool((squared < apart_m * apart_m) & (cosine > _SAME_WAY))
