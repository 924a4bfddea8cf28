"""The images of model files as textures of parts."""

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import linear_from_srgb, srgb_from_linear
from renderer.core.errors import MeshFileError
from renderer.files.gltf_materials import ImageUse
from renderer.files.image_io import decode_image
from renderer.files.mesh_files import find_mesh_file, read_mesh_file
from renderer.textures.apply import AppliedTexture
from renderer.textures.tile import ImageMaps, TextureTile, image_tile
from scene_description import FileImages, FileReading
from scene_description.types import Color

MOST_SIDE = 1024
"""Longest side of an image once read: its tile then has at most 11 MB."""
_CACHED_TILES = 24
_ANY = FileReading(split="none")


def file_texture(root: Path, images: FileImages, base_color: Color) -> AppliedTexture:
    """Return the images of a material of a file as a texture, for texture coordinates of which 1 is one image.

    ``root`` is the catalogue's folder, ``base_color`` a linear factor on the image.

    Raises:
        MeshFileError: the file has no such material, or an image does not decode.
    """
    path = find_mesh_file(root, images.file)
    state = path.stat()
    return AppliedTexture(_tile(path, root.resolve(), state.st_mtime_ns, state.st_size, images.material, base_color))


@lru_cache(maxsize=_CACHED_TILES)
def _tile(path: Path, root: Path, mtime_ns: int, size: int, index: int, base_color: Color) -> TextureTile:
    """Build a tile; time and size of the file are there to tell versions apart."""
    read = read_mesh_file(path, root, _ANY)
    if index >= len(read.materials):
        raise MeshFileError(f"model file '{path.name}': expected a material below {len(read.materials)}, got {index}")
    material = read.materials[index]

    def decoded(use: ImageUse | None) -> NDArray[np.uint8] | None:
        return None if use is None else decode_image(read.images[use.image], f"model file '{path.name}': image {use.image}", MOST_SIDE)

    base, surface, normal = (decoded(use) for use in (material.base_image, material.metallic_roughness_image, material.normal_image))
    color = np.full((1, 1, 3), 255, np.uint8) if base is None else base[..., :3]
    maps = ImageMaps(
        color=_tinted(color, base_color),
        roughness=None if surface is None else surface[..., 1],
        metallic=None if surface is None else surface[..., 2],
        normal=None if normal is None else normal[..., :3],
    )
    return image_tile(maps)


def _tinted(image: NDArray[np.uint8], factor: Color) -> NDArray[np.uint8]:
    """Return an sRGB image times a linear colour."""
    if factor == (1.0, 1.0, 1.0):
        return image
    tinted = linear_from_srgb(np.arange(256) / 255.0)[:, None] * np.asarray(factor)
    levels = np.round(srgb_from_linear(tinted) * 255.0).astype(np.uint8)
    return np.stack([levels[image[..., k], k] for k in range(3)], axis=-1)
