"""The shell of a room: floor, ceiling, walls with holes for doors and windows, skirting boards, and the placing of openings.

Every wall is a closed solid from its inner face outward; walls run past floor and ceiling and overlap at corners, floor and ceiling are
closed slabs, the ceiling one of several planes where it is sloped.  So each crack that rounding could leave between two inner faces has
another surface behind it: the shell is light-tight.  World frame, metres.
"""

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from renderer.core.arrays import Array
from renderer.core.errors import FlattenError
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import flat_quads, make_mesh, merged
from renderer.models.model import Parts
from renderer.models.openings import OPENING_MODELS, Hole
from renderer.scene.sloped_ceiling import Profile, sloped_slab, wall_profile
from scene_description import Opening, Room
from scene_description.ceilings import ceiling_over_opening_m
from scene_description.products import matmul
from scene_description.types import SKIRTING_DEPTH_M, SKIRTING_HEIGHT_M

Rectangle = tuple[float, float, float, float]

SLAB_M = 0.1
OVERLAP_M = 0.01
LONGEST_MITRE = 3.0
CASING_M = 0.075


def build_shell(room: Room) -> Parts:
    """Return the parts ``floor``, ``wall``, ``ceiling`` and ``skirting`` in the world."""
    polygon = np.asarray(room.polygon_m, np.float64)
    triangles = triangulate(polygon)
    walls = [_wall(room, polygon, index) for index in range(len(polygon))]
    boards = [board for index in range(len(polygon)) for board in _skirting(room, polygon, index)]
    parts = {"floor": _slab(polygon, triangles, -SLAB_M, 0.0), "wall": merged(*walls), "ceiling": _ceiling(room, polygon, triangles)}
    return parts | ({"skirting": merged(*boards)} if boards else {})


