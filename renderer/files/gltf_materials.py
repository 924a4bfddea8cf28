"""The materials of a glTF file: metallic-roughness factors, the material extensions that we render, and which images they have.

glTF 2.0 specification, section 3.9, and the ratified KHR_materials extensions.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.files.gltf_container import Container, fail, listed, mapped, pointed, uri_bytes, view_bytes, whole
from renderer.files.image_io import MAX_IMAGE_PIXELS, image_size

Color = tuple[float, float, float]


class ImageUse(NamedTuple):
    """How a material uses an image: its index in the file, the set of texture coordinates, and their (2, 3) transform."""

    image: int
    texcoord: int
    transform: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class FileMaterial:
    """A material of a model file, in the terms of ``scene_description.Material``; colours are linear.

    ``alpha`` below 1 stands for a blended material; ``cutout`` for one whose image cuts holes.
    """

    name: str
    base_color: Color = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    cutout: bool = False
    roughness: float = 1.0
    metallic: float = 1.0
    transmission: float = 0.0
    diffuse_transmission: float = 0.0
    ior: float = 1.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.0
    sheen: float = 0.0
    emission: Color = (0.0, 0.0, 0.0)
    base_image: ImageUse | None = None
    metallic_roughness_image: ImageUse | None = None
    normal_image: ImageUse | None = None


def read_materials(container: Container) -> tuple[FileMaterial, ...]:
    """Return the file's materials in their order.

    Raises:
        MeshFileError: a number or an index does not fit.
    """
    return tuple(_read_material(container.tree, i, item) for i, item in enumerate(listed(container.tree, "materials")))


def read_images(container: Container, wanted: set[int]) -> dict[int, bytes]:
    """Return the encoded images that materials use, after a look at the sizes that their headers state.

    Raises:
        MeshFileError: an image is missing, no PNG, JPEG or WebP, or all together are too large once decoded.
    """
    images: dict[int, bytes] = {}
    pixels = 0
    for index in sorted(wanted):
        item = pointed(container.tree, "images", index, "images")
        path = f"images[{index}]"
        if "bufferView" in item:
            data = bytes(view_bytes(container, item["bufferView"], f"{path}.bufferView"))
        else:
            data = uri_bytes(item.get("uri"), container.fetch, f"{path}.uri")
        width, height = image_size(data, path)
        pixels += width * height
        if pixels > MAX_IMAGE_PIXELS:
            fail(path, f"images of at most {MAX_IMAGE_PIXELS} pixels together", f"{pixels} or more")
        images[index] = data
    return images


def _read_material(tree: Mapping[str, Any], index: int, item: object) -> FileMaterial:
    path = f"materials[{index}]"
    if not isinstance(item, Mapping):
        fail(path, "a mapping", item)
    pbr = mapped(item, "pbrMetallicRoughness", f"{path}.")
    extensions = mapped(item, "extensions", f"{path}.")
    more = {name: mapped(extensions, f"KHR_materials_{name}", f"{path}.extensions.") for name in _EXTENSIONS}
    factor = _factors(pbr.get("baseColorFactor", [1, 1, 1, 1]), 4, f"{path}.baseColorFactor")
    base_image = _image_use(tree, pbr.get("baseColorTexture"), f"{path}.baseColorTexture")
    roughness, metallic = pbr.get("roughnessFactor", 1.0), pbr.get("metallicFactor", 1.0)
    glossy = more["pbrSpecularGlossiness"]
    if glossy:  # the archived model of before: diffuse colour and glossiness, without metals
        factor = _factors(glossy.get("diffuseFactor", [1, 1, 1, 1]), 4, f"{path}.diffuseFactor")
        base_image = _image_use(tree, glossy.get("diffuseTexture"), f"{path}.diffuseTexture")
        roughness, metallic = 1.0 - _factor(glossy.get("glossinessFactor", 1.0), f"{path}.glossinessFactor"), 0.0
    mode = item.get("alphaMode", "OPAQUE")
    strength = _factor(more["emissive_strength"].get("emissiveStrength", 1.0), f"{path}.emissiveStrength", 1e6)
    emission = _factors(item.get("emissiveFactor", [0, 0, 0]), 3, f"{path}.emissiveFactor")
    return FileMaterial(
        name=str(item.get("name") or f"material {index}"),
        base_color=(factor[0], factor[1], factor[2]),
        alpha=factor[3] if mode == "BLEND" else 1.0,
        cutout=mode == "MASK" and base_image is not None,
        roughness=_factor(roughness, f"{path}.roughnessFactor"),
        metallic=_factor(metallic, f"{path}.metallicFactor"),
        transmission=_factor(more["transmission"].get("transmissionFactor", 0.0), f"{path}.transmissionFactor"),
        diffuse_transmission=_factor(
            more["diffuse_transmission"].get("diffuseTransmissionFactor", 0.0), f"{path}.diffuseTransmissionFactor", _MOST_THROUGH
        ),
        ior=max(1.0, _factor(more["ior"].get("ior", 1.5), f"{path}.ior", 3.0)),
        clearcoat=_factor(more["clearcoat"].get("clearcoatFactor", 0.0), f"{path}.clearcoatFactor"),
        clearcoat_roughness=_factor(more["clearcoat"].get("clearcoatRoughnessFactor", 0.0), f"{path}.clearcoatRoughnessFactor"),
        sheen=max(_factors(more["sheen"].get("sheenColorFactor", [0, 0, 0]), 3, f"{path}.sheenColorFactor")),
        emission=(emission[0] * strength, emission[1] * strength, emission[2] * strength),
        base_image=base_image,
        metallic_roughness_image=_image_use(tree, pbr.get("metallicRoughnessTexture"), f"{path}.metallicRoughnessTexture"),
        normal_image=_image_use(tree, item.get("normalTexture"), f"{path}.normalTexture"),
    )


_MOST_THROUGH = 0.95
_EXTENSIONS = ("transmission", "diffuse_transmission", "ior", "clearcoat", "sheen", "emissive_strength", "pbrSpecularGlossiness")


def _factor(value: object, path: str, most: float = 1.0) -> float:
    """Return a number, cut to [0, most]."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        fail(path, "a number", value)
    return min(max(float(value), 0.0), most)


