"""Cloth: bodies between two grids, wrinkles, covers that fall over edges, heaps, garments."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.coordinates import grid_way
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import grid_faces, make_mesh, merged, smooth_normals, sweep


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


def creases(rng: np.random.Generator, u: Array, v: Array, spacing: float) -> Array:
    """Return folds in [0, 1] over coordinates (u, v): narrow crests some ``spacing`` apart that wander, cross and die away."""
    total = np.zeros_like(u)
    for _ in range(2):
        way = rng.uniform(0.0, math.pi)
        wander, strong = (wrinkle_field(rng, 4, low / spacing, high / spacing) for low, high in ((0.15, 0.5), (0.12, 0.3)))
        across = (math.cos(way) * u + math.sin(way) * v) / spacing + 0.35 * wander(u, v)
        crest = (1.05 - np.sqrt(el.sin(math.pi * across) ** 2 + 0.09)) / 0.75
        total += np.clip(0.65 + 0.5 * strong(u, v), 0.0, 1.0) * el.power(np.maximum(crest, 0.0), 1.5)
    return np.minimum(total, 1.0)


def _along_crests(height: Array) -> NDArray[np.bool_]:
    """Return which quadrilaterals of a grid of heights (n, m) are cut along their other diagonal, so that no crest is cut across."""
    return np.asarray(np.abs(height[1:, 1:] - height[:-1, :-1]) > np.abs(height[1:, :-1] - height[:-1, 1:]))


_CREST, _FLAT = 1.24, 0.2
"""How high the crests of a stuffed cover reach off its box at most, and how gently they end there, as shares of its thickness."""


def drape(rng: np.random.Generator, plan: Drape, rows: int = 43, columns: int = 61, puff_m: float = 0.03, quilt_m: float = 0.0) -> Cover:
    """Return cloth that lies on a box centred at the origin and falls in folds over its sides (y) and ends (front +x, back -x).

    ``rows`` and ``columns`` are odd.  The cloth is stuffed: it stands about ``puff_m`` off the box, in squares of side ``quilt_m`` where
    that is not 0, and its crests are all about as high, so that things lie on it.
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
    puff = puff_m * (np.clip(6.0 * inside, 0.0, 1.0) * (0.1 + 0.2 * soft) + 0.45) + 0.85 * puff_m * creases(rng, ss, tt, 0.34)
    if quilt_m > 0.0:
        squares = el.power(np.abs(el.sin(math.pi * ss / quilt_m) * el.sin(math.pi * tt / quilt_m)), 0.4)
        puff += 0.5 * puff_m * (squares - 0.6)
    puff = 0.5 * (puff + _CREST * puff_m - np.hypot(puff - _CREST * puff_m, _FLAT * puff_m))
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
    return lined(cover.points, cover.points - depth[..., None] * cover.normals, _along_crests(cover.points[..., 2]))


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


def heap(rng: np.random.Generator, low: ArrayLike, high: ArrayLike, steps: int = 27) -> Mesh:
    """Return cloth that was dropped, between two corners (3,): creased all over, its folds lean over, its edge lies in waves.

    ``steps``: points along each side of its grid, odd.
    """
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    s, t = np.meshgrid(*2 * (np.linspace(-1.0, 1.0, steps),), indexing="ij")
    x, y = s * np.sqrt(1.0 - 0.5 * t**2), t * np.sqrt(1.0 - 0.5 * s**2)
    angle = el.arctan2(y, x)
    edge = 0.84 + 0.13 * np.clip(wrinkles(rng, el.cos(angle), el.sin(angle), 6, 0.3, 1.1), -1.2, 1.0)
    folds = creases(rng, x, y, 0.55)
    dome = np.sqrt(np.clip(1.0 - x**2 - y**2, 0.0, 1.0))
    height = 0.05 + 0.35 * dome + (0.1 + 0.4 * dome) * folds
    lean = 0.03 * folds * dome
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    x, y = middle[0] + half[0] * (edge * x + lean), middle[1] + half[1] * (edge * y + lean)
    top = np.dstack([x, y, a[2] + (b[2] - a[2]) * height])
    return lined(top, np.dstack([x, y, np.full_like(x, a[2])]), _along_crests(height))


