"""Materials of a scene as glTF materials with the KHR extensions that say what metallic-roughness alone cannot."""

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from renderer.export.glb_writer import GlbWriter
from renderer.export.textures import bake
from renderer.files.image_io import encode_image
from renderer.scene.flat_scene import FlatScene
from renderer.textures.apply import AppliedTexture
from scene_description import Material

DEFAULT_IOR = 1.5
LUMINAIRE = "luminaire"
"""Name of the material of lights that no object holds."""


class MaterialExport:
    """Writes each combination of material, texture and glow once."""

    def __init__(self, writer: GlbWriter, materials: Sequence[Material], flat: FlatScene) -> None:
        self._writer, self._materials, self._flat = writer, materials, flat
        self._indices: dict[tuple[Hashable, ...], int] = {}
        self._baked: dict[tuple[Hashable, ...], dict[str, int]] = {}

    def index(self, part: int) -> int:
        """Return the index of the glTF material of a part (row of the part table)."""
        if is_luminaire(self._flat, part):
            return self._luminaire(part)
        row = int(self._flat.parts.material[part])
        emission = tuple(float(x) for x in self._flat.parts.emission[part])
        texture = self.texture(part)
        look = () if texture is None else (texture.tile_id, texture.colors, texture.contrast, texture.relief)
        key = (row, emission, look)
        if key not in self._indices:
            item = self._item(self._materials[row], emission)
            if texture is not None:
                self._add_images(item, texture, self._materials[row], (row, look))
            self._indices[key] = self._writer.add("materials", item)
        return self._indices[key]

    def _luminaire(self, part: int) -> int:
        """Return the material of a ball of light: black, in the light's colour where it is on.

        It has no strength in cd/m2: its punctual light is all of its light.
        """
        emission = self._flat.parts.emission[part].astype(np.float64)
        color = (emission / max(float(emission.max()), 1e-30)).tolist()
        key = (LUMINAIRE, *color)
        if key not in self._indices:
            black = {"baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}
            item = {"name": LUMINAIRE, "pbrMetallicRoughness": black, "emissiveFactor": color, "extras": {"family": LUMINAIRE}}
            self._indices[key] = self._writer.add("materials", item)
        return self._indices[key]

    def texture(self, part: int) -> AppliedTexture | None:
        """Return the texture of a part."""
        index = int(self._flat.part_texture[part])
        return None if index < 0 else self._flat.textures[index]

    def _add_images(self, item: dict[str, Any], texture: AppliedTexture, material: Material, key: tuple[Hashable, ...]) -> None:
        """Write the texture's images once, and let them stand for the numbers that they hold."""
        if key not in self._baked:
            baked = bake(texture, material)._asdict()
            self._baked[key] = {
                name: self._writer.add_png(encode_image(image, "png"), f"{material.id} {name}")
                for name, image in baked.items()
                if image is not None
            }
        images, pbr = self._baked[key], item["pbrMetallicRoughness"]
        pbr["baseColorFactor"], pbr["baseColorTexture"] = [1.0, 1.0, 1.0, 1.0], {"index": images["color"]}
        through = item.get("extensions", {}).get("KHR_materials_diffuse_transmission")
        if through is not None:
            through |= {"diffuseTransmissionColorFactor": [1.0, 1.0, 1.0], "diffuseTransmissionColorTexture": {"index": images["color"]}}
        if material.glow_cd_m2 > 0.0:
            item["emissiveFactor"], item["emissiveTexture"] = [1.0, 1.0, 1.0], {"index": images["color"]}
        if "surface" in images:
            pbr |= {"metallicFactor": 1.0, "roughnessFactor": 1.0, "metallicRoughnessTexture": {"index": images["surface"]}}
        if "normal" in images:
            item["normalTexture"] = {"index": images["normal"]}

    def _item(self, material: Material, emission: tuple[float, ...]) -> dict[str, Any]:
        item: dict[str, Any] = {
            "name": material.id,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*material.base_color, 1.0],
                "metallicFactor": material.metallic,
                "roughnessFactor": material.roughness,
            },
            "doubleSided": material.transmission == 0.0 or material.diffuse_transmission > 0.0,  # slats and leaves have no thickness
            "extras": {"family": material.family},
        }
        extensions: dict[str, Any] = {}
        if material.transmission > 0.0:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": material.transmission}
        if material.diffuse_transmission > 0.0:
            extensions["KHR_materials_diffuse_transmission"] = {
                "diffuseTransmissionFactor": material.diffuse_transmission,
                "diffuseTransmissionColorFactor": list(material.base_color),
            }
        if material.ior != DEFAULT_IOR:
            extensions["KHR_materials_ior"] = {"ior": material.ior}
        if material.clearcoat > 0.0:
            extensions["KHR_materials_clearcoat"] = {
                "clearcoatFactor": material.clearcoat,
                "clearcoatRoughnessFactor": material.clearcoat_roughness,
            }
        if material.sheen > 0.0:
            extensions["KHR_materials_sheen"] = {"sheenColorFactor": [material.sheen] * 3, "sheenRoughnessFactor": 0.5}
        glows = material.glow_cd_m2 > 0.0 and not any(emission)
        brightest = material.glow_cd_m2 if glows else max(emission)
        if brightest > 0.0:
            item["emissiveFactor"] = list(material.base_color) if glows else (np.array(emission) / brightest).tolist()
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": brightest}
        for name in extensions:
            self._writer.use_extension(name)
        if extensions:
            item["extensions"] = extensions
        return item


def is_luminaire(flat: FlatScene, part: int) -> bool:
    """Return whether a part is a light that no object holds; its material in the part table is then only a stand-in."""
    return len(flat.part_profile) > 0 and bool(flat.part_profile[part] >= 0)
