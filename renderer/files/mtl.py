"""Material libraries of OBJ files: the Phong statements, and the PBR ones that are in common use (Pr, Pm, Pc, Ps)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from renderer.core.errors import MeshFileError
from renderer.files.gltf_materials import FileMaterial, ImageUse
from renderer.files.image_io import MAX_IMAGE_PIXELS, image_size

MAX_LIBRARY_BYTES = 1_000_000
MAX_MATERIALS = 1_000
_NUMBERS: dict[str, tuple[str, Callable[[float], float]]] = {
    "Ns": ("roughness", lambda x: (2.0 / (max(x, 0.0) + 2.0)) ** 0.25),
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
    materials = []
    for name, fields in found.items():
        file = fields.pop("image", None)
        material = replace(_START, name=name, **{key: _cut(key, value) for key, value in fields.items()})
        if file is not None:
            if file not in places:
                places[file] = len(places)
                images[places[file]] = fetch(file)
            material = replace(material, base_image=ImageUse(places[file], 0, np.eye(2, 3)))
        materials.append(material)
    pixels = sum(math.prod(image_size(image, f"image {i} of the material library")) for i, image in images.items())
    if pixels > MAX_IMAGE_PIXELS:
        raise MeshFileError(f"material library: expected images of at most {MAX_IMAGE_PIXELS} pixels together, got {pixels}")
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
