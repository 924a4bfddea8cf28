"""Reads OBJ, PLY and STL files by trimesh, after a look at their size; the only file that imports trimesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import trimesh

from renderer.core.color import linear_from_srgb
from renderer.core.errors import MeshFileError
from renderer.files.file_parts import Raw
from renderer.files.gltf_container import Fetch
from renderer.files.gltf_materials import FileMaterial
from renderer.files.gltf_meshes import MAX_FACES, MAX_VERTICES, Piece
from renderer.files.mtl import read_mtl
from renderer.files.ply_header import check_ply

MAX_TEXT_BYTES = 20_000_000
"""Of OBJ files and text forms of PLY and STL, which take some ten times their size in memory."""


def read_by_trimesh(data: bytes, kind: str, fetch: Fetch) -> Raw:
    """Return the parts of an OBJ, PLY or STL file; trimesh gets no files beside the OBJ's material library, and of that no images.

    Raises:
        MeshFileError: it is too large, or its material library is broken; broken files raise whatever trimesh does.
    """
    if kind == "ply":
        check_ply(data)
    text = kind == "obj" or b"ascii" in data[:200] or (kind == "stl" and data[:6].lower() == b"solid ")
    if text and len(data) > MAX_TEXT_BYTES:
        raise MeshFileError(f"expected at most {MAX_TEXT_BYTES} bytes of text, got {len(data)}; save it as binary")
    if kind == "obj":
        _check_obj(data)
    library = _Library(fetch)
    options: dict[str, Any] = {"resolver": library, "split_objects": True} if kind == "obj" else {}
    loaded = trimesh.load_scene(trimesh.util.wrap_as_stream(data), file_type=kind, process=False, **options)
    if library.fault is not None:
        raise library.fault
    pieces = []
    for node in sorted(loaded.graph.nodes_geometry):
        geometry = loaded.geometry[loaded.graph[node][1]]
        if not isinstance(geometry, trimesh.Trimesh) or len(geometry.faces) == 0:
            continue
        if len(geometry.faces) > MAX_FACES or len(geometry.vertices) > MAX_VERTICES:
            raise MeshFileError(f"expected at most {MAX_FACES} triangles, got more")
        pieces.append(_piece(str(node), geometry, library.names))
    if sum(len(piece.faces) for piece in pieces) > MAX_FACES:
        raise MeshFileError(f"expected at most {MAX_FACES} triangles, got more")
    return Raw(tuple(pieces), library.materials, library.images)


def _check_obj(data: bytes) -> None:
    """Count an OBJ's statements before they are parsed."""
    for word, most in (
        (b"f", MAX_FACES),
        (b"v ", MAX_VERTICES),
        (b"vt", MAX_VERTICES),
        (b"vn", MAX_VERTICES),
        (b"o", 512),
        (b"usemtl", 512),
    ):
        count = data.count(b"\n" + word)
        if count > most:
            raise MeshFileError(f"expected at most {most} lines with '{word.decode().strip()}', got {count}")


class _Library(trimesh.resolvers.Resolver):  # type: ignore[misc]
    """Hands trimesh the material names of an OBJ's library and nothing else; keeps what it says of them."""

    def __init__(self, fetch: Fetch) -> None:
        self._fetch = fetch
        self.materials: tuple[FileMaterial, ...] = ()
        self.images: dict[int, bytes] = {}
        self.names: dict[str, int] = {}
        self.fault: MeshFileError | None = None

    def get(self, key: str) -> bytes:
        try:
            self.materials, self.images = read_mtl(self._fetch(key), self._fetch)
        except MeshFileError as error:  # trimesh goes on without materials whatever is raised here
            self.fault = error
            raise
        self.names = {material.name: i for i, material in enumerate(self.materials)}
        return "".join(f"newmtl {name}\nKd 1 1 1\n" for name in self.names).encode()

    def write(self, name: str, data: bytes) -> None:
        raise MeshFileError(f"expected to be read only, got a request to write '{name[:80]}'")

    def keys(self) -> list[str]:
        return []

    def namespaced(self, namespace: str) -> _Library:
        return self


def _piece(node: str, geometry: Any, names: Mapping[str, int]) -> Piece:
    visual = geometry.visual
    material = getattr(getattr(visual, "material", None), "name", None)
    uvs = getattr(visual, "uv", None)
    color = (1.0, 1.0, 1.0)
    if visual.kind == "vertex" and names == {}:
        encoded = np.asarray(visual.vertex_colors, np.float64)[:, :3].mean(axis=0) / 255.0
        red, green, blue = linear_from_srgb(encoded)
        color = (float(red), float(green), float(blue))
    usable = uvs is not None and np.shape(uvs) == (len(geometry.vertices), 2)
    return Piece(
        node=node,
        vertices=np.asarray(geometry.vertices, np.float64),
        normals=np.asarray(geometry.vertex_normals, np.float64),
        faces=np.asarray(geometry.faces, np.int64),
        material=names.get(str(material)),
        uvs={0: np.asarray(uvs, np.float64) * (1.0, -1.0) + (0.0, 1.0)} if usable else {},
        color=color,
    )
