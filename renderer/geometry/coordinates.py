"""Texture coordinates: of shapes as they are made, and box mapping for meshes that have none."""

import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.mesh import Mesh
from scene_description.products import dot, matmul

SCATTER = np.array([[3.71, 5.23, 2.89], [4.57, 1.93, 6.11]])
"""How far the pattern of a block is shifted (u, v) per metre that the block lies along x, y and z, so that boards differ."""


def quad_uvs(quads: Array, normals: Array) -> Array:
    """Return texture coordinates (n, 4, 2) of flat quadrilaterals in their planes, u along the longer of their first two sides."""
    sides = np.diff(quads[:, :3], axis=1)
    length = np.linalg.norm(sides, axis=2)
    along = np.where((length[:, 0] >= length[:, 1])[:, None], sides[:, 0], -sides[:, 1])
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    across = np.cross(normals, along) / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    shift = matmul(quads.mean(axis=1), SCATTER.T)
    local = quads - quads[:, :1]
    flat: Array = np.stack([dot(local, along[:, None]), dot(local, across[:, None])], axis=2)
    flat += shift[:, None]
    return flat


def block_uvs(points: Array, half: Array, center: Array, signs: Array, axes: NDArray[np.intp]) -> Array:
    """Return texture coordinates (k * 24, 2) of blocks (k, 24, 3): u along the longest side, v wound around it, ends flat.

    ``signs`` (24, 3) and ``axes`` (24,) are those of the block's vertices and of the sides that they belong to.  Sides follow each other
    across three of the four long edges; at the fourth, and at the ends, the pattern starts anew.
    """
    order = np.argsort(-half, axis=1, kind="stable")
    local = np.take_along_axis(points - center[:, None, :], order[:, None, :], axis=2)
    size = np.take_along_axis(half, order, axis=1)[:, None, :]
    rank = np.argmax(order[:, None, :] == axes[None, :, None], axis=2)
    sign = np.broadcast_to(signs[np.arange(24), axes], rank.shape)
    around = np.select(
        [(rank == 2) & (sign > 0), rank == 1, rank == 2],
        [local[..., 1], sign * (size[..., 1] + size[..., 2]) - sign * local[..., 2], 2.0 * (size[..., 1] + size[..., 2]) - local[..., 1]],
        0.0,
    )
    u = np.where(rank == 0, local[..., 1], local[..., 0])
    v = np.where(rank == 0, local[..., 2], around)
    flat: Array = np.stack([u, v], axis=2) + matmul(center, SCATTER.T)[:, None, :]
    return flat.reshape(-1, 2)


def lathe_uvs(starts: Array, ends: Array, joined: NDArray[np.bool_], segments: int) -> Array:
    """Return texture coordinates (bands * 2 * (segments + 1), 2) of a turned body; ``joined``: no crease before the band.

    Upright stretches between creases: way round at their mean radius x way along the profile.  Flat ones: seen from above.
    """
    length = np.hypot(*(ends - starts).T)
    stretch = np.cumsum(~joined) - (0 if joined[0] else 1)
    flat_length, upright_length, weight = (
        np.bincount(stretch, values) for values in (np.abs(ends - starts)[:, 0], np.abs(ends - starts)[:, 1], length)
    )
    radius = np.bincount(stretch, length * 0.5 * (starts + ends)[:, 0]) / np.maximum(weight, 1e-12)
    way = np.concatenate([[0.0], np.cumsum(length)])
    angle = np.arange(segments + 1) * (2.0 * math.pi / segments)
    rows = []
    for ring, place in ((starts, way[:-1]), (ends, way[1:])):
        wound = np.stack(np.broadcast_arrays(radius[stretch][:, None] * angle, place[:, None]), axis=2)
        above = ring[:, :1, None] * np.stack([el.cos(angle), el.sin(angle)], axis=1)
        rows.append(np.where((upright_length < 0.5 * flat_length)[stretch][:, None, None], above, wound))
    return np.stack(rows, axis=1).reshape(-1, 2)


def grid_way(grid: Array, axis: int) -> Array:
    """Return the mean way (n,) along one axis of a vertex grid, from 0."""
    steps = np.linalg.norm(np.diff(grid, axis=axis), axis=2).mean(axis=1 - axis)
    return np.concatenate([[0.0], np.cumsum(steps)])


def box_mapped(mesh: Mesh) -> Mesh:
    """Return the mesh with texture coordinates at every vertex; those that it has stay.

    Triangles with a vertex without any are projected along the axis of the mesh's own frame that their normal is nearest to, u along the
    longer of the two other sides of the mesh's bounding box; vertices are split where neighbours take different axes.
    """
    uvs = mesh.uvs if len(mesh.uvs) else np.full((len(mesh.vertices), 2), np.nan, np.float32)
    known = np.isfinite(uvs[:, 0]) & np.isfinite(uvs[:, 1])
    if known.all():
        return mesh
    lost = np.flatnonzero(~known[mesh.faces].all(axis=1))
    index = mesh.faces[lost].astype(np.int64)
    points = mesh.vertices.astype(np.float64)
    corners = points[index]
    axis = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).argmax(axis=1)
    extent = np.ptp(points, axis=0)
    planes = np.array([sorted(((k + 1) % 3, (k + 2) % 3), key=lambda j: -extent[j]) for k in range(3)])
    key, place = np.unique(3 * index + axis[:, None], return_inverse=True)
    source, plane = key // 3, planes[key % 3]
    projected = np.take_along_axis(points[source], plane, axis=1).astype(np.float32)
    split = Mesh(mesh.vertices[source], mesh.normals[source], place.reshape(-1, 3).astype(np.uint32), projected)
    if len(lost) == len(mesh.faces):
        return split
    faces = mesh.faces.copy()
    faces[lost] = split.faces + np.uint32(len(points))
    kept = np.where(known[:, None], uvs, np.float32(0.0))
    return Mesh(
        np.concatenate([mesh.vertices, split.vertices]),
        np.concatenate([mesh.normals, split.normals]),
        faces,
        np.concatenate([kept, projected]),
    )
