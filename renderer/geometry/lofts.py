"""Bodies through a stack of outlines (basins, bowls, tubs), and other turned or bent pieces that several models share."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import CREASE_COSINE, lathe, make_mesh, merged, moved, rotated, sweep
from scene_description.products import dot, norm

Point = Sequence[float]


def points(*coordinates: ArrayLike) -> Array:
    """Return points (n, k) from their coordinates, say a profile's radii and heights or a path's x, y, z.

    Each is a row (n,), several columns (n, m), or one number for all points.
    """
    columns = [np.asarray(values, np.float64) for values in coordinates]
    count = max(len(column) for column in columns if column.ndim)
    return np.column_stack([column if column.ndim else np.full(count, column) for column in columns])


def oval(half_x: float, half_y: float, z: float, x: float = 0.0, power: float = 2.0, points: int = 36, y: float = 0.0) -> Array:
    """Return a superellipse (points, 3) at height z round (x, y), counter-clockwise from above; power 2 is an ellipse, 8 nearly a box."""
    angle = (np.arange(points) + 0.5) * (2.0 * math.pi / points)
    cosine, sine = el.cos(angle), el.sin(angle)
    x_row = x + half_x * np.sign(cosine) * el.power(np.abs(cosine), 2.0 / power)
    y_row = y + half_y * np.sign(sine) * el.power(np.abs(sine), 2.0 / power)
    return np.column_stack([x_row, y_row, np.full(points, z)])


def egg(back: float, front: float, half_y: float, z: float, points: int = 36) -> Array:
    """Return an outline (points, 3) from x = back, broad and blunt there, to x = front, where it is elliptic."""
    ring = oval(1.0, half_y, z, points=points)
    middle = back + 0.42 * (front - back)
    blunt = oval(1.0, half_y, z, power=3.2, points=points)
    x, y = np.where(ring[:, 0] > 0.0, ring[:, :2].T, blunt[:, :2].T)
    return np.column_stack([middle + np.where(x > 0.0, x * (front - middle), x * (middle - back)), y, ring[:, 2]])


def loft(rings: Sequence[ArrayLike]) -> Mesh:
    """Return the closed body through outlines (n, 3) of equal length, with flat ends.

    The outlines run counter-clockwise round the way from the first to the last, as a lathe's profile does: a solid from its bottom up, a
    basin further over its rim and down inside.  Bends sharper than 38 degrees stay sharp.
    """
    points = np.asarray(rings, np.float64)
    rows, columns = len(points) - 1, points.shape[1]
    looped = np.concatenate([points, points[:, :1]], axis=1)
    corners = np.stack([looped[:-1, :-1], looped[:-1, 1:], looped[1:, 1:], looped[1:, :-1]], axis=2)
    flat = np.cross(corners[:, :, 2] - corners[:, :, 0], corners[:, :, 3] - corners[:, :, 1])
    flat /= np.maximum(np.linalg.norm(flat, axis=2, keepdims=True), 1e-15)
    normals = np.repeat(flat[:, :, None], 4, axis=2)
    for corner, (row, column) in enumerate(((-1, -1), (-1, 1), (1, 1), (1, -1))):
        for step in ((0, column), (row, 0), (row, column)):
            beside = np.roll(flat, (-step[0], -step[1]), axis=(0, 1))
            together = dot(flat, beside) > CREASE_COSINE
            if step[0]:
                together[0 if row < 0 else -1] = False
            normals[:, :, corner] += np.where(together[..., None], beside, 0.0)
    first = 4 * np.arange(rows * columns)[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    body = make_mesh(corners.reshape(-1, 3), normals.reshape(-1, 3), faces)
    return merged(body, _cap(points[0], True), _cap(points[-1], False))


def _cap(ring: Array, first: bool) -> Mesh:
    """Return the flat end over an outline, looking against the way where it is the first."""
    count = len(ring)
    fan = np.stack([np.full(count, count), np.arange(count), np.roll(np.arange(count), -1)], axis=1)
    following = np.roll(ring, -1, axis=0)
    center = ring.mean(axis=0)
    normal = np.cross(ring - center, following - center).sum(axis=0)
    vertices = np.vstack([ring, center])
    normals = np.broadcast_to(-normal if first else normal, vertices.shape)
    return make_mesh(vertices, normals, fan[:, ::-1] if first else fan)


def arc(center: Point, radius: float, start_rad: float, end_rad: float, plane: str = "xz", points: int = 9) -> Array:
    """Return points (n, 3) of a circular arc in the plane "xy", "xz" or "yz", counted from its first axis towards the second."""
    angle = np.linspace(start_rad, end_rad, points)
    path = np.tile(np.asarray(center, np.float64), (points, 1))
    path[:, "xyz".index(plane[0])] += radius * el.cos(angle)
    path[:, "xyz".index(plane[1])] += radius * el.sin(angle)
    return path


def bent(path: ArrayLike, radius: float, bend: float, segments: int = 10, steps: int = 4) -> Mesh:
    """Return a tube along straight pieces whose corners are rounded (quadratic curves that start ``bend`` before each corner)."""
    corners = list(np.asarray(path, np.float64))
    line = [corners[0]]
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        reach = min(bend, 0.45 * float(norm(corner - before)), 0.45 * float(norm(after - corner)))
        a = corner + (before - corner) * (reach / norm(before - corner))
        b = corner + (after - corner) * (reach / norm(after - corner))
        for t in np.linspace(0.0, 1.0, steps + 1):
            line.append((1 - t) ** 2 * a + 2 * t * (1 - t) * corner + t**2 * b)
    return sweep(np.array([*line, corners[-1]]), radius, segments)


def lying(mesh: Mesh, axis: str, at: Point = (0.0, 0.0, 0.0)) -> Mesh:
    """Return a turned body with its axis laid along "x" or "y", moved to ``at``."""
    turned = rotated(mesh, "y", 0.5 * math.pi) if axis == "x" else rotated(mesh, "x", -0.5 * math.pi)
    return moved(turned, *(float(v) for v in at))


def disc(axis: str, at: Point, radius: float, thickness: float, segments: int = 24, edge: float = 0.0) -> Mesh:
    """Return a flat round body centred at ``at`` with its axis along "x", "y" or "z" and edges bevelled by ``edge``."""
    h = 0.5 * thickness
    e = min(edge, 0.4 * thickness, 0.4 * radius)
    rim = [(radius, -h), (radius, h)] if e <= 0.0 else [(radius - e, -h), (radius, -h + e), (radius, h - e), (radius - e, h)]
    mesh = lathe([(0.0, -h), *rim, (0.0, h)], segments)
    return moved(mesh, *(float(v) for v in at)) if axis == "z" else lying(mesh, axis, at)


def ring(axis: str, at: Point, radius: float, tube: float, segments: int = 32, sides: int = 8, squash: float = 1.0) -> Mesh:
    """Return a torus centred at ``at`` with its axis along "x", "y" or "z"; ``squash`` scales the tube along the axis."""
    angle = np.arange(sides) * (2.0 * math.pi / sides)
    profile = [(radius + tube * math.cos(a), squash * tube * math.sin(a)) for a in angle]
    mesh = lathe(profile, segments, closed=True)
    return moved(mesh, *(float(v) for v in at)) if axis == "z" else lying(mesh, axis, at)


def chain(points: Sequence[Point], radius: float, segments: int = 8) -> list[Mesh]:
    """Return straight bars from point to point."""
    return [sweep(pair, radius, segments) for pair in itertools.pairwise(np.asarray(points, np.float64))]
