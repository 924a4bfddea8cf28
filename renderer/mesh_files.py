"""Reads the user's own mesh files (GLB, glTF, OBJ, PLY, STL) into named parts; the only file that imports trimesh.

glTF files follow their standard: y up, front along +z.  The other formats are read as they stand: z up, front along +x.
"""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import trimesh

from renderer.flat_scene import Mesh
from renderer.models.model import Parts, Size, fitted
from renderer.shapes import make_mesh

MAX_FILE_BYTES = 64_000_000
MAX_FACES = 500_000
MAX_PARTS = 64
FORMATS = ("glb", "gltf", "obj", "ply", "stl")
_OURS_FROM_GLTF = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


class MeshFileError(ValueError):
    """A mesh file that cannot be used; the text is one line with the file, what was expected and what was found."""


def find_mesh_file(catalog_dir: Path, relative: str) -> Path:
    """Return the real path of a catalogue's file.

    Raises:
        MeshFileError: the path leaves the catalogue (also through symbolic links) or names no file.
    """
    root = catalog_dir.resolve()
    if PurePosixPath(relative).is_absolute():
        raise MeshFileError(f"model file '{relative}': expected a path inside the catalogue, got an absolute one")
    path = (root / relative).resolve()
    if not path.is_relative_to(root):
        raise MeshFileError(f"model file '{relative}': expected a path inside the catalogue, got one that leads out of {root}")
    if not path.is_file():
        raise MeshFileError(f"model file '{relative}': expected a file in {root}, found none")
    return path


def load_mesh_file(path: Path, root: Path, size_m: Size) -> Parts:
    """Return the file's meshes by node name, stretched to the box ``size_m`` of an object.

    Files that it refers to (buffers) are read from below ``root`` only.

    Raises:
        MeshFileError: unknown format, too large, broken, empty, or with numbers that are not finite.
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise MeshFileError(f"model file '{path.name}': expected one of {', '.join(FORMATS)}, got '{kind}'")
    size = path.stat().st_size
    if size > MAX_FILE_BYTES:
        raise MeshFileError(f"model file '{path.name}': expected at most {MAX_FILE_BYTES} bytes, got {size}")
    try:
        with path.open("rb") as stream:
            loaded = trimesh.load_scene(
                stream, file_type=kind, resolver=_Inside(path.parent, root.resolve()), process=False, skip_materials=True
            )
        parts = _parts(path.name, loaded, kind in ("glb", "gltf"))
    except MeshFileError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise MeshFileError(f"model file '{path.name}': expected a readable {kind} file, got an error ({reason})") from error
    return fitted(parts, size_m)


class _Inside(trimesh.resolvers.Resolver):  # type: ignore[misc]
    """Reads the files that a mesh refers to, from below one folder only."""

    def __init__(self, folder: Path, root: Path) -> None:
        self._folder, self._root = folder, root

    def get(self, key: str) -> bytes:
        path = (self._folder / key.strip()).resolve()
        if not path.is_relative_to(self._root):
            raise MeshFileError(f"model file refers to '{key[:80]}': expected a path inside the catalogue")
        if not path.is_file() or path.stat().st_size > MAX_FILE_BYTES:
            raise MeshFileError(f"model file refers to '{key[:80]}': expected a file of at most {MAX_FILE_BYTES} bytes")
        return path.read_bytes()

    def write(self, name: str, data: bytes) -> None:
        raise MeshFileError(f"model file: expected to be read only, got a request to write '{name[:80]}'")

    def keys(self) -> list[str]:
        return []

    def namespaced(self, namespace: str) -> _Inside:
        return _Inside(self._folder / namespace, self._root)


def _parts(name: str, loaded: Any, y_up: bool) -> Parts:
    """Collect the scene's triangle meshes by node name, checked."""
    parts: Parts = {}
    total = 0
    for node in sorted(loaded.graph.nodes_geometry):
        transform, key = loaded.graph[node]
        geometry = loaded.geometry[key]
        if not isinstance(geometry, trimesh.Trimesh) or len(geometry.faces) == 0:
            continue
        total += len(geometry.faces)
        if total > MAX_FACES:
            raise MeshFileError(f"model file '{name}': expected at most {MAX_FACES} triangles, got more")
        if len(parts) >= MAX_PARTS:
            raise MeshFileError(f"model file '{name}': expected at most {MAX_PARTS} nodes with meshes, got more")
        mesh = _placed(geometry, np.asarray(transform, np.float64), y_up)
        if not np.isfinite(mesh.vertices).all() or len(mesh.faces) == 0:
            raise MeshFileError(f"model file '{name}': expected finite triangles with an area in node '{node}', got none")
        parts[_part_name(str(node), parts)] = mesh
    if not parts:
        raise MeshFileError(f"model file '{name}': expected at least one triangle, got none")
    return parts


def _placed(geometry: Any, transform: np.ndarray[Any, np.dtype[np.float64]], y_up: bool) -> Mesh:
    turn = _OURS_FROM_GLTF if y_up else np.eye(3)
    linear = turn @ transform[:3, :3]
    points = np.asarray(geometry.vertices, np.float64) @ linear.T + turn @ transform[:3, 3]
    normals = np.asarray(geometry.vertex_normals, np.float64) @ np.linalg.inv(linear)
    faces = np.asarray(geometry.faces)
    if np.linalg.det(linear) < 0.0:
        faces = faces[:, ::-1]
    if not np.isfinite(points).all():
        return Mesh(points.astype(np.float32), normals.astype(np.float32), faces.astype(np.uint32))
    return make_mesh(points, normals, faces)


def _part_name(node: str, taken: Parts) -> str:
    """Return a part name that fits scene descriptions: plain characters, unique."""
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in node)[:100] or "part"
    name, count = plain, 1
    while name in taken:
        count += 1
        name = f"{plain}_{count}"
    return name
