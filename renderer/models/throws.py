"""Blankets thrown over seats: cloth that lies on what is under it, from its front edge over seat and back, and hangs down at both ends."""

from collections.abc import Callable

import numpy as np

from renderer.core.arrays import Array
from renderer.geometry.cloth import creases, lined, wrinkles
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import merged
from renderer.models.model import Pieces, Size

_ROWS, _HANGING, _COLUMNS = 35, 5, 15
"""Of the grid: along the cloth where it lies, as many more at each end where it hangs, and across."""
_THICK_M, _OFF_M, _CREASE_M = 0.006, 0.006, 0.014
"""Thickness, the least that the cloth lies above what is under it, and how high its creases stand."""
_SAG_M = 0.04
"""How far cloth sinks between what carries it beside, into gaps between cushions."""
_SPANS = 3
"""How often cloth is pulled straight between its neighbours: it spans hollows of a row or two."""


_WIDE_M, _EDGE_M = (0.4, 0.62), 0.006
"""Width of a blanket folded lengthwise, and how far within the seat's depth it bends down."""
_HANG_M = ((0.1, 0.3), (0.06, 0.22))
"""How far blankets hang down behind a back, and before a seat."""

Build = Callable[[np.random.Generator, Size, str], Pieces]


def with_throw(build: Build, along: tuple[float, float]) -> Build:
    """Return a builder that knows every style with ``_throw`` behind it, too: a blanket (``throw``) over ``body``, ``seat`` and ``back``.

    ``along``: where on the width, from -0.5 to 0.5, the middle of the blanket may lie.
    """

    def built(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
        kind, _, throw = style.partition("_")
        pieces = dict(build(rng, size_m, kind))
        if throw:
            under = [pieces[name] for name in ("body", "seat", "back") if name in pieces]
            mesh = merged(*(piece for one in under for piece in ([one] if isinstance(one, Mesh) else one)))
            middle, half = size_m[1] * rng.uniform(*along), 0.5 * min(rng.uniform(*_WIDE_M), 0.5 * size_m[1])
            reach = 0.5 * size_m[0] - _EDGE_M
            falls = (float(rng.uniform(*_HANG_M[0])), float(rng.uniform(*_HANG_M[1])))
            pieces["throw"] = thrown(rng, mesh, (-reach, reach), (middle - half, middle + half), falls)
        return pieces

    return built


def thrown(rng: np.random.Generator, under: Mesh, x: tuple[float, float], y: tuple[float, float], hang_m: tuple[float, float]) -> Mesh:
    """Return a blanket over a mesh between two x and two y; ``hang_m``: how far it hangs down at its back and at its front."""
    across = np.linspace(*y, _COLUMNS)
    along = np.linspace(*x, _ROWS)
    u, v = np.meshgrid(np.linspace(0.0, 1.0, _ROWS), np.linspace(-1.0, 1.0, _COLUMNS), indexing="ij")
    grid_y = across[None, :] + 0.03 * wrinkles(rng, 2.0 * u, 0.5 * v, 5, 0.4, 1.4)
    grid_x = np.repeat(along[:, None], _COLUMNS, axis=1)
    height = _highest_around(heights(under, grid_x, grid_y, float(under.vertices[:, 2].min())))
    height = np.maximum(height, height.max(axis=1, keepdims=True) - _SAG_M)
    for _ in range(_SPANS):
        height[1:-1] = np.maximum(height[1:-1], 0.5 * (height[:-2] + height[2:]))
    height += _OFF_M + _CREASE_M * creases(rng, 2.0 * u, v, 0.6)
    grid = np.dstack([grid_x, grid_y, height])
    ends = [_hanging(rng, grid[row], way, fall) for row, way, fall in ((0, -1.0, hang_m[0]), (-1, 1.0, hang_m[1]))]
    grid = np.concatenate([ends[0][::-1], grid, ends[1]])
    return lined(grid, grid - _THICK_M * _normals(grid))


def heights(mesh: Mesh, x: Array, y: Array, floor: float) -> Array:
    """Return how high the uppermost point of a mesh lies over places (n, m), ``floor`` where there is none."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    double = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    seen = (double > 1e-9) & (corners[..., 1].max(axis=1) >= y.min()) & (corners[..., 1].min(axis=1) <= y.max())
    a, b, c, double = a[seen], b[seen], c[seen], double[seen]
    found = np.full(x.shape, floor)
    for row in range(len(x)):
        px, py = x[row, :, None], y[row, :, None]
        first = ((px - a[:, 0]) * (c[:, 1] - a[:, 1]) - (py - a[:, 1]) * (c[:, 0] - a[:, 0])) / double
        second = ((b[:, 0] - a[:, 0]) * (py - a[:, 1]) - (b[:, 1] - a[:, 1]) * (px - a[:, 0])) / double
        inside = (first >= 0.0) & (second >= 0.0) & (first + second <= 1.0)
        z = a[:, 2] + first * (b[:, 2] - a[:, 2]) + second * (c[:, 2] - a[:, 2])
        found[row] = np.maximum(found[row], np.where(inside, z, floor).max(axis=1, initial=floor))
    return found


def _highest_around(height: Array) -> Array:
    """Return the greatest of each vertex's height (n, m) and its eight neighbours', so that the edges between them stay above corners."""
    rows, columns = height.shape
    padded = np.pad(height, 1, mode="edge")
    return np.asarray(np.max([padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)], axis=0))


def _hanging(rng: np.random.Generator, edge: Array, way: float, fall_m: float) -> Array:
    """Return the rows (k, m, 3) of cloth that hangs from an edge (m, 3), ``way`` along x, outermost last: its hem is uneven, in folds."""
    across = np.linspace(-1.0, 1.0, len(edge))
    hem = fall_m * (1.0 + 0.12 * wrinkles(rng, across, np.zeros_like(across), 4, 0.3, 1.0))
    fold = 0.012 * wrinkles(rng, 2.0 * across, np.ones_like(across), 5, 0.6, 1.6)
    down = np.linspace(0.0, 1.0, _HANGING + 1)[1:, None]
    out = way * (0.012 + np.abs(fold) * down)
    return edge + np.stack([out, np.zeros_like(out), -hem * down], axis=2)


def _normals(grid: Array) -> Array:
    """Return unit normals (n, m, 3) of a vertex grid, on the side from which rows and columns run counter-clockwise."""
    crossed = np.cross(np.gradient(grid, axis=0), np.gradient(grid, axis=1))
    return np.asarray(crossed / np.maximum(np.linalg.norm(crossed, axis=2, keepdims=True), 1e-12))
