"""The atlas: nodes on all surfaces of a scene, at which light is computed, and how the nodes around a hit are found.

On a flat chart nodes lie on a grid, and a hit reads the four around it.  Elsewhere vertices that lie close together and look the same way
share a node, and a hit reads those of its triangle's corners; along triangles that are long and thin, as those of slats, tubes and folds,
further nodes stand in two rows, and on large ones in a lattice.  All are straight lines within a triangle: a hit finds its nodes by its
barycentric weights, without a search.  No node serves two parts, so that light leaks from none to another.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, inlined, kernel
from renderer.geometry.mesh import Mesh
from renderer.irradiance_cache.charts import CURVED, Charts, mix_rows
from renderer.irradiance_cache.panes import NO_PANES, Panes, before_panes
from renderer.irradiance_cache.places import INSET, find_lattices, find_strips
from renderer.path.light_nodes import CORNERS, GRID, STRIP, Atlas, find_cell
from scene_description.products import matmul

_INSET_M = 2e-3
_FACING = 1.5
_LARGE = 4.0
_LONG, _THIN, _HIGH_M = 2.0, 4.0, 5e-3
"""Curved triangles longer than so many steps between nodes have nodes within them: along them if they are so many times as long as high,
and higher than so many metres: what leaves the rounded edge of a board is little."""


def build_atlas(
    mesh: Mesh,
    face_part: NDArray[np.int32],
    charts: Charts,
    one_sided: NDArray[np.bool_],
    spacing_m: float | NDArray[np.float64],
    panes: Panes = NO_PANES,
) -> Atlas:
    """Lay nodes some ``spacing_m`` apart, on all triangles or each, (m,), the same on all of a chart; their areas are 0.

    ``one_sided``: (m,) bool, triangles that nobody sees from behind; ``panes``: on both sides of which no node serves.
    """
    count = len(face_part)
    spacing_m = np.broadcast_to(np.float64(spacing_m), count)
    cells, affine = np.zeros((count, 4), np.int32), np.zeros((count, 6), np.float32)
    crossing = _cross_panes(mesh, charts, panes)
    index, chart_face, chart_weight, chart_normal = _lay_grids(charts, spacing_m, crossing, cells, affine)
    curved = _lay_curved(mesh, face_part, charts, spacing_m, panes, cells, affine, len(chart_face), len(index))
    strip_index, corner_face, corner_weight, corner_normal = curved
    index = np.concatenate([index, strip_index])
    face = np.concatenate([chart_face, corner_face]).astype(np.int32)
    weight = np.concatenate([chart_weight, corner_weight]).astype(np.float32)
    normal = np.concatenate([chart_normal, corner_normal]).astype(np.float32)
    position = place_nodes(mesh, face, weight)
    two_sided = np.flatnonzero(~one_sided[face])
    back = np.full(len(face) + len(two_sided), -1, np.int32)
    back[two_sided] = len(face) + np.arange(len(two_sided))
    return Atlas(
        cells,
        affine,
        index,
        np.full((len(index), 2), np.nan, np.float32),
        back,
        np.concatenate([position, position[two_sided]]),
        np.concatenate([normal, -normal[two_sided]]),
        np.concatenate([face, face[two_sided]]),
        np.concatenate([weight, weight[two_sided]]),
        np.zeros(len(back), np.float32),
    )


def place_nodes(mesh: Mesh, face: NDArray[np.int32], weight: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the points (n, 3), metres, of triangles (n,) that have such barycentric weights of their second and third corners, (n, 2)."""
    shares = np.column_stack([1.0 - weight.sum(axis=1, dtype=np.float64), weight])
    return np.asarray(matmul(shares[:, None], mesh.vertices.astype(np.float64)[mesh.faces[face]])[:, 0].astype(np.float32))


def _cross_panes(mesh: Mesh, charts: Charts, panes: Panes) -> NDArray[np.bool_]:
    """Return which charts (c,) lie on both sides of a pane that they are near, as the flanks of a window's frame do."""
    members = np.flatnonzero(charts.face_chart >= 0)
    before = before_panes(panes, mesh.vertices[mesh.faces[members]].reshape(-1, 3)).reshape(-1, 3)
    chart, count = charts.face_chart[members], len(charts.normal)
    sides = [np.bincount(chart, (way * before > _INSET_M).any(axis=1), count) > 0 for way in (-1.0, 1.0)]
    return np.asarray(sides[0] & sides[1])


