"""PLY files, binary and little-endian: points with colours, meshes with normals and colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_COLORS = ("uchar red", "uchar green", "uchar blue")
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def ply_points(points: NDArray[np.float64], colors: NDArray[np.uint8]) -> bytes:
    """Return points (n, 3) with colours (n, 3) uint8."""
    rows = np.zeros(len(points), np.dtype([("place", "<f4", 3), ("color", "u1", 3)]))
    rows["place"], rows["color"] = points, colors
    properties = [*(f"float {name}" for name in "xyz"), *_COLORS]
    return _header(len(points), properties) + rows.tobytes()


def ply_mesh(vertices: NDArray[np.float32], normals: NDArray[np.float32], colors: NDArray[np.uint8], faces: NDArray[np.uint32]) -> bytes:
    """Return a mesh: vertices (n, 3), unit normals (n, 3), colours (n, 3) uint8, faces (m, 3) counter-clockwise from outside."""
    rows = np.zeros(len(vertices), np.dtype([("place", "<f4", 3), ("normal", "<f4", 3), ("color", "u1", 3)]))
    rows["place"], rows["normal"], rows["color"] = vertices, normals, colors
    corners = np.zeros(len(faces), _FACE)
    corners["count"], corners["corners"] = 3, faces
    properties = [*(f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")), *_COLORS]
    return _header(len(vertices), properties, len(faces)) + rows.tobytes() + corners.tobytes()


def _header(vertices: int, properties: list[str], faces: int | None = None) -> bytes:
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {vertices}", *(f"property {item}" for item in properties)]
    if faces is not None:
        lines += [f"element face {faces}", "property list uchar int vertex_indices"]
    return ("\n".join([*lines, "end_header"]) + "\n").encode()
