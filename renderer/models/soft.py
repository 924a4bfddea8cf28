"""Soft things and what upholsterers add: piping, buttoned panels, cushions that bulge, pillows, cloth, covers that fall over edges."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.coordinates import grid_way
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import (
    grid_faces,
    lathe,
    make_mesh,
    merged,
    rotated,
    rounded_template,
    rounded_uvs,
    sheet,
    smooth_normals,
    sweep,
)
from scene_description.products import norm


def piping(loop: ArrayLike, radius_m: float, segments: int = 5) -> Mesh:
    """Return a closed cord along a loop of points (n, 3) that does not return to its first point; it lies in no one plane necessarily."""
    points = np.asarray(loop, np.float64)
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    up = np.cross(points - points.mean(axis=0), along).sum(axis=0)
    up /= norm(up)
    side = np.cross(along, up)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    lift = np.cross(side, along)
    angle = np.arange(segments + 1) * (2.0 * math.pi / segments)
    angle[-1] = 0.0
    outward = el.cos(angle)[None, :, None] * side[:, None] + el.sin(angle)[None, :, None] * lift[:, None]
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
        arc = center + radius * np.column_stack([el.cos(angle), el.sin(angle)])
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
    p, q = np.abs(el.sin(0.5 * math.pi * (u + v))), np.abs(el.sin(0.5 * math.pi * (u - v)))
    puff = el.power(p * q, 0.55)
    pit = el.exp(-((p**2 + q**2) / 0.22))
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


class Drape(NamedTuple):
    """How a cover lies on a box: ``half_x``/``half_y`` and ``top`` of the box beneath, how far it hangs down at its sides and ends.

    ``fall_side``, ``fall_front`` and ``fall_back`` are lengths of cloth below the top edge in metres, 0 where it just ends; ``flare`` is
    how far its hem stands off the box.
    """

    half_x: float
    half_y: float
    top: float
    fall_side: float
    fall_front: float
    fall_back: float
    flare: float


class Cover(NamedTuple):
    """A draped cloth's upper surface: arc lengths ``s`` (n,) along x and ``t`` (m,) along y, points and unit normals (n, m, 3)."""

    s: Array
    t: Array
    points: Array
    normals: Array


def wrinkle_field(rng: np.random.Generator, waves: int, low: float, high: float) -> Callable[[Array, Array], Array]:
    """Return a function (u, v) -> smooth noise of about unit amplitude: plane waves with random direction, length and phase.

    ``low`` and ``high`` bound the spatial frequency in cycles per unit of u and v; longer waves are stronger.
    """
    frequency = rng.uniform(low, high, waves)
    direction = rng.uniform(0.0, math.pi, waves)
    phase = rng.uniform(0.0, 2.0 * math.pi, waves)

    def field(u: Array, v: Array) -> Array:
        total = np.zeros_like(u)
        for f, d, p in zip(frequency, direction, phase, strict=True):
            total += low / f * el.sin(2.0 * math.pi * f * (math.cos(d) * u + math.sin(d) * v) + p)
        return np.asarray(total / math.sqrt(waves * 0.25))

    return field


def wrinkles(rng: np.random.Generator, u: Array, v: Array, waves: int = 7, low: float = 1.5, high: float = 7.0) -> Array:
    """Return smooth noise over coordinates (u, v); see ``wrinkle_field``."""
    return wrinkle_field(rng, waves, low, high)(u, v)


def cushion(
    rng: np.random.Generator,
    low: Sequence[float],
    high: Sequence[float],
    radius_m: float,
    bulge_m: float,
    axis: int = 2,
    both_sides: bool = False,
    divisions: int = 6,
    piping_m: float = 0.0,
) -> Mesh:
    """Return a rounded, upholstered block between two corners, swollen by ``bulge_m`` along ``axis``; the swelling lies inside the corners.

    The lower side stays flat unless ``both_sides``; ``divisions`` is how finely the swollen side is cut.  ``piping_m`` is the radius of a
    cord along its seams, none where 0.
    """
    flats = tuple(1 if k == axis else divisions for k in range(3))
    template = rounded_template(2 if divisions > 4 else 1, (flats[0], flats[1], flats[2]))
    a, b = np.asarray(low, np.float64).copy(), np.asarray(high, np.float64).copy()
    b[axis] -= bulge_m
    if both_sides:
        a[axis] += bulge_m
    half = 0.5 * (b - a)
    radius = min(radius_m, 0.9 * float(half.min()))
    across = ((axis + 1) % 3, (axis + 2) % 3)
    crease = wrinkle_field(rng, 5, 0.6, 1.6)

    def swollen(local: Array) -> Array:
        u, v = (local[:, k] / half[k] for k in across)
        dome = np.sqrt(np.clip(1.0 - el.power(u, 4), 0.0, 1.0) * np.clip(1.0 - el.power(v, 4), 0.0, 1.0))
        up = np.clip(local[:, axis] / half[axis], -1.0 if both_sides else 0.0, 1.0)
        result = local.copy()
        result[:, axis] += bulge_m * dome * np.minimum(1.0 + 0.06 * crease(u, v), 1.06) * up
        return np.asarray(result + 0.5 * (a + b))

    points = swollen(template.inner * (half - radius) + radius * template.direction)
    normals = smooth_normals(points, template.faces)
    body = make_mesh(points[template.welded], normals[template.welded], template.apart_faces, rounded_uvs(template, half, radius))
    if piping_m <= 0.0:
        return body
    inset = 0.3 * radius
    loop = rounded_loop(half[across[0]] - inset, half[across[1]] - inset, 0.7 * radius, 4, 2)
    cords = []
    for end in (-1.0, 1.0):
        local = np.empty((len(loop), 3))
        local[:, axis], local[:, across[0]], local[:, across[1]] = end * (half[axis] - inset), loop[:, 0], loop[:, 1]
        cords.append(piping(swollen(local), piping_m, 4))
    return merged(body, *cords)


