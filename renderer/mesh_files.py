"""Reads the user's own mesh files (GLB, glTF, OBJ, PLY, STL) into named parts with materials; the only file that imports trimesh.

glTF goes through our own reader (``gltf_container`` says why), the others through trimesh after a look at their size.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import trimesh

from renderer.errors import MeshFileError
from renderer.file_parts import MeshFile, Raw, assemble
from renderer.gltf_container import Fetch, read_container
from renderer.gltf_materials import FileMaterial, read_images, read_materials
from renderer.gltf_meshes import MAX_FACES, MAX_VERTICES, Piece, read_pieces
from renderer.models.model import Parts, Size, fitted
from renderer.mtl import read_mtl
from renderer.ply_header import check_ply
from scene_description import FileReading

MAX_FILE_BYTES = 64_000_000
MAX_TEXT_BYTES = 20_000_000
"""Of OBJ files and text forms of PLY and STL, which take some ten times their size in memory."""
FORMATS = ("glb", "gltf", "obj", "ply", "stl")


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


def load_mesh_file(path: Path, root: Path, size_m: Size, reading: FileReading | None = None) -> Parts:
    """Return the file's parts by name, stretched together to the box ``size_m`` of an object.

    Texture coordinates are those of the file where the part's material has images (1 is one image), else they are missing.
    Files that it refers to (buffers, images, material libraries) are read from below ``root`` only.

    Raises:
        MeshFileError: unknown format, too large, broken, empty, or with numbers that are not finite.
    """
    parts = read_mesh_file(path, root, reading or FileReading()).parts
    whole = fitted({name: part.mesh for name, part in parts.items()}, size_m)
    return {name: mesh._replace(uvs=parts[name].mesh.uvs) for name, mesh in whole.items()}


def read_mesh_file(path: Path, root: Path, reading: FileReading) -> MeshFile:
    """Read a model file; see :func:`load_mesh_file`.

    Raises:
        MeshFileError: as there; one line with the file's name.
    """
    kind = path.suffix.lower().lstrip(".")
    name = path.name
    if kind not in FORMATS:
        raise MeshFileError(f"model file '{name}': expected one of {', '.join(FORMATS)}, got '{kind}'")
    state = path.stat()
    if state.st_size > MAX_FILE_BYTES:
        raise MeshFileError(f"model file '{name}': expected at most {MAX_FILE_BYTES} bytes, got {state.st_size}")
    try:
        read = _read_once if kind in ("glb", "ply", "stl") else _read_once.__wrapped__  # others refer to files that may change
        raw = read(path, root.resolve(), kind, state.st_mtime_ns, state.st_size)
        return assemble(raw, reading, kind in ("glb", "gltf"))
    except MeshFileError as error:
        text = str(error)
        raise MeshFileError(text if text.startswith("model file ") else f"model file '{name}': {text}") from None


@lru_cache(maxsize=16)
def _read_once(path: Path, root: Path, kind: str, mtime_ns: int, size: int) -> Raw:
    """Read a file; time and size are there to tell versions apart."""
    fetch = partial(_fetch, path.parent, root)
    try:
        with path.open("rb") as stream:
            data = stream.read(size + 1)
        raw = _READERS[kind](data, kind, fetch)
    except MeshFileError:
        raise
    except Exception as error:  # readers raise what they like on broken data
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise MeshFileError(f"expected a readable {kind} file, got an error ({reason})") from error
    for piece in raw.pieces:
        if not all(np.isfinite(rows).all() for rows in (piece.vertices, piece.normals, *piece.uvs.values())):
            raise MeshFileError(f"expected finite numbers, got others in '{piece.node}'")
    return raw


def _fetch(folder: Path, root: Path, key: str) -> bytes:
    """Return the bytes of a file that a model refers to, from below the root only."""
    shown = repr(key[:80])
    try:
        path = (folder / key.strip().replace("\\", "/")).resolve()
        inside = path.is_relative_to(root)
    except (OSError, ValueError, RuntimeError):
        inside = False
    if not inside:
        raise MeshFileError(f"refers to {shown}: expected a path inside the catalogue")
    if not path.is_file() or path.stat().st_size > MAX_FILE_BYTES:
        raise MeshFileError(f"refers to {shown}: expected a file of at most {MAX_FILE_BYTES} bytes")
    return path.read_bytes()


def _read_gltf(data: bytes, kind: str, fetch: Fetch) -> Raw:
    container = read_container(data, kind == "glb", fetch)
    pieces = read_pieces(container)
    materials = read_materials(container)
    used = {piece.material for piece in pieces}
    uses = [
        use
        for i, item in enumerate(materials)
        if i in used
        for use in (item.base_image, item.metallic_roughness_image, item.normal_image)
        if use is not None
    ]
    return Raw(pieces, materials, read_images(container, {use.image for use in uses}))


def _read_other(data: bytes, kind: str, fetch: Fetch) -> Raw:
    """Read OBJ, PLY or STL by trimesh, which gets no files beside the OBJ's material library, and of that no images."""
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


_READERS: dict[str, Callable[[bytes, str, Fetch], Raw]] = {
    "glb": _read_gltf, "gltf": _read_gltf, "obj": _read_other, "ply": _read_other, "stl": _read_other,
}  # fmt: skip


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
        red, green, blue = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
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
