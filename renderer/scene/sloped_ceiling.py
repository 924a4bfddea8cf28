"""The ceiling of a room under a roof, as a closed solid of several planes, and the upper edges of the walls below it.

The inner face is the lower envelope of the flat ceiling and the planes of the room's slopes (:mod:`scene_description.ceilings`): the
floor's triangles are cut where two planes meet, and each piece is lifted onto the plane that is lowest over it.  World frame, metres.
"""

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from renderer.core.arrays import Array
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import flat_quads, make_mesh, merged
from scene_description import Room
from scene_description.ceilings import ceiling_planes
from scene_description.products import matmul

Profile = list[tuple[float, float]]

_TOUCH_M = 1e-9


def wall_profile(room: Room, polygon: Array, index: int) -> Profile:
    """Return where the ceiling meets a wall: places along it (metres from its start, rising) with their heights; straight between them."""
    start, end = polygon[index], polygon[(index + 1) % len(polygon)]
    length = float(np.hypot(*(end - start)))
    ends = np.array([(*start, 1.0), (*end, 1.0)])
    lines = [(room.height_m, room.height_m), *(matmul(plane, ends.T).tolist() for plane in ceiling_planes(room))]
    heights = {share: min(a + share * (b - a) for a, b in lines) for share in (0.0, 1.0)}
    for (a, b), (c, d) in itertools.combinations(lines, 2):
        if (a - c) * (b - d) < 0.0:
            share = (a - c) / ((a - c) - (b - d))
            height = a + share * (b - a)
            if height <= min(p + share * (q - p) for p, q in lines) + _TOUCH_M:
                heights[share] = height
    return [(share * length, height) for share, height in sorted(heights.items())]


def sloped_slab(room: Room, polygon: Array, triangles: NDArray[np.int64], uvs: Array, thickness: float) -> Mesh:
    """Return the ceiling with slopes as a closed solid, as thick everywhere when measured upwards, with sharp edges.

    Args:
        room: its height and slopes.
        polygon: (n, 2) floor outline, counter-clockwise.
        triangles: (n - 2, 3) of the outline.
        uvs: (n, 2) texture coordinates of the outline's corners, for the flat part; those of a slope run along its wall and up the slope.
        thickness: metres.
    """
    planes = np.vstack([(0.0, 0.0, room.height_m), ceiling_planes(room)])
    pieces = []
    for k, plane in enumerate(planes):
        for corners in triangles:
            piece = _lowest_part(np.column_stack([polygon[corners], uvs[corners]]), planes, k)
            if len(piece) >= 3:
                pieces.extend(_sheets(room, polygon, k, plane, piece, thickness))
    edges = []
    for index in range(len(polygon)):
        start, end, profile = polygon[index], polygon[(index + 1) % len(polygon)], wall_profile(room, polygon, index)
        length = profile[-1][0]
        for (a, low_a), (b, low_b) in itertools.pairwise(profile):
            (ax, ay), (bx, by) = (start + (end - start) * (along / length) for along in (a, b))
            edges.append([(ax, ay, low_a), (bx, by, low_b), (bx, by, low_b + thickness), (ax, ay, low_a + thickness)])
    return merged(*pieces, flat_quads(np.array(edges)))


def _lowest_part(piece: Array, planes: Array, k: int) -> Array:
    """Return the part of a convex piece (n, 4: x, y and more to interpolate) over which plane ``k`` is the lowest, maybe empty."""
    for other in (j for j in range(len(planes)) if j != k):
        above = _height(planes[other] - planes[k], piece)
        if other < k and above.max() <= _TOUCH_M:  # of planes that are the same the first one stays
            return piece[:0]
        kept: list[Array] = []
        for i, j in enumerate(np.roll(np.arange(len(piece)), -1)):
            if above[i] >= 0.0:
                kept.append(piece[i])
            if (above[i] > _TOUCH_M and above[j] < -_TOUCH_M) or (above[i] < -_TOUCH_M and above[j] > _TOUCH_M):
                kept.append(piece[i] + (piece[j] - piece[i]) * (above[i] / (above[i] - above[j])))
        piece = np.array(kept).reshape(-1, 4)
        if len(piece) < 3:
            break
    return piece


def _height(plane: Array, piece: Array) -> Array:
    return np.asarray(plane[0] * piece[:, 0] + plane[1] * piece[:, 1] + plane[2])


def _sheets(room: Room, polygon: Array, k: int, plane: Array, piece: Array, thickness: float) -> list[Mesh]:
    """Return the under side and the upper side of one convex piece of the ceiling."""
    uvs = piece[:, 2:]
    if k > 0:
        slope = (room.slopes or ())[k - 1]
        start = polygon[slope.wall]
        edge = polygon[(slope.wall + 1) % len(polygon)] - start
        along = edge / np.hypot(*edge)
        offset = piece[:, :2] - start
        uvs = np.column_stack([matmul(offset, along), matmul(offset, (-along[1], along[0])) / math.cos(slope.pitch_rad)])
    low = np.column_stack([piece[:, :2], _height(plane, piece)])
    up = np.broadcast_to((-plane[0], -plane[1], 1.0), low.shape)
    fan = np.array([(0, i, i + 1) for i in range(1, len(piece) - 1)])
    return [make_mesh(low, -up, fan[:, ::-1], uvs), make_mesh(low + np.array([0.0, 0.0, thickness]), up, fan, uvs)]
