"""From the triangles of a model file to named parts in our axes, each with one material."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.errors import MeshFileError
from renderer.files.gltf_materials import FileMaterial
from renderer.files.gltf_meshes import Piece
from renderer.geometry.mesh import UNMAPPED, Mesh
from renderer.geometry.shapes import make_mesh, merged
from scene_description import FileReading
from scene_description.products import matmul

MAX_PARTS = 64
PLAIN = FileMaterial(name="plain", base_color=(0.6, 0.6, 0.6), roughness=0.7, metallic=0.0)
"""Material of triangles to which a file gives none."""
WHITE = (1.0, 1.0, 1.0)
_AXES = {f"{sign}{axis}": (1.0 if sign == "+" else -1.0) * np.eye(3)[k] for sign in "+-" for k, axis in enumerate("xyz")}


class Raw(NamedTuple):
    """A file as it stands: pieces in its own axes, materials, encoded images by index."""

    pieces: tuple[Piece, ...]
    materials: tuple[FileMaterial, ...]
    images: Mapping[int, bytes]


class FilePart(NamedTuple):
    """A part in the axes of our objects (front +x, up z); its largest extent is about 1; ``material`` is a row of the file's materials.

    Texture coordinates are there where the material has images, 1 being one image, v upward from its lower edge.
    """

    mesh: Mesh
    material: int


class MeshFile(NamedTuple):
    """A model file: its parts by name, in the order of the file, its materials, its encoded images by index.

    size: depth, width, height in the file's units.
    """

    parts: Mapping[str, FilePart]
    materials: tuple[FileMaterial, ...]
    images: Mapping[int, bytes]
    size: tuple[float, float, float]


def assemble(raw: Raw, reading: FileReading, is_gltf: bool) -> MeshFile:
    """Turn the pieces into our axes, and join them to parts by their names and materials.

    Raises:
        MeshFileError: nothing has an area, or there are too many parts.
    """
    turn = _turn(reading, is_gltf)
    materials = list(raw.materials)
    rows: dict[tuple[int | None, tuple[float, float, float]], int] = {}
    groups: dict[tuple[str, int], list[tuple[Piece, int]]] = {}
    for piece in raw.pieces:
        row = _material_row(piece, raw.materials, materials, rows)
        source = {"nodes": piece.node, "materials": materials[row].name, "none": "body"}[reading.split]
        name = _plain(_renamed(source, reading.rename))
        groups.setdefault((name, row if reading.own_materials else -1), []).append((piece, row))
    if not groups:
        raise MeshFileError("expected at least one triangle, got none")
    if len(groups) > MAX_PARTS:
        raise MeshFileError(f"expected at most {MAX_PARTS} parts, got {len(groups)}; split by 'materials' or 'none', or rename parts alike")
    ends = np.array([end for members in groups.values() for piece, _ in members for end in _ends(piece, turn)])
    extent = np.ptp(ends, axis=0)
    if not 0.0 < extent.max() <= 1e9:
        raise MeshFileError(f"expected a model with an extent of at most 1e9 units, got {extent.max():g}")
    parts: dict[str, FilePart] = {}
    for (name, _), members in groups.items():
        mesh = merged(*(_mesh(piece, turn, materials[row], float(extent.max())) for piece, row in members))
        if len(mesh.faces):
            parts[_unique(name, parts)] = FilePart(mesh, members[0][1])
    if not parts:
        raise MeshFileError("expected triangles with an area, got none")
    return MeshFile(parts, tuple(materials), raw.images, (float(extent[0]), float(extent[1]), float(extent[2])))


def _ends(piece: Piece, turn: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    points = matmul(piece.vertices[np.unique(piece.faces)], turn.T)
    return points.min(axis=0), points.max(axis=0)


def _turn(reading: FileReading, is_gltf: bool) -> NDArray[np.float64]:
    """Return the rotation (3, 3) from the file's axes to ours."""
    front = _AXES[reading.front or ("+z" if is_gltf else "+x")]
    up = _AXES[reading.up or ("+y" if is_gltf else "+z")]
    if abs(matmul(front, up)) > 0.5:
        raise MeshFileError("expected front and up along different axes, got one axis for both; state both")
    return np.stack([front, np.cross(up, front), up])


def _material_row(
    piece: Piece, own: Sequence[FileMaterial], materials: list[FileMaterial], rows: dict[tuple[int | None, tuple[float, float, float]], int]
) -> int:
    """Return the row of a piece's material; one is added for pieces without, and for those that vertex colours tint."""
    if piece.material is not None and piece.color == WHITE:
        return piece.material
    key = (piece.material, piece.color)
    if key not in rows:
        base = PLAIN if piece.material is None else own[piece.material]
        start = WHITE if piece.material is None else base.base_color
        color = (start[0] * piece.color[0], start[1] * piece.color[1], start[2] * piece.color[2])
        materials.append(base if piece.color == WHITE else replace(base, base_color=color))
        rows[key] = len(materials) - 1
    return rows[key]


def _mesh(piece: Piece, turn: NDArray[np.float64], material: FileMaterial, extent: float) -> Mesh:
    """Return a piece in our axes, shrunk by ``extent``; vertices that no face uses are dropped."""
    used, faces = np.unique(piece.faces, return_inverse=True)
    uvs: NDArray[np.float64] | None = None
    use = material.base_image or material.metallic_roughness_image or material.normal_image
    if use is not None and use.texcoord in piece.uvs:
        turned = matmul(piece.uvs[use.texcoord][used], use.transform[:, :2].T) + use.transform[:, 2]
        uvs = np.column_stack([turned[:, 0], 1.0 - turned[:, 1]])
    mesh = make_mesh(matmul(piece.vertices[used], turn.T) / extent, matmul(piece.normals[used], turn.T), faces.reshape(-1, 3), uvs)
    return mesh if uvs is not None else mesh._replace(uvs=UNMAPPED)


def _renamed(source: str, rename: Mapping[str, str]) -> str:
    """Return the name of the part that a name of the file stands for: an exact entry, else the longest ``start*`` that fits."""
    if source in rename:
        return rename[source]
    fits = [key for key in rename if key.endswith("*") and source.startswith(key[:-1])]
    return rename[max(fits, key=len)] if fits else source


def _plain(name: str) -> str:
    """Return a name that fits scene descriptions: plain characters, not too long."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in name)[:100] or "part"


def _unique(plain: str, taken: Mapping[str, FilePart]) -> str:
    name, count = plain, 1
    while name in taken:
        count += 1
        name = f"{plain}_{count}"
    return name
