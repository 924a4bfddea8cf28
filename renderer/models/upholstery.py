"""What upholsterers and seamstresses add: piping along seams, deep buttoned panels, covered buttons, cloth with a finer upper side."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.core.arrays import Array
from renderer.geometry.mesh import Mesh
from renderer.geometry.shape_coordinates import grid_way
from renderer.geometry.shapes import grid_faces, lathe, make_mesh, merged, rotated, smooth_normals


def piping(loop: ArrayLike, radius_m: float, segments: int = 5) -> Mesh:
    """Return a closed cord along a loop of points (n, 3) that does not return to its first point; it lies in no one plane necessarily."""
    points = np.asarray(loop, np.float64)
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    up = np.cross(points - points.mean(axis=0), along).sum(axis=0)
    up /= np.linalg.norm(up)
    side = np.cross(along, up)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    lift = np.cross(side, along)
    angle = np.arange(segments + 1) * (2.0 * math.pi / segments)
    angle[-1] = 0.0
    outward = np.cos(angle)[None, :, None] * side[:, None] + np.sin(angle)[None, :, None] * lift[:, None]
    tube = points[:, None] + radius_m * outward
    tube, outward = np.concatenate([tube, tube[:1]]), np.concatenate([outward, outward[:1]])
    turn = np.arange(segments + 1) * (2.0 * math.pi / segments) * radius_m
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(np.vstack([points, points[:1]]), axis=0), axis=1))])
    uvs = np.stack(np.meshgrid(way, turn, indexing="ij"), axis=2).reshape(-1, 2)
    return make_mesh(tube.reshape(-1, 3), outward.reshape(-1, 3), grid_faces(len(tube), segments + 1), uvs)


def rounded_loop(half_u: float, half_v: float, radius_m: float, per_side: int = 4, per_corner: int = 3) -> Array:
    """Return points (n, 2) counter-clockwise along a rectangle of half sizes ``half_u`` and ``half_v`` with rounded corners."""
    radius = min(radius_m, 0.95 * half_u, 0.95 * half_v)
    rows: list[Array] = []
    corners = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    for k, (su, sv) in enumerate(corners):
        angle = 0.5 * math.pi * (k + np.linspace(0.0, 1.0, per_corner + 1))
        center = np.array([su * (half_u - radius), sv * (half_v - radius)])
        arc = center + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        tu, tv = corners[(k + 1) % 4]
        start = np.array([tu * (half_u - radius), tv * (half_v - radius)]) + radius * np.array([math.cos(angle[-1]), math.sin(angle[-1])])
        share = np.linspace(0.0, 1.0, per_side + 1)[1:-1, None]
        rows += [arc, arc[-1] * (1.0 - share) + start * share]
    return np.concatenate(rows)


def lined(top: Array, bottom: Array, crossed: NDArray[np.bool_] | None = None) -> Mesh:
    """Return the closed body between two vertex grids (n, m, 3), n and m odd, of whose lower one only every second row and column is used.

    Rows x columns points outward on ``top``; the quadrilaterals (n - 1, m - 1) that are ``crossed`` are cut along their other diagonal, for
    creases that run that way.  Texture coordinates are the way along the cloth: u from column to column, v from row to row.
    """
    rows, columns = top.shape[:2]
    coarse = bottom[::2, ::2]
    count = rows * columns
    fine = np.arange(count).reshape(rows, columns)
    under = count + np.arange(coarse.shape[0] * coarse.shape[1]).reshape(coarse.shape[:2])
    rim = np.concatenate([fine[:-1, 0], fine[-1, :-1], fine[1:, -1][::-1], fine[0, 1:][::-1]])
    seam = np.concatenate([under[:-1, 0], under[-1, :-1], under[1:, -1][::-1], under[0, 1:][::-1]])
    a, m, b, c, d = rim[::2], rim[1::2], np.roll(rim, -2)[::2], seam, np.roll(seam, -1)
    sides = np.concatenate([np.stack(corner, 1) for corner in ((a, c, m), (m, c, d), (m, d, b))])
    upper = grid_faces(rows, columns)
    if crossed is not None:
        first, second = upper[: len(upper) // 2], upper[len(upper) // 2 :]
        turned = crossed.reshape(-1, 1)
        corners = (first[:, [0, 1]], second[:, [2]]), (first[:, [1, 2]], second[:, [2]])
        upper = np.concatenate([np.where(turned, np.hstack(pair), old) for pair, old in zip(corners, (first, second), strict=True)])
    every = np.concatenate([upper, grid_faces(*coarse.shape[:2])[:, ::-1] + count, sides])
    vertices = np.concatenate([top.reshape(-1, 3), coarse.reshape(-1, 3)])
    across, along = (grid_way(top, axis) for axis in (1, 0))
    uvs = np.stack(np.broadcast_arrays(across[None, :], along[:, None]), axis=2)
    return make_mesh(vertices, smooth_normals(vertices, every), every, np.concatenate([uvs.reshape(-1, 2), uvs[::2, ::2].reshape(-1, 2)]))


def buttons(centers: ArrayLike, radius_m: float, height_m: float) -> Mesh:
    """Return covered buttons whose middles lie at the centers (n, 3) and which look along +x."""
    r, h = radius_m, height_m
    dome = rotated(lathe([(0.0, -h), (r, -0.4 * h), (r, 0.2 * h), (0.6 * r, 0.8 * h), (0.0, h)], 8), "y", 0.5 * math.pi)
    return repeated(dome, centers)


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


def tufted(y: tuple[float, float], z: tuple[float, float], x: tuple[float, float], pitch: tuple[float, float], rim_m: float = 0.03) -> Mesh:
    """Return a deep buttoned panel that looks along +x: its back at ``x[0]``, its swellings reach ``x[1]``.

    Args:
        y: its extent sideways.
        z: its extent upward.
        x: back, and furthest front.
        pitch: distance of buttons along y and z; those of every second row are shifted by half of it.
        rim_m: how far from its outline the stuffing starts to fall off.
    """
    deep = x[1] - x[0]
    width, height = y[1] - y[0], z[1] - z[0]
    across, up = max(1, round(width / pitch[0])), max(1, round(height / pitch[1]))
    columns, rows = 6 * across + 1, 6 * up + 1
    yy, zz = np.meshgrid(np.linspace(y[0], y[1], columns), np.linspace(z[0], z[1], rows), indexing="ij")
    u, v = across * (yy - y[0]) / width, up * (zz - z[0]) / height
    p, q = np.abs(np.sin(0.5 * math.pi * (u + v))), np.abs(np.sin(0.5 * math.pi * (u - v)))
    puff = (p * q) ** 0.55
    pit = np.exp(-((p**2 + q**2) / 0.22))
    border = np.minimum(np.minimum(yy - y[0], y[1] - yy), np.minimum(zz - z[0], z[1] - zz)) / rim_m
    round_off = np.sqrt(np.clip(border, 0.0, 1.0) * (2.0 - np.clip(border, 0.0, 1.0)))
    front = x[0] + deep * (0.2 + round_off * (0.3 + 0.5 * puff - 0.2 * pit))
    crossed = (np.floor(0.5 * (u[1:, 1:] + u[:-1, :-1])) + np.floor(0.5 * (v[1:, 1:] + v[:-1, :-1]))) % 2 == 1
    body = lined(np.dstack([front, yy, zz]), np.dstack([np.full_like(front, x[0]), yy, zz]), crossed)
    spots: list[tuple[float, float]] = [(i, k) for i in range(1, across) for k in range(1, up) if (i + k) % 2 == 0]
    spots = spots or [(0.5 * across, 0.5 * up)]
    size = min(0.012, 0.09 * min(pitch))
    depth = x[0] + deep * (0.45 if across > 1 and up > 1 else 0.75)
    places = [(depth, y[0] + width * i / across, z[0] + height * k / up) for i, k in spots]
    return merged(body, buttons(places, size, 0.4 * size))
