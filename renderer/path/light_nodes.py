"""Nodes on the surfaces of a scene, at which light is known, and how those around a hit are found.

On a flat chart nodes lie on a grid, and a hit reads the four around it; a long thin triangle of a curved surface has two rows of its own,
another large one a lattice.  Elsewhere a hit reads those of its triangle's corners.
:mod:`renderer.irradiance_cache.atlas` lays them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import inlined

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
NONE, CORNERS, STRIP, GRID = range(4)
"""``cells[:, 3]``: how the nodes of a triangle are found; from STRIP on in a grid."""


class Atlas(NamedTuple):
    """Nodes, and where each triangle finds its own, for kernels.

    cells: (m, 4) int32, for GRID and STRIP where the rows begin in ``grid``, width and height, for CORNERS the three nodes; then which;
    affine: (m, 6) float32, grid coordinates (s, r) of the first corner, and what the second and the third add; grid: (g,) int32, nodes of
    the charts' grids, -1 where no triangle is near; cuts: (g, 2) float32, how much of the way to the next node of the row, and to that of
    the next row, lies on this side of what stands between, NaN where nothing does; back: (n,) int32, the node that looks the other way, -1
    where nobody looks from there.
    position, normal: (n, 3) float32, metres, world, on the surface; face: (n,) int32 and weight: (n, 2) float32, the triangle on which
    each node lies and its barycentric weights there; area: (n,) float32, m2, its share of the surface.
    """

    cells: NDArray[np.int32]
    affine: NDArray[np.float32]
    grid: NDArray[np.int32]
    cuts: NDArray[np.float32]
    back: NDArray[np.int32]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    face: NDArray[np.int32]
    weight: NDArray[np.float32]
    area: NDArray[np.float32]


class KnownLight(NamedTuple):
    """Light that is known at nodes, for kernels; none where nothing is.

    light: (n, 4) float32, illuminance over pi of all light, cd/m2, and how much a node is worth, from 0 to 1; reach_m: how widely a ray
    must have spread where it hits, metres, for what lies between nodes not to matter.
    """

    atlas: Atlas
    light: NDArray[np.float32]
    reach_m: np.float32


_NO_NODES = Atlas(
    np.zeros((0, 4), np.int32),
    np.zeros((0, 6), np.float32),
    np.zeros(0, np.int32),
    np.zeros((0, 2), np.float32),
    np.zeros(0, np.int32),
    np.zeros((0, 3), np.float32),
    np.zeros((0, 3), np.float32),
    np.zeros(0, np.int32),
    np.zeros((0, 2), np.float32),
    np.zeros(0, np.float32),
)
NOTHING_KNOWN = KnownLight(_NO_NODES, np.zeros((0, 4), np.float32), np.float32(0.0))


@inlined
def has_back(atlas: Atlas, face: int) -> bool:
    """Return whether there are nodes on the back of a triangle."""
    kind = atlas.cells[face, 3]
    if kind == NONE:
        return False
    node = atlas.cells[face, 0]
    if kind >= STRIP:
        place = node
        while atlas.grid[place] < 0:
            place += 1
        node = atlas.grid[place]
    return bool(atlas.back[node] >= 0)


@inlined
def _is_cut_off(cuts: NDArray[np.float32], place: int, width: int, right: int, up: int, s: np.float32, r: np.float32) -> bool:
    """Return whether something stands between a hit, at (s, r) within its cell, and the corner of the cell at ``place``."""
    along, across = cuts[place - right, 0], cuts[place - up * width, 1]
    beyond_x: bool = s < along if right else s > along
    beyond_y: bool = r < across if up else r > across
    return beyond_x | beyond_y


@inlined
def find_cell(atlas: Atlas, face: int, u: np.float32, v: np.float32) -> tuple[int, np.float32, np.float32]:
    """Return the place in ``grid`` of the first corner of the cell that a hit lies in, and where in the cell, from 0 to 1."""
    offset, width, height, affine = atlas.cells[face, 0], atlas.cells[face, 1], atlas.cells[face, 2], atlas.affine
    s = affine[face, 0] + u * affine[face, 1] + v * affine[face, 2]
    r = affine[face, 3] + u * affine[face, 4] + v * affine[face, 5]
    s = min(max(s, _ZERO), np.float32(width - 1))
    r = min(max(r, _ZERO), np.float32(height - 1))
    column, row = min(int(s), max(width - 2, 0)), min(int(r), max(height - 2, 0))
    return offset + row * width + column, s - np.float32(column), r - np.float32(row)


@inlined
def find_nodes(
    atlas: Atlas, face: int, u: np.float32, v: np.float32, front: bool, nodes: NDArray[np.int32], weights: NDArray[np.float32]
) -> int:
    """Write the nodes around a hit and their weights, which sum to 1; return how many there are, up to 4.

    ``u``, ``v``: barycentric weights of the second and third corner; ``front``: whether the triangle is seen from its front.
    """
    kind, count = atlas.cells[face, 3], 0
    if kind >= STRIP:
        width, total = atlas.cells[face, 1], _ZERO
        first, s, r = find_cell(atlas, face, u, v)
        # A cell at the third side of a lattice is a triangle.
        beyond = s * r if kind == STRIP and atlas.grid[first + width + 1] < 0 else _ZERO
        for attempt in range(2):
            for corner in range(4):
                right, up = corner & 1, corner >> 1
                weight = (s if right else _ONE - s) * (r if up else _ONE - r)
                weight += beyond if right ^ up else -beyond
                if weight > _ZERO:
                    place = first + up * width + right
                    node = atlas.grid[place]
                    if node >= 0 and (attempt > 0 or not _is_cut_off(atlas.cuts, place, width, right, up, s, r)):
                        nodes[count], weights[count] = node, weight
                        count, total = count + 1, total + weight
            if count > 0:
                break
        if total < _ONE:
            for i in range(count):
                weights[i] /= total
    elif kind == CORNERS:
        nodes[0], nodes[1], nodes[2] = atlas.cells[face, 0], atlas.cells[face, 1], atlas.cells[face, 2]
        weights[0], weights[1], weights[2] = _ONE - u - v, u, v
        count = 3
    if not front:
        behind = 0
        for i in range(count):
            twin = atlas.back[nodes[i]]
            if twin >= 0:
                nodes[behind], weights[behind] = twin, weights[i]
                behind += 1
        count = behind
    return count
