"""Texture coordinates for meshes that were made without: a projection along the axis that each triangle faces most."""

from __future__ import annotations

import numpy as np

from renderer.geometry.mesh import Mesh


def box_mapped(mesh: Mesh) -> Mesh:
    """Return the mesh with texture coordinates at every vertex; those that it has stay.

    Triangles with a vertex without any are projected along the axis of the mesh's own frame that their normal is nearest to, u along the
    longer of the two other sides of the mesh's bounding box; vertices are split where neighbours take different axes.
    """
    uvs = mesh.uvs if len(mesh.uvs) else np.full((len(mesh.vertices), 2), np.nan, np.float32)
    known = np.isfinite(uvs[:, 0]) & np.isfinite(uvs[:, 1])
    if known.all():
        return mesh
    lost = np.flatnonzero(~known[mesh.faces].all(axis=1))
    index = mesh.faces[lost].astype(np.int64)
    points = mesh.vertices.astype(np.float64)
    corners = points[index]
    axis = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).argmax(axis=1)
    extent = np.ptp(points, axis=0)
    planes = np.array([sorted(((k + 1) % 3, (k + 2) % 3), key=lambda j: -extent[j]) for k in range(3)])
    key, place = np.unique(3 * index + axis[:, None], return_inverse=True)
    source, plane = key // 3, planes[key % 3]
    projected = np.take_along_axis(points[source], plane, axis=1).astype(np.float32)
    split = Mesh(mesh.vertices[source], mesh.normals[source], place.reshape(-1, 3).astype(np.uint32), projected)
    if len(lost) == len(mesh.faces):
        return split
    faces = mesh.faces.copy()
    faces[lost] = split.faces + np.uint32(len(points))
    kept = np.where(known[:, None], uvs, np.float32(0.0))
    return Mesh(
        np.concatenate([mesh.vertices, split.vertices]),
        np.concatenate([mesh.normals, split.normals]),
        faces,
        np.concatenate([kept, projected]),
    )