def folded(rng: np.random.Generator, low: ArrayLike, high: ArrayLike) -> Mesh:
    """Return cloth that lies folded in two between two corners (3,), its fold at +x: soft, thinner towards its sides, uneven."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    half, bend = 0.5 * (b - a), 0.25 * (b[2] - a[2])
    # the line (17, 3) of the cloth from its lower end round the fold to its upper one, and the way (17, 3) out of it
    turn = np.concatenate([np.full(5, -0.5), np.linspace(-0.5, 0.5, 7), np.full(5, 0.5)]) * math.pi
    out = np.column_stack([el.cos(turn), np.zeros(17), el.sin(turn)])
    line = bend * out
    line[:, 0] += np.interp(np.abs(np.arange(-8.0, 9.0)), (3.0, 8.0), (half[0] - bend, -half[0]))
    # spread across, with a hem that wanders and layers that sink where nothing stuffs them
    across = el.sin(np.linspace(0.5, -0.5, 11) * math.pi)
    u, v = np.meshgrid(line[:, 0] / half[0], across, indexing="ij")
    grid = line[:, None] + np.outer(across, (0.0, half[1], 0.0))
    grid[..., 0] += 0.03 * half[0] * wrinkles(rng, u, v, 4, 0.2, 0.6)
    grid[..., 2] *= 1.0 - 0.15 * u**2 * v**2 - 0.12 * creases(rng, u, v, 0.9)
    off = 0.92 * bend * (0.4 + 0.6 * np.sqrt(1.0 - el.power(np.abs(across), 5)))[None, :, None] * out[:, None]
    return lined(grid + off + 0.5 * (a + b), grid - off + 0.5 * (a + b))


SHOULDERS = ((0.0, 0.12), (0.05, 0.3), (0.16, 0.62), (0.5, 0.8), (1.0, 1.0))
"""Way down a coat, and its width there, as shares."""


def garment(rng: np.random.Generator, low: ArrayLike, high: ArrayLike, shape: ArrayLike = SHOULDERS) -> Mesh:
    """Return a garment that hangs between two corners (3,): folds grow towards the hem; ``shape``: rows of way down and width."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    vv, aa = np.meshgrid(np.linspace(0.0, 1.0, 15), np.linspace(0.0, 2.0 * math.pi, 33), indexing="ij")
    spread = np.interp(vv, *np.asarray(shape, np.float64).T)
    folds = 1.0 + 0.1 * vv * el.cos(7.0 * aa + 3.0 * wrinkles(rng, el.cos(aa), vv, 4, 0.3, 0.8)) + 0.05 * vv * el.cos(12.0 * aa + 3.0 * vv)
    folds += 0.07 * (np.abs(aa - 0.67 * math.pi) < 0.18 * math.pi)  # the front laps over itself
    folds -= 0.11 * np.minimum(4.0 * vv, 1.0) * creases(rng, el.cos(aa) + 0.7 * el.sin(aa), 3.0 * vv, 0.8)
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    z = b[2] - (b[2] - a[2]) * vv - 0.02 * np.abs(el.cos(aa)) * (vv > 0.0)
    rings = np.dstack([half[0] * spread * folds * el.sin(aa), half[1] * spread * folds * el.cos(aa), z])
    rings[:, -1] = rings[:, 0]
    inner = rings * (0.8, 0.8, 1.0) - (0.0, 0.0, 0.004)
    centre = (middle[0], middle[1], 0.0)
    return lined(rings[:, ::-1] + centre, inner[:, ::-1] + centre)


_SLEEVE = ((0.0, 0.3, 0.94), (0.05, 0.5, 0.91), (0.1, 0.68, 0.82), (0.1, 0.76, 0.64), (0.2, 0.77, 0.48), (0.35, 0.74, 0.34))
"""Way of a sleeve from the shoulder to the cuff, as shares of half a coat's depth, half its width and its length."""


_COLLAR = ((0.62, 0.0, 0.9), (0.45, 0.2, 0.96), (0.0, 0.27, 0.99), (-0.4, 0.0, 1.0), (0.0, -0.27, 0.99), (0.45, -0.2, 0.96), (0.62, 0, 0.9))


def coat(rng: np.random.Generator, low: ArrayLike, high: ArrayLike, shape: ArrayLike = SHOULDERS) -> Mesh:
    """Return a coat that hangs between two corners (3,): a garment with a collar and two sleeves that hang beside it."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    half, middle = 0.5 * (b - a), 0.5 * (a + b)
    origin, scale = np.array([middle[0], middle[1], a[2]]), np.array([half[0], half[1], b[2] - a[2]])
    inset = np.array([0.1 * half[0], 0.16 * half[1], 0.0])
    pieces = [garment(rng, a + inset, b - inset, shape)]
    thick = min(0.62 * half[0], 0.3 * half[1])
    for side in (1.0, -1.0):
        way = np.array(_SLEEVE) * (1.0, side, 1.0) + rng.normal(0.0, 0.015, (len(_SLEEVE), 3))
        share = np.linspace(0.0, len(_SLEEVE) - 1.0, 12)
        path = np.stack([np.interp(share, np.arange(len(_SLEEVE)), column) for column in way.T], axis=1)
        girth = np.linspace(thick, 0.62 * thick, 12) * rng.uniform(0.86, 1.06, 12)  # creased across, most of all at the elbow
        pieces.append(sweep(origin + path * scale, girth, 8))
    pieces.append(sweep(origin + np.array(_COLLAR) * scale, 0.14 * half[0], 6))
    return merged(*pieces)