def _factors(value: object, count: int, path: str) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != count:
        fail(path, f"{count} numbers", value)
    return tuple(_factor(item, path) for item in value)


def _image_use(tree: Mapping[str, Any], info: object, path: str) -> ImageUse | None:
    if info is None:
        return None
    if not isinstance(info, Mapping):
        fail(path, "a mapping", info)
    texture = pointed(tree, "textures", info.get("index"), f"{path}.index")
    webp = mapped(mapped(texture, "extensions"), "EXT_texture_webp")
    source = webp.get("source", texture.get("source"))
    if source is None:
        return None
    image = whole(source, f"{path}.source", 0, len(listed(tree, "images")) - 1)
    change = mapped(mapped(info, "extensions"), "KHR_texture_transform")
    texcoord = whole(change.get("texCoord", info.get("texCoord", 0)), f"{path}.texCoord", 0, 15)
    scale, offset = (_pair(change.get(name, [default] * 2), f"{path}.{name}") for name, default in (("scale", 1.0), ("offset", 0.0)))
    angle = change.get("rotation", 0.0)
    if isinstance(angle, bool) or not isinstance(angle, (int, float)) or not abs(angle) < 1e3:
        fail(f"{path}.rotation", "an angle below 1000 rad", angle)
    cosine, sine = math.cos(angle), math.sin(angle)
    transform = np.array([[cosine * scale[0], sine * scale[1], offset[0]], [-sine * scale[0], cosine * scale[1], offset[1]]])
    return ImageUse(image, texcoord, transform)


def _pair(value: object, path: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(x, (int, float)) and abs(x) < 1e6 for x in value):
        fail(path, "2 numbers below 1e6", value)
    return float(value[0]), float(value[1])
