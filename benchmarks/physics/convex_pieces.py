"""Meshes as convex pieces: the hulls of their connected components, of parts of a component where that is hollow or bent."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

WELD_M, LEAST_M, THIN_M = 1e-5, 0.003, 0.0004
"""Corners nearer than the first are one; what is smaller than the second is left out, what is thinner than the third as thick as that."""
DEEPEST_M, MOST_SPLITS = 0.003, 5
"""So deep a face may lie below the hull of its piece, and so many times in a row a piece is cut in two."""
BOX_SHARE = 0.97
"""A hull that fills so much of the box around it is that box."""


class Piece(NamedTuple):
    """A convex piece: the corners (n, 3) of its hull, or of the box that it is."""

    corners: NDArray[np.float64]
    is_box: bool


def convex_pieces(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> list[Piece]:
    """Return the pieces of a mesh with vertices (v, 3), metres, and faces (f, 3)."""
    _, first, welded = np.unique(np.rint(vertices / WELD_M).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    points, corners = np.asarray(vertices, np.float64)[first], welded.ravel()[faces]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(points), len(points)))
    component = connected_components(graph, directed=False)[1][corners[:, 0]]
    return [piece for one in np.unique(component) for piece in _pieces(points, corners[component == one], MOST_SPLITS)]


def _pieces(points: NDArray[np.float64], faces: NDArray[np.integer], splits: int) -> list[Piece]:
    own = points[np.unique(faces)]
    if np.ptp(own, axis=0).max() < LEAST_M:
        return []
    hull = ConvexHull(_thickened(own))
    middles = points[faces].mean(1)
    below = -(middles @ hull.equations[:, :3].T + hull.equations[:, 3]).max(1)
    if below.max() > DEEPEST_M and splits and len(faces) > 1:
        axis = int(np.argmax(np.ptp(middles, axis=0)))
        lower = middles[:, axis] < np.median(middles[:, axis])
        if lower.any():
            return [piece for part in (faces[lower], faces[~lower]) for piece in _pieces(points, part, splits - 1)]
    low, high = hull.points.min(0), hull.points.max(0)
    if hull.volume > BOX_SHARE * np.prod(high - low):
        return [Piece(np.array([low, high]), True)]
    return [Piece(hull.points[hull.vertices], False)]


def _thickened(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points, those of a flat piece on both sides of it."""
    axes = np.linalg.svd(points - points.mean(0), full_matrices=len(points) < 3)[2]
    off = (points - points.mean(0)) @ axes.T
    thin = np.flatnonzero(np.ptp(off, axis=0) < THIN_M)
    for axis in thin:
        points = np.concatenate([points + 0.5 * THIN_M * axes[axis], points - 0.5 * THIN_M * axes[axis]])
    return points
