"""Mesh building blocks: bevelled blocks, rounded boxes, turned (lathe) and swept bodies, closed sheets.

Every shape is closed, its faces are counter-clockwise from outside, its normals point outward and are smooth where the surface is round.
Texture coordinates are metres along the surface, u along the longest way (the grain of a board, the length of a rod).  Lengths are metres.
"""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.coordinates import SCATTER, block_uvs, grid_way, lathe_uvs, quad_uvs
from renderer.geometry.mesh import UNMAPPED, Mesh, doubled_areas, surface_area
from scene_description.products import dot, matmul

BEVEL_M = 0.003
CREASE_COSINE = math.cos(math.radians(38.0))


class RoundedTemplate(NamedTuple):
    """Topology of a rounded box: ``inner`` (n, 3) in [-1, 1] on the inner box, ``direction`` (n, 3) unit, ``faces`` (m, 3).

    Texture coordinates need vertices apart where two sides meet: vertex k of the ``apart_faces`` is vertex ``welded[k]`` of the others and
    belongs to the side across axis ``side[k]``.
    """

    inner: Array
    direction: Array
    faces: NDArray[np.uint32]
    welded: NDArray[np.intp]
    side: NDArray[np.intp]
    apart_faces: NDArray[np.uint32]


def make_mesh(vertices: ArrayLike, normals: ArrayLike, faces: ArrayLike, uvs: ArrayLike | None = None) -> Mesh:
    """Return a Mesh with the contract's dtypes, unit normals, and without faces that have no area."""
    points = np.asarray(vertices, np.float64)
    index = np.asarray(faces, np.int64)
    doubled = doubled_areas(points, index)
    index = index[dot(doubled, doubled) > 1e-20]
    directions = np.asarray(normals, np.float64)
    length = np.sqrt(dot(directions, directions))[:, None]
    unit = directions / np.maximum(length, 1e-12)
    unit[length[:, 0] <= 1e-12] = (0.0, 0.0, 1.0)
    coordinates = UNMAPPED if uvs is None else np.asarray(uvs, np.float32)
    return Mesh(points.astype(np.float32), unit.astype(np.float32), index.astype(np.uint32), coordinates)