def pillow(rng: np.random.Generator, depth_m: float, width_m: float, thickness_m: float, divisions: int = 14, piped: bool = False) -> Mesh:
    """Return a filled pillow lying flat: depth along x, width along y, centred at the origin, its seam at half height.

    Corners are drawn out, sides drawn in, creases run from the corners, the filling is thickest in the middle and dented at random.
    ``piped`` lays a cord round its seam.
    """
    s = el.sin(np.linspace(-0.5, 0.5, divisions + 1) * math.pi)
    u, v = np.meshgrid(s, s, indexing="ij")
    waist = 0.08
    x = 0.5 * depth_m * u * (1.0 - waist * (1.0 - v**2) * np.abs(u))
    y = 0.5 * width_m * v * (1.0 - waist * (1.0 - u**2) * np.abs(v))
    fill = el.power(np.clip(1.0 - u**2, 0.0, 1.0) * np.clip(1.0 - v**2, 0.0, 1.0), 0.42)
    dents = 1.0 + 0.12 * wrinkles(rng, u, v, 5, 0.35, 1.1)
    pull = el.cos(5.0 * math.pi * (el.arctan2(np.abs(u), np.abs(v)) / (0.5 * math.pi) - 0.5)) * (u * v) ** 2
    half = 0.5 * thickness_m * (fill * dents + 0.10 * pull * np.clip(4.0 * fill, 0.0, 1.0))
    seam = 0.004 * wrinkles(rng, u, v, 4, 1.0, 2.0)
    top, bottom = np.dstack([x, y, half + seam + 0.002]), np.dstack([x, y, -0.8 * half + seam - 0.002])
    body = sheet(top, bottom)
    if not piped:
        return body
    middle = 0.5 * (top + bottom)
    rim = np.concatenate([middle[:-1, 0], middle[-1, :-1], middle[:0:-1, -1], middle[0, :0:-1]])
    return merged(body, piping(rim, 0.0045))


