"""Textures as parts use them: a tile with its size, turn, colours and relief; from the scene description or from a user's images."""

from collections.abc import Hashable
from typing import NamedTuple

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.textures.generators import GENERATORS
from renderer.textures.pattern import Color
from renderer.textures.tile import TextureTile, TileKey, generated_tile, tile_key
from scene_description import Material, Texture

OTHER_COLORS = 3


class AppliedTexture(NamedTuple):
    """A tile on a part.

    source: the tile, or what it is drawn by once its texels are asked for, as light does and geometry does not. size: length of the tile's
    sides along u and v, in the unit of the part's texture coordinates (metres, or 1 for coordinates from 0 to 1). colors: the second to
    fourth colour, linear. contrast: 0.5 leaves the tile as it was drawn, 0 is plain. relief: factor on the tile's slopes, in its own units.
    shift: see ``pattern.Generator``.
    """

    source: TextureTile | TileKey
    size: tuple[float, float] = (1.0, 1.0)
    rotation_rad: float = 0.0
    colors: tuple[Color, ...] = ()
    contrast: float = 0.5
    relief: float = 1.0
    shift: float = 0.0

    @property
    def tile(self) -> TextureTile:
        """The tile, drawn if it is not kept."""
        return generated_tile(self.source) if isinstance(self.source, TileKey) else self.source

    @property
    def tile_id(self) -> Hashable:
        """What tells tiles apart."""
        return self.source if isinstance(self.source, TileKey) else id(self.source)


def applied_texture(material: Material, texture: Texture, mesh: Mesh) -> tuple[Mesh, AppliedTexture]:
    """Return a part with the texture coordinates that its material's ``texture`` needs, and the texture as it lies on it.

    Raises:
        KeyError: the generator is unknown.
    """
    generator = GENERATORS[texture.generator]
    colors = (material.base_color, *_colors(material, texture.colors, generator.tints))
    aspect = 1.0
    if generator.once:
        mesh, extent = mapped_once(mesh)
        aspect = extent[0] / extent[1]
        scale, size, length = 1.0, (1.0, 1.0), max(extent)
    else:
        scale = length = texture.scale_m
        size = (scale * generator.units[0], scale * generator.units[1])
    key = tile_key(texture.generator, texture.seed, aspect, colors)
    return mesh, AppliedTexture(key, size, texture.rotation_rad, colors[1:], texture.contrast, texture.relief_m / length, generator.shift)


def _colors(material: Material, given: tuple[Color, ...], tints: tuple[Color, ...]) -> tuple[Color, ...]:
    """Return the second to fourth colour: those given, then the generator's factors on the base colour."""
    base = np.asarray(material.base_color)
    tinted = [tuple(float(c) for c in np.clip(base * np.asarray(tint), 0.0, 1.0)) for tint in tints]
    colors = [*given[:OTHER_COLORS], *tinted[len(given) :]][:OTHER_COLORS]
    return tuple((c[0], c[1], c[2]) for c in colors)


def mapped_once(mesh: Mesh) -> tuple[Mesh, tuple[float, float]]:
    """Return the part with texture coordinates from 0 to 1 over its largest side, and that side's width and height in metres.

    The side is the one that most of the area faces, seen from outside in the part's own frame: fronts (x) and flanks (y) upright, tops
    (z) with u along y, as if seen from the front.
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    area = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum(axis=0)
    facing = int(np.argmax(area))
    across, up, mirror = ((1, 2, 1.0), (0, 2, -1.0), (1, 0, 1.0))[facing]
    points = mesh.vertices.astype(np.float64)
    coordinates = np.stack([mirror * points[:, across], (-1.0 if facing == 2 else 1.0) * points[:, up]], axis=1)
    low, extent = coordinates.min(axis=0), np.maximum(np.ptp(coordinates, axis=0), 1e-6)
    return mesh._replace(uvs=((coordinates - low) / extent).astype(np.float32)), (float(extent[0]), float(extent[1]))
