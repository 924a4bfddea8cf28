"""Reads the user's own mesh files (GLB, glTF, OBJ, PLY, STL) into named parts with materials.

glTF goes through our own reader (``gltf_container`` says why), the others through trimesh.
"""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path, PurePosixPath

import numpy as np

from renderer.core.errors import MeshFileError
from renderer.files.file_parts import MeshFile, Raw, assemble
from renderer.files.gltf_container import Fetch, read_container
from renderer.files.gltf_materials import read_images, read_materials
from renderer.files.gltf_meshes import read_pieces
from renderer.models.model import Parts, Size, fitted
from scene_description import FileReading, error_line

MAX_FILE_BYTES = 64_000_000
MAX_REFERRED_BYTES = 200_000_000
"""Of all files together that a model refers to, each as often as it does."""
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
    try:
        with path.open("rb") as stream:
            data = stream.read(size + 1)
        raw = _READERS[kind](data, kind, _Referred(path.parent, root).fetch)
    except MeshFileError:
        raise
    except Exception as error:  # readers raise what they like on broken data
        reason = error_line(error)[:160]
        raise MeshFileError(f"expected a readable {kind} file, got an error ({reason})") from error
    for piece in raw.pieces:
        count, low, high = len(piece.vertices), piece.faces.min(), piece.faces.max()
        if not piece.vertices.shape == piece.normals.shape == (count, 3) or low < 0 or high >= count:
            raise MeshFileError(f"expected vertices and normals of 3 numbers, and faces of these vertices, got others in '{piece.node}'")
        if not all(np.isfinite(rows).all() for rows in (piece.vertices, piece.normals, *piece.uvs.values())):
            raise MeshFileError(f"expected finite numbers, got others in '{piece.node}'")
    return raw


class _Referred:
    """The files that a model refers to, by paths from its folder; from below the root only, and within one budget."""

    def __init__(self, folder: Path, root: Path) -> None:
        self._folder, self._root, self._bytes = folder, root, 0

    def fetch(self, key: str) -> bytes:
        """Return the bytes of a file."""
        shown = repr(key[:80])
        try:
            path = (self._folder / key.strip().replace("\\", "/")).resolve()
            inside = path.is_relative_to(self._root)
        except (OSError, ValueError, RuntimeError):
            inside = False
        if not inside:
            raise MeshFileError(f"refers to {shown}: expected a path inside the catalogue")
        if not path.is_file() or path.stat().st_size > MAX_FILE_BYTES:
            raise MeshFileError(f"refers to {shown}: expected a file of at most {MAX_FILE_BYTES} bytes")
        self._bytes += path.stat().st_size
        if self._bytes > MAX_REFERRED_BYTES:
            raise MeshFileError(f"refers to {shown}: expected files of at most {MAX_REFERRED_BYTES} bytes together, got more")
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
    try:
        from renderer.files.trimesh_files import read_by_trimesh  # trimesh takes longer to import than the rest, and few files need it
    except ModuleNotFoundError as error:
        raise MeshFileError(
            f"expected the Python package {error.name}, which reads .{kind} files; run 'pip install {error.name}'"
        ) from None
    return read_by_trimesh(data, kind, fetch)


_READERS: dict[str, Callable[[bytes, str, Fetch], Raw]] = {
    "glb": _read_gltf, "gltf": _read_gltf, "obj": _read_other, "ply": _read_other, "stl": _read_other,
}  # fmt: skip
