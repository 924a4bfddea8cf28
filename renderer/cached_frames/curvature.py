"""How surfaces bend across a pixel: what they mirror of all around then is shown by a wider lobe.

The normals within a pixel are a distribution of slopes that adds to that of the microfacets (Kaplanyan, Hill, Patney and Lefohn,
"Filtering Distributions of Normals for Shading Antialiasing", 2016), so thin rods and rims of glossy things do not break up into bright and
dark pixels.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import inlined
from renderer.scene.flat_scene import FlatScene

_PER_TURN, _MOST = np.float32(1.0 / 24.0), np.float32(0.03)
"""Variance of slopes, alpha^2, over the squared turn of the normals that a cone sees, which is sqrt(2) pixels wide, and the most of it:
they are spread evenly over a pixel, and mostly one way."""


def bend_of_faces(flat: FlatScene) -> NDArray[np.float32]:
    """Return how much the normals of triangles turn along the edge where they do most, (m,), 1/m."""
    corners, normals = flat.mesh.vertices[flat.mesh.faces], flat.mesh.normals[flat.mesh.faces]
    most = np.zeros(len(corners), np.float32)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        turn, length = (np.sqrt(((of[:, a] - of[:, b]) ** 2).sum(axis=1)) for of in (normals, corners))
        most = np.maximum(most, turn / np.maximum(length, np.float32(1e-6)))
    return most


@inlined
def widened(alpha: np.float32, bend: np.float32, width_m: np.float32) -> np.float32:
    """Return the width of GGX of a pixel's lobe: ``alpha`` where the surface is flat; ``bend``: 1/m; ``width_m``: of the pixel's cone."""
    turn = bend * width_m
    wide: np.float32 = np.sqrt(alpha * alpha + min(_PER_TURN * turn * turn, _MOST))
    return wide
