"""The triangle mesh that everything solid is made of, its volume and area."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.arrays import Array
from scene_description.products import dot

UNMAPPED = np.zeros((0, 2), np.float32)
"""Texture coordinates of a mesh that has none yet."""


class Mesh(NamedTuple):
    """An indexed triangle mesh with shading normals; hard edges have split vertices, as in glTF.

    vertices: (n, 3) float32, metres; normals: (n, 3) float32, unit, outward; faces: (m, 3) uint32, counter-clockwise from outside;
    uvs: (n, 2) float32, texture coordinates in metres along the surface, u along the grain.  Where a mesh is made they may be missing,
    as ``UNMAPPED`` or rows of NaN: ``renderer.geometry.coordinates.box_mapped`` fills them in; in a flat scene they are complete.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    faces: NDArray[np.uint32]
    uvs: NDArray[np.float32] = UNMAPPED


def doubled_areas(points: Array, faces: NDArray[np.integer]) -> Array:
    """Return the normals (m, 3) of triangles, as long as their doubled area."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (points[faces[:, k]].T for k in range(3))
    bx, by, bz, cx, cy, cz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    return np.stack([by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx], axis=1)


def signed_volume(mesh: Mesh) -> float:
    """Return the volume enclosed by a closed mesh, m3; positive when its faces look outward."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    return float(dot(a, np.cross(b, c)).sum() / 6.0)


def surface_area(mesh: Mesh) -> float:
    """Return the total area of the mesh, m2."""
    return float(0.5 * np.linalg.norm(doubled_areas(mesh.vertices.astype(np.float64), mesh.faces), axis=1).sum())