def build_opening(room: Room, opening: Opening, generator: str, style: str, seed: int) -> Parts:
    """Return the parts of a door or window in the world; style "default" is the generator's first.

    Raises:
        KeyError: the generator or the style is unknown.
    """
    model = OPENING_MODELS[generator]
    chosen = model.styles[0] if style == "default" else style
    if chosen not in model.styles:
        raise KeyError(style)
    headroom = ceiling_over_opening_m(room, opening) - opening.sill_m - opening.height_m
    hole = Hole(opening.width_m, opening.height_m, room.wall_thickness_m, headroom, opening.hinge, opening.swing)
    start, along, inward, _ = wall_frame(np.asarray(room.polygon_m, np.float64), opening.wall)
    origin = start + along * (opening.offset_m + 0.5 * opening.width_m)
    rotation = np.array([[inward[0], -along[0], 0.0], [inward[1], -along[1], 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([origin[0], origin[1], opening.sill_m])
    return {
        name: mesh._replace(
            vertices=(matmul(mesh.vertices, rotation.T) + shift).astype(np.float32),
            normals=matmul(mesh.normals, rotation.T).astype(np.float32),
        )
        for name, mesh in model.build(np.random.default_rng(seed), hole, chosen).items()
    }


def wall_frame(polygon: Array, index: int) -> tuple[Array, Array, Array, float]:
    """Return start (2,), unit direction (2,), unit inward normal (2,) and length of wall ``index`` of a counter-clockwise outline."""
    start, end = polygon[index], polygon[(index + 1) % len(polygon)]
    length = float(np.hypot(*(end - start)))
    along = (end - start) / length
    return start, along, np.array([-along[1], along[0]]), length


def triangulate(polygon: Array) -> NDArray[np.int64]:
    """Return the (n - 2, 3) counter-clockwise triangles of a simple counter-clockwise outline (n, 2), by ear clipping.

    Raises:
        FlattenError: the outline is not simple.
    """
    left = list(range(len(polygon)))
    triangles: list[tuple[int, int, int]] = []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(polygon, left, k, 1e-12)), None)
        if ear is None:
            ear = next((k for k in range(len(left)) if _is_ear(polygon, left, k, -1e-12)), None)
        if ear is None:
            raise FlattenError(f"outline of {len(polygon)} points: expected a simple polygon, got one without an ear; check room.polygon_m")
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    return np.array([*triangles, tuple(left)], np.int64)


def _is_ear(polygon: Array, left: list[int], k: int, least: float) -> bool:
    """Whether corner k is convex (twice its area above ``least``) and no other corner lies in its triangle."""
    a, b, c = polygon[left[k - 1]], polygon[left[k]], polygon[left[(k + 1) % len(left)]]
    if _cross(b - a, c - a) <= least:
        return False
    others = polygon[[i for j, i in enumerate(left) if j not in (k, (k - 1) % len(left), (k + 1) % len(left))]]
    inside = (_cross(b - a, others - a) > -1e-12) & (_cross(c - b, others - b) > -1e-12) & (_cross(a - c, others - c) > -1e-12)
    corner = (others == a).all(axis=1) | (others == b).all(axis=1) | (others == c).all(axis=1)
    return not bool((inside & ~corner).any())


def _cross(u: Array, v: Array) -> Array:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _ceiling(room: Room, polygon: Array, triangles: NDArray[np.int64]) -> Mesh:
    """Return the ceiling as a closed slab."""
    if room.slopes is None:
        return _slab(polygon, triangles, room.height_m, room.height_m + SLAB_M)
    return sloped_slab(room, polygon, triangles, _slab_uvs(polygon), SLAB_M)


def _slab_uvs(polygon: Array) -> Array:
    """Return texture coordinates (n, 2) of the outline's corners: along the longest side, from that side's start."""
    start, along, across, _ = max((wall_frame(polygon, index) for index in range(len(polygon))), key=lambda frame: frame[3])
    return np.stack([matmul(polygon - start, along), matmul(polygon - start, across)], axis=1)


def _slab(polygon: Array, triangles: NDArray[np.int64], low: float, high: float) -> Mesh:
    """Return the closed prism over the outline, with sharp edges; its pattern runs along the longest side, from that side's start."""
    count = len(polygon)
    top, bottom = np.column_stack([polygon, np.full(count, high)]), np.column_stack([polygon, np.full(count, low)])
    following = np.roll(np.arange(count), -1)
    corners = np.stack([bottom, bottom[following], top[following], top], axis=1)
    up = np.broadcast_to((0.0, 0.0, 1.0), top.shape)
    uvs = _slab_uvs(polygon)
    return merged(make_mesh(top, up, triangles, uvs), make_mesh(bottom, -up, triangles[:, ::-1], uvs), flat_quads(corners))


def _corner_reach(polygon: Array, corner: int, thickness: float) -> float:
    """How far a wall's outer face runs past this corner: a little more than the mitre.

    Where the room bends outward it stops a little short of it, so that the wall's end lies within the next wall and not in its inner face.
    """
    count = len(polygon)
    before, after = polygon[corner] - polygon[corner - 1], polygon[(corner + 1) % count] - polygon[corner]
    turn = math.atan2(float(_cross(before, after)), float(matmul(before, after)))
    if turn <= 0.0:
        return -OVERLAP_M if turn < -1e-3 else 0.0
    return thickness * min(math.tan(0.5 * min(turn, 3.1)), LONGEST_MITRE) + OVERLAP_M


def _wall(room: Room, polygon: Array, index: int) -> Mesh:
    """Return one wall: inner and outer face with holes, reveals, ends, top and bottom."""
    start, along, inward, length = wall_frame(polygon, index)
    thickness = room.wall_thickness_m
    low = -SLAB_M
    inner: Profile = [(0.0, room.height_m + SLAB_M), (length, room.height_m + SLAB_M)]
    if room.slopes is not None:
        # no point of a slanting edge may look out over the ceiling: the light there would be taken for the wall's
        inner = [(along_m, height + 0.5 * SLAB_M) for along_m, height in wall_profile(room, polygon, index)]
    holes = [(o.offset_m, o.offset_m + o.width_m, o.sill_m, o.sill_m + o.height_m) for o in room.openings if o.wall == index]
    first, last = -_corner_reach(polygon, index, thickness), length + _corner_reach(polygon, (index + 1) % len(polygon), thickness)
    outer: Profile = [(first, inner[0][1]), *inner[1:-1], (last, inner[-1][1])]
    levels = [level for o in room.openings for level in (o.sill_m, o.sill_m + o.height_m)]
    quads: list[list[tuple[float, float, float]]] = []
    for a, b, c, d, e in _cells(inner, low, holes, levels):
        quads.append([(b, 0.0, c), (a, 0.0, c), (a, 0.0, d), (b, 0.0, e)])
    for a, b, c, d, e in _cells(outer, low, holes, []):
        quads.append([(a, -thickness, c), (b, -thickness, c), (b, -thickness, e), (a, -thickness, d)])
    for a, b, c, d in holes:
        for (p, q), (r, s) in (((a, c), (b, c)), ((b, c), (b, d)), ((b, d), (a, d)), ((a, d), (a, c))):
            quads.append([(r, 0.0, s), (p, 0.0, q), (p, -thickness, q), (r, -thickness, s)])
    (_, start_high), (_, end_high) = inner[0], inner[-1]
    quads.append([(0.0, 0.0, low), (first, -thickness, low), (first, -thickness, start_high), (0.0, 0.0, start_high)])
    quads.append([(last, -thickness, low), (length, 0.0, low), (length, 0.0, end_high), (last, -thickness, end_high)])
    for ((a, high_a), (b, high_b)), ((c, _), (d, _)) in zip(itertools.pairwise(inner), itertools.pairwise(outer), strict=True):
        quads.append([(a, 0.0, high_a), (c, -thickness, high_a), (d, -thickness, high_b), (b, 0.0, high_b)])
    quads.append([(length, 0.0, low), (last, -thickness, low), (first, -thickness, low), (0.0, 0.0, low)])
    way = float(np.linalg.norm(np.diff(polygon[: index + 1], axis=0), axis=1).sum())
    return _in_world(np.asarray(quads, np.float64), start, along, inward, _wall_uvs(np.asarray(quads, np.float64), way))


def _wall_uvs(quads: Array, way_m: float) -> Array:
    """Return texture coordinates of a wall's quads: way round the room (the wall starts at ``way_m``) x height, reveals by depth."""
    normals = np.abs(np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]))
    across = np.argmax(normals[:, [1, 0, 2]], axis=1)[:, None]
    along, depth, height = quads[..., 0] + way_m, quads[..., 1], quads[..., 2]
    return np.stack([np.where(across == 1, depth + way_m, along), np.where(across == 2, depth, height)], axis=2)