def _lay_grids(
    charts: Charts,
    spacing_m: NDArray[np.float64],
    crossing: NDArray[np.bool_],
    cells: NDArray[np.int32],
    affine: NDArray[np.float32],
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Fill the rows of triangles on charts; return the grids' ``index``, and triangle, weights and normal of their nodes.

    ``crossing``: (c,) bool, charts that lie on both sides of a pane.
    """
    members = np.flatnonzero(charts.face_chart >= 0)
    if not len(members):
        return np.zeros(0, np.int32), np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros((0, 3))
    members = members[np.argsort(charts.face_chart[members], kind="stable")]
    chart = charts.face_chart[members]
    start = np.searchsorted(chart, np.arange(len(charts.normal)))
    low = np.minimum.reduceat(charts.at[members].min(axis=1), start)
    high = np.maximum.reduceat(charts.at[members].max(axis=1), start)
    spacing = spacing_m[members[start], None]
    inset = np.minimum(np.maximum(_INSET_M, INSET * spacing), 0.25 * (high - low))
    low, high = low + inset, high - inset
    steps = np.where(high - low < 0.5 * spacing, 0, np.ceil((high - low) / spacing)).astype(np.int64)
    # A node on each side of a pane, at least: they are lit otherwise.
    steps = np.where(crossing[:, None] & (high - low > _INSET_M), np.maximum(steps, 1), steps)
    origin = np.where(steps == 0, 0.5 * (low + high), low)
    step = np.where(steps == 0, spacing, (high - low) / np.maximum(steps, 1))
    size = (steps + 1).prod(axis=1)
    offset = np.concatenate([[0], np.cumsum(size)])
    at = (charts.at[members] - origin[chart, None]) / step[chart, None]
    nearest = np.full(offset[-1], np.inf)
    node_face, node_weight = np.full(offset[-1], -1, np.int64), np.zeros((offset[-1], 2))
    _rasterize(at, step[chart], steps[chart], offset[chart], nearest, node_face, node_weight)
    cells[members] = np.column_stack([offset[chart], steps[chart] + 1, np.full(len(members), GRID)])
    affine[members] = _affine(at)
    used = node_face >= 0
    index = np.where(used, np.cumsum(used) - 1, -1).astype(np.int32)
    face = members[node_face[used]]
    return index, face, node_weight[used], charts.normal[charts.face_chart[face]]


@entry
def _rasterize(
    at: NDArray[np.float64],
    step: NDArray[np.float64],
    steps: NDArray[np.int64],
    offset: NDArray[np.int64],
    nearest: NDArray[np.float64],
    node_face: NDArray[np.int64],
    node_weight: NDArray[np.float64],
) -> None:
    """Give each grid node the triangle that is nearest, and the weights of the point there; far ones stay without.

    ``at``: (t, 3, 2), corners in grid coordinates; ``step``: (t, 2), metres between nodes; ``steps``: (t, 2); ``offset``: (t,).
    """
    for t in range(len(at)):
        sx, sy = step[t, 0], step[t, 1]
        ax, ay = at[t, 0, 0] * sx, at[t, 0, 1] * sy
        bx, by = at[t, 1, 0] * sx - ax, at[t, 1, 1] * sy - ay
        cx, cy = at[t, 2, 0] * sx - ax, at[t, 2, 1] * sy - ay
        area = bx * cy - by * cx
        reach = sx * sx + sy * sy
        left = max(int(np.floor(min(at[t, 0, 0], at[t, 1, 0], at[t, 2, 0]))), 0)
        right = min(int(np.ceil(max(at[t, 0, 0], at[t, 1, 0], at[t, 2, 0]))), steps[t, 0])
        low = max(int(np.floor(min(at[t, 0, 1], at[t, 1, 1], at[t, 2, 1]))), 0)
        high = min(int(np.ceil(max(at[t, 0, 1], at[t, 1, 1], at[t, 2, 1]))), steps[t, 1])
        for row in range(low, high + 1):
            for column in range(left, right + 1):
                x, y = column * sx - ax, row * sy - ay
                u, v = (x * cy - y * cx) / area, (bx * y - by * x) / area
                distance = 0.0
                if u < 0.0 or v < 0.0 or u + v > 1.0:
                    u, v, distance = _nearest_weights(x, y, bx, by, cx, cy)
                place = offset[t] + row * (steps[t, 0] + 1) + column
                if distance < nearest[place] and distance <= reach:
                    nearest[place], node_face[place] = distance, t
                    node_weight[place, 0], node_weight[place, 1] = u, v


@kernel
def _nearest_weights(x: float, y: float, bx: float, by: float, cx: float, cy: float) -> tuple[float, float, float]:
    """Return the weights of the point of triangle (0, b, c) nearest to (x, y) outside, moved inwards a little, and the squared distance."""
    dx, dy = cx - bx, cy - by
    along_b = min(max((x * bx + y * by) / (bx * bx + by * by), 0.0), 1.0)
    along_c = min(max((x * cx + y * cy) / (cx * cx + cy * cy), 0.0), 1.0)
    along_d = min(max(((x - bx) * dx + (y - by) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    on_b = (x - along_b * bx) ** 2 + (y - along_b * by) ** 2
    on_c = (x - along_c * cx) ** 2 + (y - along_c * cy) ** 2
    on_d = (x - bx - along_d * dx) ** 2 + (y - by - along_d * dy) ** 2
    u, v, distance = along_b, 0.0, on_b
    if on_c < distance:
        u, v, distance = 0.0, along_c, on_c
    if on_d < distance:
        u, v, distance = 1.0 - along_d, along_d, on_d
    to_middle = np.sqrt((bx * (1.0 / 3.0 - u) + cx * (1.0 / 3.0 - v)) ** 2 + (by * (1.0 / 3.0 - u) + cy * (1.0 / 3.0 - v)) ** 2)
    inward = min(_INSET_M / max(to_middle, 1e-12), 0.5)
    return u + inward * (1.0 / 3.0 - u), v + inward * (1.0 / 3.0 - v), distance


def _lay_curved(
    mesh: Mesh,
    face_part: NDArray[np.int32],
    charts: Charts,
    spacing_m: NDArray[np.float64],
    panes: Panes,
    cells: NDArray[np.int32],
    affine: NDArray[np.float32],
    first: int,
    first_place: int,
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Fill the rows of triangles on no chart, with nodes from number ``first`` on, and places in ``grid`` from ``first_place`` on.

    Return what ``grid`` has there, and these nodes' triangle, weights and normal.
    """
    members = np.flatnonzero(charts.face_chart == CURVED)
    if not len(members):
        return np.zeros(0, np.int32), np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros((0, 3))
    corners = mesh.vertices.astype(np.float64)[mesh.faces]
    longest = np.linalg.norm(np.roll(corners[members], -1, axis=1) - corners[members], axis=2).max(axis=1)
    height = 2.0 * charts.area[members] / longest
    spacing = spacing_m[members]
    long, thin = longest > _LONG * spacing, longest > _THIN * height
    chosen = long & thin & (height > _HIGH_M), long & ~thin
    whole = members[~(chosen[0] | chosen[1])]
    apart = [members[which] for which in chosen]
    strips, lattices = (
        find(corners[faces], spacing[which]) for find, faces, which in zip((find_strips, find_lattices), apart, chosen, strict=True)
    )
    large = np.concatenate(apart)
    size = np.concatenate([strips.size, lattices.size])
    offset = first_place + np.cumsum(size.prod(axis=1)) - size.prod(axis=1)
    whose = np.concatenate([np.repeat(whole, 3), apart[0][strips.whose], apart[1][lattices.whose]])
    shares = np.concatenate([np.tile(np.eye(3), (len(whole), 1)), strips.shares, lattices.shares])
    # Places that lie close together, on the same side of panes, and look the same way share a node.
    point = matmul(shares[:, None], corners[whose])[:, 0]
    places = np.column_stack([np.floor(point / spacing_m[whose, None]), 1e6 * spacing_m[whose]]).astype(np.int64)
    shading = matmul(shares[:, None], mesh.normals.astype(np.float64)[mesh.faces[whose]])[:, 0]
    facing = np.rint(_FACING * shading / np.maximum(np.linalg.norm(shading, axis=1, keepdims=True), 1e-6)).astype(np.int64)
    outside = (before_panes(panes, point) < 0.0).astype(np.int64)
    key = mix_rows(np.column_stack([mix_rows(places), mix_rows(facing), face_part[whose]]), outside)
    node = np.unique(key, return_inverse=True)[1].astype(np.int64)
    # A node stands on the largest triangle near it; along strips, which are all but alike, amid the places that share it.
    count = np.bincount(node)
    middle = np.column_stack([np.bincount(node, point[:, axis]) / count for axis in range(3)])
    rank = ((point - middle[node]) ** 2).sum(axis=1)
    rank[: 3 * len(whole)] = -charts.area[whose[: 3 * len(whole)]]
    order = np.lexsort((rank, node))
    lead = order[np.searchsorted(node[order], np.arange(node.max() + 1))]
    cells[whole] = np.column_stack([first + node[: 3 * len(whole)].reshape(-1, 3), np.full(len(whole), CORNERS)])
    cells[large] = np.column_stack([offset, size, np.full(len(large), STRIP)])
    affine[large] = _affine(np.concatenate([strips.corners, lattices.corners]))
    normal = np.column_stack([np.bincount(node, shading[:, axis]).astype(np.float64) for axis in range(3)])
    short = np.linalg.norm(normal, axis=1) < 1e-6
    normal[short] = shading[lead[short]]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    # The point of the largest triangle near the place, farther inside where that is large: what lies at a rim is often covered.
    inset = np.repeat(np.where(longest > _LARGE * spacing, 0.15, 0.05)[~(chosen[0] | chosen[1])], 3)[:, None]
    inside = inset + np.tile(np.eye(3), (len(whole), 1)) * (1.0 - 3.0 * inset)
    inner = np.concatenate([inside, strips.inner, lattices.inner])
    index = np.full(size.prod(axis=1).sum(), -1, np.int32)
    index[np.concatenate([strips.at, size[: len(apart[0])].prod(axis=1).sum() + lattices.at])] = first + node[3 * len(whole) :]
    return index, whose[lead], inner[lead, 1:], normal


def _affine(at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rows of ``affine`` (t, 6) by grid coordinates of corners (t, 3, 2)."""
    return np.column_stack([at[:, 0], at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]])[:, (0, 2, 4, 1, 3, 5)]


def stand_in(cells: NDArray[np.int32], grid: NDArray[np.int32], valid: NDArray[np.bool_], steps: int) -> NDArray[np.int32]:
    """Return a valid node near each node, (n,): itself if it is valid; itself too where none is within ``steps`` of it.

    Nodes are a step apart if they are neighbours in a grid or corners of one triangle.
    """
    other = np.arange(len(valid), dtype=np.int32)
    for _ in range(steps):
        _stand_in_beside(cells, grid, valid, other.copy(), other)
    return other


@entry
def _stand_in_beside(
    cells: NDArray[np.int32], grid: NDArray[np.int32], valid: NDArray[np.bool_], before: NDArray[np.int32], other: NDArray[np.int32]
) -> None:
    """Let those stand in for nodes that stood in ``before`` for others a step away."""
    for face in range(len(cells)):
        kind = cells[face, 3]
        if kind == CORNERS:
            for corner in range(3):
                node = cells[face, corner]
                if not valid[other[node]]:
                    for step in range(1, 3):
                        near = before[cells[face, (corner + step) % 3]]
                        if valid[near]:
                            other[node] = near
        elif kind >= STRIP and (face == 0 or cells[face, 0] != cells[face - 1, 0] or cells[face - 1, 3] != kind):
            offset, width, height = cells[face, 0], cells[face, 1], cells[face, 2]
            for place in range(width * height):
                node = grid[offset + place]
                if node < 0 or valid[other[node]]:
                    continue
                row, column = place // width, place % width
                for step in range(4):
                    x, y = column + (step == 0) - (step == 1), row + (step == 2) - (step == 3)
                    if 0 <= x < width and 0 <= y < height:
                        near = grid[offset + y * width + x]
                        if near >= 0 and valid[before[near]]:
                            other[node] = before[near]


@inlined
def mark_nodes(atlas: Atlas, face: int, u: np.float32, v: np.float32, before: int, is_read: NDArray[np.bool_]) -> int:
    """Mark the nodes around a hit in ``is_read`` (n,), on both sides where there are two.

    Return the place of the hit's cell in ``grid``, -1 if it is on none; the nodes of the cell at ``before`` are marked already.
    """
    kind, place = atlas.cells[face, 3], -1
    if kind == CORNERS:
        for corner in range(3):
            _mark(atlas, atlas.cells[face, corner], is_read)
    elif kind >= STRIP:
        place, _, _ = find_cell(atlas, face, u, v)
        if place != before:
            columns, rows = atlas.cells[face, 1], atlas.cells[face, 2]
            for corner in range(4):
                beside = place + (corner & 1 if columns > 1 else 0) + (columns if corner >> 1 and rows > 1 else 0)
                if atlas.grid[beside] >= 0:
                    _mark(atlas, atlas.grid[beside], is_read)
    return place


@inlined
def _mark(atlas: Atlas, node: int, is_read: NDArray[np.bool_]) -> None:
    is_read[node] = True
    if atlas.back[node] >= 0:
        is_read[atlas.back[node]] = True