def flat_quads(corners: ArrayLike, uvs: ArrayLike | None = None) -> Mesh:
    """Return separate flat quadrilaterals (n, 4, 3), each counter-clockwise from outside, with their own normals.

    Without ``uvs`` (n, 4, 2) the pattern of each runs along its longer side.
    """
    points = np.asarray(corners, np.float64)
    normals = np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1])
    first = 4 * np.arange(len(points))[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    coordinates = quad_uvs(points, normals) if uvs is None else np.asarray(uvs, np.float64)
    return make_mesh(points.reshape(-1, 3), np.repeat(normals, 4, axis=0), faces, coordinates.reshape(-1, 2))


def merged(*meshes: Mesh) -> Mesh:
    """Return all meshes as one."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.faces + np.uint32(offset) for mesh, offset in zip(meshes, offsets, strict=True)]),
        UNMAPPED if not any(len(mesh.uvs) for mesh in meshes) else np.concatenate([_uv_rows(mesh) for mesh in meshes]),
    )


def _uv_rows(mesh: Mesh) -> NDArray[np.float32]:
    """Return one row of texture coordinates per vertex, NaN where the mesh has none."""
    return mesh.uvs if len(mesh.uvs) else np.full((len(mesh.vertices), 2), np.nan, np.float32)


def moved(mesh: Mesh, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Mesh:
    """Return the mesh shifted by (x, y, z)."""
    return mesh._replace(vertices=mesh.vertices + np.array([x, y, z], np.float32))


def repeated(mesh: Mesh, places: ArrayLike) -> Mesh:
    """Return copies of a mesh, shifted to each of the places (n, 3)."""
    shifts = np.asarray(places, np.float32).reshape(-1, 1, 3)
    count = len(shifts)
    offsets = np.arange(count, dtype=np.uint32)[:, None, None] * np.uint32(len(mesh.vertices))
    return Mesh(
        (mesh.vertices[None] + shifts).reshape(-1, 3),
        np.tile(mesh.normals, (count, 1)),
        (mesh.faces[None] + offsets).reshape(-1, 3),
        np.tile(mesh.uvs, (count, 1)),
    )


def rotated(mesh: Mesh, axis: str, angle_rad: float, about: Sequence[float] = (0.0, 0.0, 0.0)) -> Mesh:
    """Return the mesh turned counter-clockwise about a line parallel to ``axis`` ("x", "y" or "z") through ``about``."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix = np.eye(3)
    matrix[j, j] = matrix[k, k] = math.cos(angle_rad)
    matrix[k, j] = math.sin(angle_rad)
    matrix[j, k] = -matrix[k, j]
    center = np.asarray(about, np.float64)
    points = matmul(mesh.vertices - center, matrix.T) + center
    return mesh._replace(vertices=points.astype(np.float32), normals=matmul(mesh.normals, matrix.T).astype(np.float32))


def mirrored(mesh: Mesh, axis: str) -> Mesh:
    """Return the mesh reflected in the plane through the origin whose normal is ``axis``."""
    sign = np.ones(3, np.float32)
    sign["xyz".index(axis)] = -1.0
    return Mesh(mesh.vertices * sign, mesh.normals * sign, np.ascontiguousarray(mesh.faces[:, ::-1]), mesh.uvs)


def stretched(mesh: Mesh, scale: ArrayLike, shift: ArrayLike) -> Mesh:
    """Return the mesh with vertices ``scale * vertex + shift`` (positive scales, (3,) each); its pattern keeps its size on the average."""
    factor = np.asarray(scale, np.float64)
    normals = mesh.normals / factor
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    result = mesh._replace(
        vertices=(mesh.vertices * factor + np.asarray(shift, np.float64)).astype(np.float32), normals=normals.astype(np.float32)
    )
    if len(mesh.uvs) and np.abs(el.log(factor)).max() > 0.02:
        growth = math.sqrt(surface_area(result) / max(surface_area(mesh), 1e-12))
        result = result._replace(uvs=(mesh.uvs * growth).astype(np.float32))
    return result


def smooth_normals(vertices: Array, faces: NDArray[np.integer]) -> Array:
    """Return area-weighted vertex normals (n, 3) of an indexed mesh."""
    weighted = doubled_areas(vertices, faces)
    index = np.asarray(faces).ravel()
    sums = [np.bincount(index, np.repeat(weighted[:, k], 3), len(vertices)) for k in range(3)]
    return np.stack(sums, axis=1)


@lru_cache(maxsize=1)
def _block_template() -> tuple[Array, NDArray[np.intp], NDArray[np.int64]]:
    """Signs (24, 3) and side axis (24,) of a bevelled block's vertices, and its 44 faces."""
    signs = list(product((-1.0, 1.0), repeat=3))
    vertex = {(sign, axis): 3 * i + axis for i, sign in enumerate(signs) for axis in range(3)}

    def at(axis: int, a: float, b: float, c: float) -> tuple[float, float, float]:
        values = [0.0, 0.0, 0.0]
        values[axis], values[(axis + 1) % 3], values[(axis + 2) % 3] = a, b, c
        return (values[0], values[1], values[2])

    loops: list[list[int]] = [[vertex[sign, axis] for axis in range(3)] for sign in signs]
    for axis, a in product(range(3), (-1.0, 1.0)):
        loops.append([vertex[at(axis, a, b, c), axis] for b, c in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        for b in (-1.0, 1.0):
            other = (axis + 1) % 3
            low, high = at(axis, a, b, -1.0), at(axis, a, b, 1.0)
            loops.append([vertex[low, axis], vertex[high, axis], vertex[high, other], vertex[low, other]])
    sign_rows = np.repeat(np.array(signs), 3, axis=0)
    axes = np.tile(np.arange(3), 8)
    points = sign_rows * np.where(np.arange(3) == axes[:, None], 1.0, 0.8)
    faces = []
    for loop in loops:
        for i in range(1, len(loop) - 1):
            face = [loop[0], loop[i], loop[i + 1]]
            a_m, b_m, c_m = points[face]
            outward = float(matmul(np.cross(b_m - a_m, c_m - a_m), a_m + b_m + c_m)) > 0.0
            faces.append(face if outward else face[::-1])
    return sign_rows, axes, np.array(faces)


def blocks(low: ArrayLike, high: ArrayLike, bevel_m: float | Array = BEVEL_M) -> Mesh:
    """Return axis-aligned boxes with bevelled edges that shade as if rounded, 44 triangles each.

    ``low`` and ``high`` are (k, 3) opposite corners; ``bevel_m`` is one width or (k,), cut to 0.3 of the thinnest side.
    """
    a, b = np.atleast_2d(np.asarray(low, np.float64)), np.atleast_2d(np.asarray(high, np.float64))
    signs, axes, faces = _block_template()
    half = 0.5 * np.abs(b - a)
    bevel = np.minimum(np.broadcast_to(bevel_m, len(a)), 0.6 * half.min(axis=1))
    on_face = np.arange(3) == axes[:, None]
    reach = half[:, None, :] - np.where(on_face, 0.0, bevel[:, None, None])
    points = 0.5 * (a + b)[:, None, :] + signs * reach
    index = faces[None] + 24 * np.arange(len(a))[:, None, None]
    normals = np.broadcast_to(np.where(on_face, signs, 0.0), points.shape)
    return make_mesh(
        points.reshape(-1, 3), normals.reshape(-1, 3), index.reshape(-1, 3), block_uvs(points, half, 0.5 * (a + b), signs, axes)
    )


def block(low: Sequence[float], high: Sequence[float], bevel_m: float = BEVEL_M) -> Mesh:
    """Return one bevelled box between two opposite corners."""
    return blocks([low], [high], bevel_m)


@lru_cache(maxsize=64)
def rounded_template(segments: int, flats: tuple[int, int, int]) -> RoundedTemplate:
    """Return the welded topology of a rounded box: ``segments`` per 45 degrees of an edge, ``flats`` divisions of the sides per axis."""

    def line(flat: int) -> tuple[Array, Array]:
        bend = np.linspace(-0.25 * math.pi, 0.0, segments + 1)
        inner = np.concatenate([-np.ones(segments), np.linspace(-1.0, 1.0, flat + 1), np.ones(segments)])
        return inner, el.tan(np.concatenate([bend[:-1], np.zeros(flat + 1), -bend[:-1][::-1]]))

    lines = [line(flat) for flat in flats]
    inner_rows, direction_rows, face_rows, side_rows, base = [], [], [], [], 0
    for axis, sign in product(range(3), (-1.0, 1.0)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        iu, iv = np.meshgrid(np.arange(len(lines[u][0])), np.arange(len(lines[v][0])), indexing="ij")
        inner, direction = np.empty((iu.size, 3)), np.empty((iu.size, 3))
        inner[:, axis], inner[:, u], inner[:, v] = sign, lines[u][0][iu.ravel()], lines[v][0][iv.ravel()]
        direction[:, axis], direction[:, u], direction[:, v] = sign, lines[u][1][iu.ravel()], lines[v][1][iv.ravel()]
        faces = grid_faces(*iu.shape) + base
        inner_rows.append(inner)
        direction_rows.append(direction / np.linalg.norm(direction, axis=1, keepdims=True))
        face_rows.append(faces if sign > 0 else faces[:, ::-1])
        side_rows.append(np.full(iu.size, axis))
        base += iu.size
    key = np.round(np.hstack([np.concatenate(inner_rows), np.concatenate(direction_rows)]), 9) + 0.0
    unique, weld = np.unique(key, axis=0, return_inverse=True)
    direction = unique[:, 3:] / np.linalg.norm(unique[:, 3:], axis=1, keepdims=True)
    weld, apart = weld.reshape(-1), np.concatenate(face_rows)
    return RoundedTemplate(
        unique[:, :3], direction, weld[apart].astype(np.uint32), weld, np.concatenate(side_rows), apart.astype(np.uint32)
    )


def rounded_uvs(template: RoundedTemplate, half: Array, radius_m: float) -> Array:
    """Return texture coordinates of the apart vertices: lengths along each side and round its edges, u along the longer way."""
    angle = el.arctan2(template.direction[:, None, :], np.abs(template.direction[:, :, None]))
    flat = template.inner * (half - radius_m)
    coordinates = np.empty((len(template.welded), 2))
    for axis in range(3):
        mine = template.side == axis
        along, across = sorted(((axis + 1) % 3, (axis + 2) % 3), key=lambda k: -half[k])
        rows = template.welded[mine]
        for column, k in enumerate((along, across)):
            coordinates[mine, column] = flat[rows, k] + radius_m * angle[rows, axis, k]
    return coordinates


def rounded_box(low: Sequence[float], high: Sequence[float], radius_m: float, segments: int = 2) -> Mesh:
    """Return a box whose edges and corners are rounded with ``radius_m`` (cut to 0.49 of the thinnest side)."""
    template = rounded_template(segments, (1, 1, 1))
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    half = 0.5 * np.abs(b - a)
    radius = min(radius_m, 0.98 * float(half.min()))
    center = 0.5 * (a + b)
    points = center + template.inner * (half - radius) + radius * template.direction
    uvs = rounded_uvs(template, half, radius) + matmul(SCATTER, center)
    return make_mesh(points[template.welded], template.direction[template.welded], template.apart_faces, uvs)


def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Return the triangles of a (rows, columns) vertex grid, counter-clockwise where rows x columns is the outward direction."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    b, c, d = a + columns, a + columns + 1, a + 1
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def lathe(profile: ArrayLike, segments: int = 28, closed: bool = False, wave: Callable[[Array], Array] | None = None) -> Mesh:
    """Return a body turned about the z axis.

    Args:
        profile: points (n, 2) of radius and z; the outside lies to the right of the way from point to point, so a solid runs from the
            bottom of the axis outward and up to the top of the axis.  Corners sharper than 38 degrees stay sharp.
        segments: divisions of the full turn.
        closed: join the last point to the first (rings, hollow shades) instead of leaving the ends at the axis.
        wave: angle (n,) -> factor (n,) on the radius, for pleats.
    """
    points = np.asarray(profile, np.float64)
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    starts = points if closed else points[:-1]
    along = ends - starts
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    before, after = np.roll(normal, 1, axis=0), np.roll(normal, -1, axis=0)
    if not closed:
        before[0], after[-1] = normal[0], normal[-1]
    smooth_start = dot(before, normal) > CREASE_COSINE
    smooth_end = dot(after, normal) > CREASE_COSINE
    n0 = np.where(smooth_start[:, None], before + normal, normal)
    n1 = np.where(smooth_end[:, None], after + normal, normal)
    angle = np.arange(segments + 1) * (2.0 * math.pi / segments)
    angle[-1] = 0.0
    factor: Array = np.ones(segments + 1) if wave is None else wave(angle.astype(np.float64))
    bands = []
    for ring, tilt in ((starts, n0), (ends, n1)):
        radius = ring[:, :1] * factor
        height = np.broadcast_to(ring[:, 1:], radius.shape)
        turned = np.stack([radius * el.cos(angle), radius * el.sin(angle), height], axis=2)
        tilted = np.stack([tilt[:, :1] * el.cos(angle), tilt[:, :1] * el.sin(angle), np.broadcast_to(tilt[:, 1:], radius.shape)], axis=2)
        bands.append((turned, tilted))
    vertices = np.stack([bands[0][0], bands[1][0]], axis=1)
    normals = np.stack([bands[0][1], bands[1][1]], axis=1)
    faces = grid_faces(2, segments + 1)[:, ::-1]
    index = faces[None] + (2 * (segments + 1) * np.arange(len(starts)))[:, None, None]
    joined = smooth_start if closed else np.concatenate([[False], smooth_start[1:]])
    mesh = make_mesh(vertices.reshape(-1, 3), normals.reshape(-1, 3), index.reshape(-1, 3), lathe_uvs(starts, ends, joined, segments))
    return mesh if wave is None else _reshaded(mesh)


def _reshaded(mesh: Mesh) -> Mesh:
    """Replace the normals by smooth ones, welding vertices that share position and old normal."""
    key = np.round(np.hstack([mesh.vertices, mesh.normals]), 5) + 0.0
    unique, weld = np.unique(key, axis=0, return_inverse=True)
    points = unique[:, :3].astype(np.float64)
    normals = smooth_normals(points, weld.reshape(-1)[mesh.faces])
    return make_mesh(mesh.vertices, normals[weld.reshape(-1)], mesh.faces, mesh.uvs)


def sweep(path: ArrayLike, radius: float | Sequence[float] | Array, segments: int = 10, squash: float = 1.0) -> Mesh:
    """Return a tube with flat caps along ``path`` (n, 3); ``radius`` is one or one per point, ``squash`` scales its second axis."""
    points = np.asarray(path, np.float64)
    radii = np.broadcast_to(np.asarray(radius, np.float64), len(points))
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent[0], (0.0, 0.0, 1.0) if abs(tangent[0, 2]) < 0.9 else (1.0, 0.0, 0.0))
    sides = np.empty_like(points)
    for i, direction in enumerate(tangent):
        side = side - direction * matmul(side, direction)
        side = side / math.sqrt(matmul(side, side))
        sides[i] = side
    ups = np.cross(tangent, sides)
    angle = np.arange(segments + 1) * (2.0 * math.pi / segments)
    angle[-1] = 0.0
    ring = el.cos(angle)[None, :, None] * sides[:, None] + squash * el.sin(angle)[None, :, None] * ups[:, None]
    outward = el.cos(angle)[None, :, None] * sides[:, None] + el.sin(angle)[None, :, None] / squash * ups[:, None]
    vertices = points[:, None] + radii[:, None, None] * ring
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    turn = np.arange(segments + 1) * (2.0 * math.pi / segments) * 0.5 * (1.0 + squash) * float(radii.mean())
    shift = matmul(SCATTER, points[0])
    uvs = np.stack(np.meshgrid(way, turn, indexing="ij"), axis=2).reshape(-1, 2) + shift
    tube = make_mesh(vertices.reshape(-1, 3), outward.reshape(-1, 3), grid_faces(len(points), segments + 1)[:, ::-1], uvs)
    caps = []
    for end, normal in ((0, -tangent[0]), (-1, tangent[-1])):
        fan = np.stack([np.full(segments, segments), np.arange(segments), (np.arange(segments) + 1) % segments], axis=1)
        loop = np.vstack([vertices[end, :segments], points[end]])
        flat = np.stack([matmul(loop - points[end], sides[end]), matmul(loop - points[end], ups[end])], axis=1) + shift
        caps.append(make_mesh(loop, np.broadcast_to(normal, loop.shape), fan if end else fan[:, ::-1], flat))
    return merged(tube, *caps)


def rod(start: Sequence[float], end: Sequence[float], radius: float, end_radius: float | None = None, segments: int = 12) -> Mesh:
    """Return a round bar, or a tapered leg, between two points."""
    return sweep([start, end], [radius, radius if end_radius is None else end_radius], segments)


def membrane(grid: Array) -> Mesh:
    """Return the surface over a vertex grid (n, m, 3), without thickness: cloth that lets light through has one surface.

    Its front and its texture coordinates are those of ``top`` of a :func:`sheet`.
    """
    vertices, faces = grid.reshape(-1, 3), grid_faces(*grid.shape[:2])
    across, along = (grid_way(grid, axis) for axis in (1, 0))
    uvs = np.stack(np.broadcast_arrays(across[None, :], along[:, None]), axis=2).reshape(-1, 2)
    return make_mesh(vertices, smooth_normals(vertices, faces), faces, uvs)


def sheet(top: Array, bottom: Array) -> Mesh:
    """Return the closed body between two vertex grids (n, m, 3) whose rims are joined; rows x columns points outward on ``top``.

    Texture coordinates are the way along the cloth: u from column to column, v from row to row, the same on both sides.
    """
    rows, columns = top.shape[:2]
    count = rows * columns
    faces = grid_faces(rows, columns)
    index = np.arange(count).reshape(rows, columns)
    loop = np.concatenate([index[:-1, 0], index[-1, :-1], index[1:, -1][::-1], index[0, 1:][::-1]])
    following = np.roll(loop, -1)
    rim = np.concatenate([np.stack([loop, loop + count, following + count], 1), np.stack([loop, following + count, following], 1)])
    every = np.concatenate([faces, faces[:, ::-1] + count, rim])
    vertices = np.concatenate([top.reshape(-1, 3), bottom.reshape(-1, 3)])
    across, along = (grid_way(top, axis) for axis in (1, 0))
    uvs = np.stack(np.broadcast_arrays(across[None, :], along[:, None]), axis=2).reshape(-1, 2)
    return make_mesh(vertices, smooth_normals(vertices, every), every, np.concatenate([uvs, uvs]))


def slab(outline: ArrayLike, low_m: float, high_m: float) -> Mesh:
    """Return the upright prism over a star-shaped outline (n, 2), counter-clockwise, seen from its centroid, with sharp edges."""
    points = np.asarray(outline, np.float64)
    count = len(points)
    following = np.roll(np.arange(count), -1)
    at_low, at_high = np.column_stack([points, np.full(count, low_m)]), np.column_stack([points, np.full(count, high_m)])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(points[following] - points, axis=1))])
    wound = [[(way[k], low_m), (way[k + 1], low_m), (way[k + 1], high_m), (way[k], high_m)] for k in range(count)]
    body = flat_quads(np.stack([at_low, at_low[following], at_high[following], at_high], axis=1), wound)
    fan = np.stack([np.full(count, count), np.arange(count), following], axis=1)
    center = points.mean(axis=0)
    cap = np.vstack([at_high, [*center, high_m]])
    floor = np.vstack([at_low, [*center, low_m]])
    up = np.broadcast_to((0.0, 0.0, 1.0), cap.shape)
    flat = cap[:, :2] if np.ptp(points[:, 0]) >= np.ptp(points[:, 1]) else cap[:, 1::-1]
    return merged(body, make_mesh(cap, up, fan, flat), make_mesh(floor, -up, fan[:, ::-1], flat))