def drape(rng: np.random.Generator, plan: Drape, rows: int = 43, columns: int = 61, puff_m: float = 0.03, quilt_m: float = 0.0) -> Cover:
    """Return cloth that lies on a box centred at the origin and falls in folds over its sides (y) and ends (front +x, back -x).

    ``rows`` and ``columns`` are odd.  The cloth is stuffed: it stands up to about ``puff_m`` off the box, in squares of side ``quilt_m``
    where that is not 0.
    """
    half = np.array([plan.half_x, plan.half_y])
    bend = 0.05
    s = _spaced(-(half[0] + plan.fall_back), half[0] + plan.fall_front, [-half[0], half[0]], rows)
    t = _spaced(-(half[1] + plan.fall_side), half[1] + plan.fall_side, [-half[1], half[1]], columns)
    ss, tt = np.meshgrid(s, t, indexing="ij")
    beyond_x, beyond_y = np.maximum(np.abs(ss) - (half[0] - bend), 0.0), np.maximum(np.abs(tt) - (half[1] - bend), 0.0)
    beyond, way = np.hypot(beyond_x, beyond_y), el.arctan2(beyond_y, beyond_x)
    turn = np.minimum(beyond / bend, 0.5 * math.pi)
    drop = bend * (1.0 - el.cos(turn)) + np.maximum(beyond - 0.5 * math.pi * bend, 0.0)
    hang = np.clip(drop / max(plan.fall_side, plan.fall_front, 1e-6), 0.0, 1.0)
    at_side, at_corner = el.sin(way) ** 2, el.sin(2.0 * way) ** 2
    folds = at_side * _folds(rng, ss + 0.15 * drop) + (1.0 - at_side) * _folds(rng, tt - 0.15 * drop)
    folds = folds * (1.0 - 0.7 * at_corner) + 0.7 * at_corner
    out = bend * el.sin(turn) + plan.flare * (0.05 + 0.95 * folds) * el.power(hang, 0.75)
    soft = wrinkles(rng, ss, tt, 9, 0.9, 3.6)
    inside = np.clip(1.0 - np.abs(ss) / half[0], 0.0, 1.0) * np.clip(1.0 - np.abs(tt) / half[1], 0.0, 1.0)
    puff = puff_m * (np.clip(6.0 * inside, 0.0, 1.0) * (0.5 + 0.2 * soft) + 0.45)
    if quilt_m > 0.0:
        squares = el.power(np.abs(el.sin(math.pi * ss / quilt_m) * el.sin(math.pi * tt / quilt_m)), 0.4)
        puff += 0.5 * puff_m * (squares - 0.6)
    x = np.sign(ss) * (np.minimum(np.abs(ss), half[0] - bend) + out * el.cos(way) * (beyond > 0.0))
    y = np.sign(tt) * (np.minimum(np.abs(tt), half[1] - bend) + out * el.sin(way) * (beyond > 0.0))
    hem = 1.0 - 0.05 * hang * (1.0 + wrinkles(rng, ss, tt, 4, 0.5, 1.5)) - 0.06 * hang * folds - 0.1 * at_corner
    z = plan.top - drop * hem + puff * el.exp(-drop / 0.06)
    points = np.dstack([x, y, z])
    grid = np.arange(points[..., 0].size).reshape(points.shape[:2])
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
    normals = smooth_normals(points.reshape(-1, 3), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Cover(s, t, points, normals.reshape(points.shape))


def cloth(cover: Cover, thickness_m: float) -> Mesh:
    """Return a cover as a closed body that reaches ``thickness_m`` inward from its surface, thinner towards the seam at its hem."""
    edge = np.minimum.outer(
        np.minimum(cover.s - cover.s[0], cover.s[-1] - cover.s), np.minimum(cover.t - cover.t[0], cover.t[-1] - cover.t)
    )
    share = np.clip(edge / 0.05, 0.0, 1.0)
    depth = thickness_m * (0.3 + 0.7 * np.sqrt(share * (2.0 - share)))
    return lined(cover.points, cover.points - depth[..., None] * cover.normals)


def layer(cover: Cover, along: tuple[float, float], fall_share: float, lift_m: float, thickness_m: float, rows: int = 11) -> Mesh:
    """Return a band of cloth that lies on a cover and follows all its folds.

    ``along`` is the band's range of arc length along x, ``fall_share`` how much of the cover's width it spans, ``lift_m`` its height above;
    ``rows`` is odd.
    """
    limit = fall_share * cover.t[-1]
    beside = cover.t[(cover.t > 0.002) & (cover.t < limit - 0.004)]
    t = np.concatenate([[-limit], -beside[::-1], [0.0], beside, [limit]])
    s = np.linspace(along[0], along[1], rows)
    points, normals = (_resample(_resample(grid, cover.s, s, 0), cover.t, t, 1) for grid in (cover.points, cover.normals))
    top = points + lift_m * normals
    return lined(top, top - thickness_m * normals)


def _resample(grid: Array, old: Array, new: Array, axis: int) -> Array:
    """Interpolate a vertex grid linearly along one axis."""
    i = np.clip(np.searchsorted(old, new, side="right") - 1, 0, len(old) - 2)
    share = (new - old[i]) / (old[i + 1] - old[i])
    share = share[:, None, None] if axis == 0 else share[None, :, None]
    return np.asarray(np.take(grid, i, axis) * (1.0 - share) + np.take(grid, i + 1, axis) * share)


def _folds(rng: np.random.Generator, along: Array) -> Array:
    """Return the depth of hanging folds in [0, 1] along a hem: irregular in spacing and depth, broad ridges between narrow valleys."""
    phase = rng.uniform(0.0, 2.0 * math.pi, 4)
    spacing = rng.uniform(0.24, 0.34)
    warped = along + 0.35 * spacing * el.sin(2.0 * math.pi * along / (3.1 * spacing) + phase[0])
    wave = el.cos(2.0 * math.pi * warped / spacing + phase[1]) + 0.4 * el.cos(2.0 * math.pi * warped / (0.53 * spacing) + phase[2])
    depth = 0.7 + 0.3 * el.sin(2.0 * math.pi * along / (4.7 * spacing) + phase[3])
    return np.asarray(el.power(np.clip(0.5 + depth * wave / 2.6, 0.0, 1.0), 0.8))


def _spaced(start: float, end: float, dense: Sequence[float], count: int) -> Array:
    """Return ``count`` increasing values from start to end, closer together near the values ``dense``."""
    fine = np.linspace(start, end, 400)
    weight = np.ones_like(fine)
    for value in dense:
        weight += 2.5 * el.exp(-(((fine - value) / 0.07) ** 2))
    total = np.concatenate([[0.0], np.cumsum(0.5 * (weight[1:] + weight[:-1]))])
    return np.interp(np.linspace(0.0, total[-1], count), total, fine)


def heap(rng: np.random.Generator, low: ArrayLike, high: ArrayLike) -> Mesh:
    """Return cloth in folds over a low dome between two corners (3,)."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 12), np.linspace(0.0, 2.0 * math.pi, 31), indexing="ij")
    outline, folds = wrinkle_field(rng, 5, 0.25, 0.7), wrinkle_field(rng, 7, 0.5, 1.4)
    x, y = u * el.cos(v), u * el.sin(v)
    edge = 1.0 + 0.2 * np.clip(outline(el.cos(v), el.sin(v)), -1.3, 1.3)
    dome = np.clip(1.0 - u**2, 0.0, 1.0)
    z = 0.05 + 0.3 * dome + 0.4 * np.clip(0.5 + 0.5 * folds(x, y), 0.0, 1.2) * el.power(dome, 0.4)
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    top = np.dstack([middle[0] + half[0] * edge * x, middle[1] + half[1] * edge * y, a[2] + (b[2] - a[2]) * z])
    return sheet(top, np.dstack([top[..., 0], top[..., 1], np.full_like(z, a[2])]))


SHOULDERS = ((0.0, 0.12), (0.05, 0.3), (0.16, 0.62), (0.5, 0.8), (1.0, 1.0))
"""Way down a coat, and its width there, as shares."""


def garment(rng: np.random.Generator, low: ArrayLike, high: ArrayLike, shape: ArrayLike = SHOULDERS) -> Mesh:
    """Return a garment that hangs between two corners (3,): folds grow towards the hem; ``shape``: rows of way down and width."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    vv, aa = np.meshgrid(np.linspace(0.0, 1.0, 13), np.linspace(0.0, 2.0 * math.pi, 31), indexing="ij")
    spread = np.interp(vv, *np.asarray(shape, np.float64).T)
    folds = 1.0 + 0.1 * vv * el.cos(7.0 * aa + rng.uniform(0.0, 6.28)) + 0.05 * vv * el.cos(12.0 * aa + 3.0 * vv)
    soft = 1.0 + 0.04 * wrinkles(rng, el.cos(aa) + vv, el.sin(aa) + vv, 6, 0.5, 1.5)
    radius = spread * folds * soft
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    z = b[2] - (b[2] - a[2]) * vv - 0.02 * np.abs(el.cos(aa)) * (vv > 0.0)
    rings = np.dstack([half[0] * radius * el.sin(aa), half[1] * radius * el.cos(aa), z])
    rings[:, -1] = rings[:, 0]
    inner = rings * (0.9, 0.9, 1.0) - (0.0, 0.0, 0.004)
    centre = (middle[0], middle[1], 0.0)
    return sheet(rings[:, ::-1] + centre, inner[:, ::-1] + centre)


_SLEEVE = ((0.0, 0.3, 0.93), (0.15, 0.52, 0.9), (0.3, 0.78, 0.78), (0.2, 0.9, 0.6), (0.35, 0.88, 0.46), (0.5, 0.82, 0.36))
"""Way of a sleeve from the shoulder to the cuff, as shares of half a coat's depth, half its width and its length."""
_COLLAR = ((0.62, 0.0, 0.9), (0.45, 0.2, 0.96), (0.0, 0.27, 0.99), (-0.4, 0.0, 1.0), (0.0, -0.27, 0.99), (0.45, -0.2, 0.96), (0.62, 0, 0.9))


def coat(rng: np.random.Generator, low: ArrayLike, high: ArrayLike, shape: ArrayLike = SHOULDERS) -> Mesh:
    """Return a coat that hangs between two corners (3,): a garment with a collar and two sleeves that hang beside it."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    origin, scale = np.array([middle[0], middle[1], a[2]]), np.array([half[0], half[1], b[2] - a[2]])
    inset = np.array([0.1 * half[0], 0.3 * half[1], 0.0])
    pieces = [garment(rng, a + inset, b - inset, shape)]
    thick = min(0.62 * half[0], 0.3 * half[1])
    for side in (1.0, -1.0):
        way = np.array(_SLEEVE) * (1.0, side, 1.0) + rng.normal(0.0, 0.015, (len(_SLEEVE), 3))
        pieces.append(sweep(origin + way * scale, np.linspace(thick, 0.62 * thick, len(_SLEEVE)), 8))
    pieces.append(sweep(origin + np.array(_COLLAR) * scale, 0.14 * half[0], 6))
    return merged(*pieces)
