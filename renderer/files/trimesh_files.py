"""Reads OBJ, PLY and STL files by trimesh, after a look at their size; the only file that imports trimesh."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import trimesh

from renderer.core.color import linear_from_srgb
from renderer.core.errors import MeshFileError
from renderer.files.file_parts import Raw
from renderer.files.gltf_container import Fetch
from renderer.files.gltf_materials import FileMaterial, ImageUse
from renderer.files.gltf_meshes import MAX_FACES, MAX_VERTICES, Piece
from renderer.files.image_io import MAX_IMAGE_PIXELS, image_size

_MOST = {"vertex": MAX_VERTICES, "face": MAX_FACES}
_MAX_HEADER_BYTES = 20_000
_NORMAL_DECIMALS = 6
"""Where a file has no normals, trimesh sums them with BLAS, whose last digits depend on the processor."""


def check_ply(data: bytes) -> None:
    """Check the header and the counts of a PLY file.

    Raises:
        MeshFileError: no header, a count beyond its limit, or more rows than the file has room for.
    """
    end = data.find(b"end_header", 0, _MAX_HEADER_BYTES)
    if not data.startswith(b"ply") or end < 0:
        raise MeshFileError(f"expected a PLY header within {_MAX_HEADER_BYTES} bytes, got none")
    total = 0
    for line in data[:end].splitlines():
        words = line.split()
        if len(words) >= 3 and words[0] == b"element":
            name, count = words[1].decode("ascii", "replace"), words[2]
            if not count.isdigit() or len(count) > 12:
                raise MeshFileError(f"element {name}: expected a count, got {count[:20]!r}")
            total += int(count)
            if int(count) > _MOST.get(name, MAX_VERTICES):
                raise MeshFileError(f"element {name}: expected at most {_MOST.get(name, MAX_VERTICES)}, got {int(count)}")
    if total > len(data) - end:
        raise MeshFileError(f"expected a byte or more for each of the {total} rows that the header promises, got {len(data) - end} in all")


MAX_LIBRARY_BYTES = 1_000_000
MAX_MATERIALS = 1_000
_NUMBERS: dict[str, tuple[str, Callable[[float], float]]] = {
    "Ns": ("roughness", lambda x: math.pow(2.0 / (max(x, 0.0) + 2.0), 0.25)),
    "d": ("alpha", float),
    "Tr": ("alpha", lambda x: 1.0 - x),
    "Ni": ("ior", lambda x: x if 1.0 <= x <= 3.0 else 1.5),
    "Pr": ("roughness", float),
    "Pm": ("metallic", float),
    "Pc": ("clearcoat", float),
    "Ps": ("sheen", float),
}
"""Statement -> field and its value.  The exponent n of Phong's model becomes the roughness r with r^4 = 2 / (n + 2), that is
n = 2 / alpha^2 - 2 (B. Walter et al., Microfacet models for refraction through rough surfaces, EGSR 2007) and alpha = r^2."""


def read_mtl(data: bytes, fetch: Callable[[str], bytes]) -> tuple[tuple[FileMaterial, ...], dict[int, bytes]]:
    """Return the library's materials and the encoded images of their base colours (``map_Kd``), by index.

    Raises:
        MeshFileError: too large, a number that does not parse, an image that is missing, leads out of the catalogue or is too large.
    """
    if len(data) > MAX_LIBRARY_BYTES:
        raise MeshFileError(f"material library: expected at most {MAX_LIBRARY_BYTES} bytes, got {len(data)}")
    found: dict[str, dict[str, Any]] = {}
    current: dict[str, Any] | None = None
    for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
        word, _, rest = line.strip().partition(" ")
        rest = rest.strip()
        if word == "newmtl":
            current = found.setdefault(rest, {})
        elif current is not None and word in _NUMBERS:
            field, value = _NUMBERS[word]
            current[field] = value(_numbers(rest.split()[-1:], number)[0])
        elif current is not None and word in ("Kd", "Ke"):
            current["base_color" if word == "Kd" else "emission"] = _numbers(rest.split()[:3], number)
        elif current is not None and word == "map_Kd":
            current["image"] = rest.split(" -")[-1].split()[-1] if rest.startswith("-") else rest
    if len(found) > MAX_MATERIALS:
        raise MeshFileError(f"material library: expected at most {MAX_MATERIALS} materials, got {len(found)}")
    images: dict[int, bytes] = {}
    places: dict[str, int] = {}
    materials, pixels = [], 0
    for name, fields in found.items():
        file = fields.pop("image", None)
        material = replace(_START, name=name, **{key: _cut(key, value) for key, value in fields.items()})
        if file is not None:
            if file not in places:
                places[file] = len(places)
                images[places[file]] = fetch(file)
                pixels += math.prod(image_size(images[places[file]], f"image {places[file]} of the material library"))
                if pixels > MAX_IMAGE_PIXELS:
                    raise MeshFileError(
                        f"material library: expected images of at most {MAX_IMAGE_PIXELS} pixels together, got {pixels} or more"
                    )
            material = replace(material, base_image=ImageUse(places[file], 0, np.eye(2, 3)))
        materials.append(material)
    return tuple(materials), images


_START = FileMaterial(name="", base_color=(0.8, 0.8, 0.8), roughness=0.7, metallic=0.0)


def _numbers(words: list[str], line: int) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in words)
    except ValueError:
        values = ()
    if not values or not all(map(math.isfinite, values)):
        raise MeshFileError(f"material library, line {line}: expected finite numbers, got {' '.join(words)[:60]!r}")
    return values if len(values) != 2 else (*values, values[0])


def _cut(field: str, value: Any) -> Any:
    if field in ("base_color", "emission"):
        red, green, blue = (value * 3)[:3]
        return (min(max(red, 0.0), 1.0), min(max(green, 0.0), 1.0), min(max(blue, 0.0), 1.0))
    return min(max(value, 0.0), 1.0) if field != "ior" else value


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

    def namespaced(self, namespace: str) -> "_Library":
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
        normals=np.asarray(np.round(geometry.vertex_normals, _NORMAL_DECIMALS), np.float64),
        faces=np.asarray(geometry.faces, np.int64),
        material=names.get(str(material)),
        uvs={0: np.asarray(uvs, np.float64) * (1.0, -1.0) + (0.0, 1.0)} if usable else {},
        color=color,
    )
