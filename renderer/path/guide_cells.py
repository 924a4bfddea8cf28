"""The cells of the guide: which there are on a scene's surfaces, where, and how they face."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.core.random_numbers import mix_bits
from renderer.core.sampling import coordinate_system
from renderer.path.guide import SPACING_M, WEIGHTS, Guide, cell_key
from renderer.scene.flat_scene import FlatScene

_POINTS_PER_CELL, _FEWEST = 64, 3
"""Of a voxel's flat side; of what is a cell at all."""
_MOST_POINTS, _MOST_CELLS = 1 << 19, 1 << 14


class CellPoints(NamedTuple):
    """Points on the surfaces of cells, cell by cell.

    points: (n, 3) float32, metres, world; normals: (n, 3) float32, unit, of the triangles there; start: (g + 1,) int64, where the points
    of each of g cells begin.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    start: NDArray[np.int64]


def make_cells(flat: FlatScene) -> tuple[Guide, CellPoints]:
    """Return the cells of a scene, with weights of 1 and no light yet, and points on them; of a vast scene those with the most of it."""
    points, normals = _spread_points(flat)
    keys = np.zeros(len(points), np.int32)
    number_cells(points, normals, keys)
    unique, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
    kept = counts >= _FEWEST
    if kept.sum() > _MOST_CELLS:
        kept &= counts > np.sort(counts)[-_MOST_CELLS - 1]
    unique, cell = unique[kept], np.where(kept, np.cumsum(kept) - 1, -1)[inverse]
    chosen = np.flatnonzero(cell >= 0)
    order = chosen[np.argsort(cell[chosen], kind="stable")]
    start = np.searchsorted(cell[order], np.arange(len(unique) + 1)).astype(np.int64)
    sums = [np.bincount(cell[order], normals[order, axis], len(unique)) for axis in range(3)]
    mean = np.stack(sums, axis=1).astype(np.float64)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-30)
    keys, rows = np.full((2, 1 << int(2 * len(unique) + 1).bit_length()), -1, np.int32)
    fill_table(unique, keys, rows)
    frame = np.zeros((len(unique), 9), np.float32)
    fill_frames(mean.astype(np.float32), frame)
    guide = Guide(keys, rows, frame.reshape(-1), np.ones(len(unique) * WEIGHTS, np.float32), np.zeros(len(unique), np.float32))
    return guide, CellPoints(points[order], normals[order], start)


def _spread_points(flat: FlatScene) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return points (n, 3) and unit normals (n, 3), evenly over all surfaces (Roberts' R2 sequence)."""
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1)
    area = np.cumsum(0.5 * length)
    total = float(area[-1]) if len(area) else 0.0
    number = np.arange(min(int(np.ceil(total / float(SPACING_M) ** 2 * _POINTS_PER_CELL)), _MOST_POINTS))
    face = np.searchsorted(area, (number + 0.5) / max(len(number), 1) * total).clip(0, max(len(area) - 1, 0))
    u, v = (0.5 + number * 0.7548776662466927) % 1.0, (0.5 + number * 0.5698402909980532) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points = corners[face, 0] + u[:, None] * (corners[face, 1] - corners[face, 0]) + v[:, None] * (corners[face, 2] - corners[face, 0])
    return points.astype(np.float32), (cross[face] / np.maximum(length[face, None], 1e-30)).astype(np.float32)


@entry
def number_cells(points: NDArray[np.float32], normals: NDArray[np.float32], keys: NDArray[np.int32]) -> None:
    """Fill the key of each point's cell."""
    for i in range(len(points)):
        keys[i] = cell_key(points[i, 0], points[i, 1], points[i, 2], normals[i, 0], normals[i, 1], normals[i, 2])


@entry
def fill_table(unique: NDArray[np.int32], keys: NDArray[np.int32], rows: NDArray[np.int32]) -> None:
    """Enter different keys and their rows into an empty hash table, whose size is a power of two."""
    last = len(keys) - 1
    for row in range(len(unique)):
        at = int(mix_bits(np.uint32(unique[row]))) & last
        while keys[at] >= 0:
            at = at + 1 & last
        keys[at], rows[at] = unique[row], row


@entry
def fill_frames(normals: NDArray[np.float32], frame: NDArray[np.float32]) -> None:
    """Fill tangents, bitangents and normals."""
    for i in range(len(normals)):
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        frame[i, 0], frame[i, 1], frame[i, 2], frame[i, 3], frame[i, 4], frame[i, 5] = coordinate_system(x, y, z)
        frame[i, 6], frame[i, 7], frame[i, 8] = x, y, z
