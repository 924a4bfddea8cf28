"""Textures of parts as images for other programs: base colour, roughness and metalness, normals."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.color import srgb_from_linear
from renderer.textures.apply import AppliedTexture
from scene_description import Material
from scene_description.products import matmul

MOST_SIDE = 512
_FLAT = 2
"""Differences of up to so many levels of a byte are not worth an image."""


class BakedTexture(NamedTuple):
    """Images (h, w, 3) uint8, first row uppermost, as glTF has them: sRGB base colour; green roughness, blue metalness; normals.

    None where the material's own numbers, or a level surface, say the same.
    """

    color: NDArray[np.uint8]
    surface: NDArray[np.uint8] | None
    normal: NDArray[np.uint8] | None


def bake(texture: AppliedTexture, material: Material) -> BakedTexture:
    """Return what a texture makes of a material, texel by texel; the same sums as ``look_up`` has at hits."""
    tile = texture.tile
    level = next(item for item in tile.levels if max(item.shape[:2]) <= MOST_SIDE)
    byte = level[::-1].astype(np.float64) / 255.0
    if tile.picture:
        color = level[::-1, :, :3].copy()
        roughness, metallic = material.roughness * byte[..., 4], material.metallic * byte[..., 3]
    else:
        contrast = 2.0 * texture.contrast
        share = byte[..., :3] * contrast
        share = share / np.maximum(share.sum(axis=-1, keepdims=True), 1.0)
        others = np.zeros((3, 3))
        for k, other in enumerate(texture.colors):
            others[k] = other
        mixed = (1.0 - share.sum(axis=-1, keepdims=True)) * np.asarray(material.base_color) + matmul(share, others)
        shade = np.maximum(1.0 + contrast * (2.0 * byte[..., 3] - 1.0), 0.0)
        color = _encoded(np.minimum(shade[..., None] * mixed, 1.0))
        roughness, metallic = material.roughness + 2.0 * byte[..., 4] - 1.0, np.full(byte.shape[:2], material.metallic)
    surface = _bytes(np.stack([np.ones_like(roughness), roughness, metallic], axis=-1))
    slopes = (level[::-1, :, 5:7].astype(np.float64) - 128.0) / 127.0 * (texture.relief * tile.steepest)
    upright = np.concatenate([-slopes, np.ones((*slopes.shape[:2], 1))], axis=-1)
    normal = _bytes(0.5 + 0.5 * upright / np.linalg.norm(upright, axis=-1, keepdims=True))
    varies = np.ptp(surface.reshape(-1, 3), axis=0).max() > _FLAT
    return BakedTexture(color, surface if varies else None, normal if np.ptp(normal.reshape(-1, 3), axis=0).max() > _FLAT else None)


def image_coordinates(texture: AppliedTexture, uvs: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return texture coordinates as glTF has them: 1 is one image, v downward; rows of a shifted tile start alike."""
    u, v = uvs.astype(np.float64).T
    cosine, sine = el.cos(texture.rotation_rad), el.sin(texture.rotation_rad)
    along, across = (cosine * u + sine * v) / texture.size[0], (cosine * v - sine * u) / texture.size[1]
    return np.column_stack([along, 1.0 - across]).astype(np.float32)


def _bytes(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.round(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8)


def _encoded(linear: NDArray[np.float64]) -> NDArray[np.uint8]:
    return _bytes(srgb_from_linear(linear))