def _cells(top: Profile, low: float, holes: list[Rectangle], levels: list[float]) -> list[tuple[float, float, float, float, float]]:
    """Cut the face between ``low`` and its upper edge along all edges of the holes; return the cells that lie in none of them.

    A cell has its ends along the wall, its height below, and its heights above at both ends.  The face is also cut at ``levels``, so that
    neighbouring walls share all vertices of their corner.
    """
    (first, _), (last, _) = top[0], top[-1]
    us = sorted({*(u for u, _ in top), *(min(max(u, first), last) for hole in holes for u in hole[:2])})
    vs = {low, *(max(v, low) for hole in holes for v in hole[2:]), *levels}
    places, heights = zip(*top, strict=True)
    high = np.interp(us, places, heights).tolist()
    cells = []
    for (a, b), (high_a, high_b) in zip(itertools.pairwise(us), itertools.pairwise(high), strict=True):
        rows = sorted(v for v in vs if v < min(high_a, high_b))
        ends = [*((v, v) for v in rows[1:]), (high_a, high_b)]
        cells += [(a, b, c, d, e) for c, (d, e) in zip(rows, ends, strict=True)]
    return [cell for cell in cells if not any(_within(cell[:4], hole) for hole in holes)]


def _within(cell: Rectangle, hole: Rectangle) -> bool:
    u, v = 0.5 * (cell[0] + cell[1]), 0.5 * (cell[2] + cell[3])
    return hole[0] < u < hole[1] and hole[2] < v < hole[3]


def _in_world(quads: Array, start: Array, along: Array, inward: Array, uvs: Array | None = None) -> Mesh:
    """Return quads (n, 4, 3) of (along the wall, inward, z), counter-clockwise from outside, as a mesh in the world."""
    return flat_quads(np.concatenate([start + quads[..., :1] * along + quads[..., 1:2] * inward, quads[..., 2:]], axis=-1), uvs)


def _skirting(room: Room, polygon: Array, index: int) -> list[Mesh]:
    """Return the skirting boards of one wall: mitred at corners, cut square at doors."""
    start, along, inward, length = wall_frame(polygon, index)
    height, depth = min(SKIRTING_HEIGHT_M, 0.2 * room.height_m), SKIRTING_DEPTH_M
    doors = sorted(
        (o.offset_m - CASING_M, o.offset_m + o.width_m + CASING_M) for o in room.openings if o.wall == index and o.sill_m < height
    )
    runs, place = [], 0.0
    for a, b in doors:
        runs.append((place, a))
        place = max(place, b)
    runs.append((place, length))
    boards = []
    for a, b in runs:
        if b - a < 0.02:
            continue
        lean_a = _mitre(polygon, index, depth) if a == 0.0 else 0.0
        lean_b = _mitre(polygon, (index + 1) % len(polygon), depth) if b == length else 0.0
        if b - a - lean_a - lean_b < 0.005:
            continue
        section = [(-0.002, 0.0), (depth, 0.0), (depth, height - 0.006), (depth - 0.006, height), (-0.002, height)]
        ring_a = [(a + lean_a * n / depth, n, z) for n, z in section]
        ring_b = [(b - lean_b * n / depth, n, z) for n, z in section]
        count = len(section)
        quads = [[ring_b[k], ring_a[k], ring_a[(k + 1) % count], ring_b[(k + 1) % count]] for k in range(count)]
        ends = [[ring_a[0], ring_a[1], ring_a[2], ring_a[4]], [ring_a[2], ring_a[3], ring_a[4], ring_a[4]]]
        ends += [[ring_b[4], ring_b[2], ring_b[1], ring_b[0]], [ring_b[4], ring_b[4], ring_b[3], ring_b[2]]]
        boards.append(_in_world(np.asarray(quads + ends, np.float64), start, along, inward))
    return boards


def _mitre(polygon: Array, corner: int, depth: float) -> float:
    """Return how much shorter (or longer, below 0) a board of this depth is at its front edge at the corner."""
    before, after = polygon[corner] - polygon[corner - 1], polygon[(corner + 1) % len(polygon)] - polygon[corner]
    turn = math.atan2(float(_cross(before, after)), float(matmul(before, after)))
    return depth * math.tan(0.5 * max(min(turn, 2.8), -2.8))
