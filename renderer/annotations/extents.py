"""How far an object reaches on the image plane, inside the image and beyond its borders.

A planar lens sees only what lies before it, so an object that reaches behind the camera has no bounded image: it is cut ``NEAR_M`` before
the camera, its edges where they cross that plane.
"""

from typing import NamedTuple

import numpy as np

from renderer.annotations.object_meshes import ObjectMeshes
from renderer.annotations.projection import Projection
from renderer.core.arrays import Array

NEAR_M = 0.05
"""Optical z of the plane at which objects are cut, unless another is asked for."""


class Extent(NamedTuple):
    """A rectangle of the image plane, image coordinates; NaN where nothing of the object lies before the camera.

    ``whole``: no part of the object was cut away, so that nothing of it is seen outside the rectangle.
    """

    left: float
    top: float
    right: float
    bottom: float
    whole: bool


def project_extent(meshes: ObjectMeshes, key: int, projection: Projection, near_m: float = NEAR_M) -> Extent:
    """Return what an object's projected triangles span; ``near_m``: optical z of the plane at which it is cut."""
    mesh = meshes.mesh(key)
    points = mesh.vertices if projection.is_straight else meshes.outline(key)
    optical = projection.see(points.astype(np.float64)).optical_m
    cut = False
    if projection.is_planar:
        ahead = optical[:, 2] >= near_m
        cut = not bool(ahead.all())
        if cut:
            optical = np.concatenate([optical[ahead], _crossings(optical[: len(mesh.vertices)], mesh.faces.astype(np.int64), near_m)])
    places = projection.place(optical)
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return Extent(np.nan, np.nan, np.nan, np.nan, False)
    (left, top), (right, bottom) = places.min(axis=0), places.max(axis=0)
    return Extent(float(left), float(top), float(right), float(bottom), not cut)


def _crossings(optical_m: Array, faces: Array, near_m: float) -> Array:
    """Return where the edges of triangles cross the plane at ``near_m``, (n, 3), optical frame."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    sides = optical_m[:, 2] >= near_m
    a, b = optical_m[edges[sides[edges[:, 0]] != sides[edges[:, 1]]]].transpose(1, 0, 2)
    share = (near_m - a[:, 2]) / (b[:, 2] - a[:, 2])
    crossings: Array = a + share[:, None] * (b - a)
    return crossings
