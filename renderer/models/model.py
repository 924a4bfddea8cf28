"""What a model is: a generator of named parts with its styles, and the last step that fits the parts to their box."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import BEVEL_M, blocks, merged, stretched

Size = tuple[float, float, float]

Parts = dict[str, Mesh]
Pieces = Mapping[str, Mesh | Sequence[Mesh]]
"""Part name -> its mesh, or the meshes that it consists of."""

CORNERS = ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))
"""Signs of x and y at the corners of a footprint."""


class Model(NamedTuple):
    """A procedural family of furniture.

    build: (rng, size_m, style) -> part name -> meshes in the object's own frame (origin at the centre of the bottom face, front +x, size =
    depth along x, width along y, height), before they are fitted to the box.  The set of parts depends on the style only.  styles: the
    known styles; the first is the default.
    """

    build: Callable[[np.random.Generator, Size, str], Pieces]
    styles: tuple[str, ...]


def halved(size_m: Size) -> tuple[float, float, float, float, float]:
    """Return depth, width and height of a box, and half its depth and half its width."""
    depth, width, height = size_m
    return depth, width, height, 0.5 * depth, 0.5 * width


def side_boards(half_w: float, thick: float, x: tuple[float, float], z: tuple[float, float], bevel_m: float = BEVEL_M) -> Mesh:
    """Return two boards, ``thick`` along y, inside both ends of the width: between two x and between two z."""
    return blocks([(x[0], -half_w, z[0]), (x[0], half_w - thick, z[0])], [(x[1], -half_w + thick, z[1]), (x[1], half_w, z[1])], bevel_m)


def fitted(pieces: Pieces, size_m: Size) -> Parts:
    """Return the parts, each of one mesh, stretched together so that their common bounding box is exactly the object's box."""
    parts = {name: piece if isinstance(piece, Mesh) else merged(*piece) for name, piece in pieces.items()}
    low = np.min([mesh.vertices.min(axis=0) for mesh in parts.values()], axis=0).astype(np.float64)
    high = np.max([mesh.vertices.max(axis=0) for mesh in parts.values()], axis=0).astype(np.float64)
    size = np.asarray(size_m, np.float64)
    scale = size / np.maximum(high - low, 1e-9)
    shift = np.array([-0.5, -0.5, 0.0]) * size - low * scale
    return {name: stretched(mesh, scale, shift) for name, mesh in parts.items()}
