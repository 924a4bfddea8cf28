"""The triangle mesh that everything solid is made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
