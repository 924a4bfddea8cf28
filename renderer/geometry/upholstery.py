"""What upholsterers make: piping, buttoned panels, cushions that bulge, pillows."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.cloth import lined, wrinkle_field, wrinkles
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import (
    grid_faces,
    lathe,
    make_mesh,
    merged,
    repeated,
    rotated,
    rounded_template,
    rounded_uvs,
    sheet,
    smooth_normals,
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


def buttons(centers: ArrayLike, radius_m: float, height_m: float) -> Mesh:
    """Return covered buttons whose middles lie at the centers (n, 3) and which look along +x."""
    r, h = radius_m, height_m
    dome = rotated(lathe([(0.0, -h), (r, -0.4 * h), (r, 0.2 * h), (0.6 * r, 0.8 * h), (0.0, h)], 8), "y", 0.5 * math.pi)
    return repeated(dome, centers)


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


def cushion(
    rng: np.random.Generator,
    low: Sequence[float],
    high: Sequence[float],
    radius_m: float,
    bulge_m: float,
    axis: int = 2,
    divisions: int = 6,
    piping_m: float = 0.0,
) -> Mesh:
    """Return a rounded, upholstered block between two corners, swollen by ``bulge_m`` along ``axis``; the swelling lies inside the corners.

    The lower side stays flat; ``divisions`` is how finely the swollen side is cut.  ``piping_m`` is the radius of a
    cord along its seams, none where 0.
    """
    flats = tuple(1 if k == axis else divisions for k in range(3))
    template = rounded_template(2 if divisions > 4 else 1, (flats[0], flats[1], flats[2]))
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64).copy()
    b[axis] -= bulge_m
    half = 0.5 * (b - a)
    radius = min(radius_m, 0.9 * float(half.min()))
    across = ((axis + 1) % 3, (axis + 2) % 3)
    crease = wrinkle_field(rng, 5, 0.6, 1.6)

    def swollen(local: Array) -> Array:
        u, v = (local[:, k] / half[k] for k in across)
        dome = np.sqrt(np.clip(1.0 - el.power(u, 4), 0.0, 1.0) * np.clip(1.0 - el.power(v, 4), 0.0, 1.0))
        up = np.clip(local[:, axis] / half[axis], 0.0, 1.0)
        result = local.copy()
        result[:, axis] += bulge_m * dome * np.clip(1.0 + 0.3 * crease(u, v), 0.4, 1.06) * up
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
