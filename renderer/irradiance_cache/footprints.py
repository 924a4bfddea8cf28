"""Footprints of nodes: how much of the surface each stands for, and from which place in it a node sees where light changes within it.

A node stands for the points that read it, by their weights.  On slats, glazing bars and their flanks light changes several times over from
rim to rim: a node amid them, or two near the rims, would be wrong in the mean, and on all slats of a blind alike.  There a place is drawn
by weight: what falls on it is in expectation what falls on the footprint (a Monte Carlo estimate of one sample).
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.core.random_numbers import mix_bits, unit_of
from renderer.geometry.mesh import Mesh
from renderer.irradiance_cache.atlas import place_nodes
from renderer.path.light_nodes import GRID, NONE, STRIP, Atlas, find_nodes

_HALF = np.float32(0.5)
_NARROW = 2
"""Nodes across a flat region, up to which places are drawn there."""


def changes_within(atlas: Atlas, near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return on which triangles (m,) light may change between rim and rim of a footprint.

    That is on curved ones, on flat regions that are narrow, and on such as are ``near`` (m,) what casts narrow shadows.
    """
    narrow = atlas.cells[:, 1:3].min(axis=1) <= _NARROW
    return np.asarray((atlas.cells[:, 3] != GRID) | narrow | near)


def measure_nodes(atlas: Atlas, mesh: Mesh, face_area: NDArray[np.float64], is_drawn: NDArray[np.bool_], key: np.uint32) -> None:
    """Fill ``area`` with each node's share of the surface, both sides of one alike, and draw places on triangles that ``is_drawn`` (m,).

    ``face_area``: (m,), m2; ``key``: of random numbers.
    """
    area, drawn, at = np.zeros(len(atlas.face)), np.full(len(atlas.face), -1, np.int32), np.zeros((len(atlas.face), 2), np.float32)
    spread_area(atlas, face_area, is_drawn, key, np.zeros(4, np.int32), np.zeros(4, np.float32), area, drawn, at)
    fronts = np.flatnonzero(atlas.back >= 0)
    for values in (area, drawn, at):
        values[atlas.back[fronts]] = values[fronts]
    atlas.area[:] = area
    moved = np.flatnonzero(drawn >= 0)
    atlas.face[moved], atlas.weight[moved] = drawn[moved], at[moved]
    atlas.position[moved] = place_nodes(mesh, drawn[moved], at[moved])
    # A place has the normal of its triangle: that of a node is a mean over all that look alike.
    corners = mesh.vertices.astype(np.float64)[mesh.faces[drawn[moved]]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = (normal * atlas.normal[moved]).sum(axis=1)
    proper, length = along != 0.0, np.sqrt((normal * normal).sum(axis=1))
    atlas.normal[moved[proper]] = (np.sign(along) / np.maximum(length, 1e-30))[proper, None] * normal[proper]


@entry
def spread_area(
    atlas: Atlas,
    face_area: NDArray[np.float64],
    is_drawn: NDArray[np.bool_],
    key: np.uint32,
    nodes: NDArray[np.int32],
    weights: NDArray[np.float32],
    area: NDArray[np.float64],
    drawn: NDArray[np.int32],
    at: NDArray[np.float32],
) -> None:
    """Add the area of triangles, (m,), m2, to the nodes, (n,), that their points read, by weight: at 4 points for each of their cells.

    Where ``is_drawn`` (m,) at some 36, anywhere, of which each node keeps one by its share of the area (a weighted reservoir): the triangle
    in ``drawn`` (n,), barycentric weights in ``at`` (n, 2).  ``nodes``, ``weights``: (4,), memory.
    """
    affine = atlas.affine
    for face in range(len(face_area)):
        if atlas.cells[face, 3] == NONE:
            continue
        widest = max(abs(affine[face, 1]), abs(affine[face, 2]), abs(affine[face, 4]), abs(affine[face, 5]))
        steps = 2 * int(widest) + 2 if atlas.cells[face, 3] >= STRIP else 1
        if is_drawn[face]:
            cells = 0.5 * abs(affine[face, 1] * affine[face, 5] - affine[face, 2] * affine[face, 4])
            steps = max(int(np.ceil(6.0 * np.sqrt(cells))), 4) if atlas.cells[face, 3] >= STRIP else 2
        share = face_area[face] / (steps * steps)
        seed = mix_bits(np.uint32(mix_bits(np.uint32(face)) ^ key))
        for i in range(steps):
            for j in range(steps):
                a = b = _HALF
                if is_drawn[face]:
                    seed = mix_bits(np.uint32(seed + np.uint32(1)))
                    a, b = unit_of(seed), unit_of(mix_bits(seed))
                u, v = (np.float32(i) + a) / np.float32(steps), (np.float32(j) + b) / np.float32(steps)
                u, v = (u, v) if u + v < np.float32(1.0) else (np.float32(1.0) - u, np.float32(1.0) - v)
                if steps == 1:
                    u = v = np.float32(1.0 / 3.0)
                for k in range(find_nodes(atlas, face, u, v, True, nodes, weights)):
                    node, gain = nodes[k], share * weights[k]
                    area[node] += gain
                    seed = mix_bits(np.uint32(seed + np.uint32(1)))
                    if is_drawn[face] and unit_of(seed) * area[node] < gain:
                        drawn[node], at[node, 0], at[node, 1] = face, u, v
