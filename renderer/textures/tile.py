"""Tiles: what a texture looks like as texels, at full size and in smaller versions for the distance.

A texel has eight bytes, so that a look-up reads one machine word:

    byte     pattern                                   picture
    0 to 2   shares of the second to fourth colour     red, green, blue, sRGB
    3        shade / 2                                 metalness
    4        roughness / 2 + 1/2, added                roughness, a factor
    5, 6     slopes along u and v, 128 is level        the same
    7        spread of the slopes below a texel's size the same

Slopes are in units of the tile's ``steepest``, so that relief can be chosen later; colours and contrast are no part of a pattern's tile
either.  So rooms share tiles.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.textures.generators import GENERATORS
from renderer.textures.noise import Field
from renderer.textures.pattern import Color, Pattern, Picture, Request

CHANNELS = 8
CACHED_TILES = 160
"""How many tiles stay in memory for the next rooms; they have at most 2.8 MB each."""


class TextureTile(NamedTuple):
    """levels: (h, w, 8) uint8 each, full size first, every next one half as large down to 1 x 1; sides are powers of two.

    picture: texels have colours of their own; else they are shares of the material's colours.  steepest: the slope, height per length
    in the tile's own units, that stands for a full byte.
    """

    levels: tuple[NDArray[np.uint8], ...]
    picture: bool
    steepest: float

    @property
    def size_bytes(self) -> int:
        """Memory of all levels."""
        return sum(level.nbytes for level in self.levels)


class ImageMaps(NamedTuple):
    """Images that make a picture tile, each (h, w) or (h, w, c) uint8, the first row uppermost; None is neutral.

    color: sRGB (h, w, 3); roughness, metallic: factors (h, w); normal: tangent-space normals (h, w, 3), 128 is 0, green upward, as in glTF.
    """

    color: NDArray[np.uint8] | None = None
    roughness: NDArray[np.uint8] | None = None
    metallic: NDArray[np.uint8] | None = None
    normal: NDArray[np.uint8] | None = None


def generated_tile(generator: str, seed: int, aspect: float, colors: tuple[Color, ...]) -> TextureTile:
    """Return a tile of a generator; equal requests give the same tile again.

    ``aspect``: width over height of what a texture is mapped on once; ``colors``: base colour first, linear, for pictures.

    Raises:
        KeyError: the generator is unknown.
    """
    known = GENERATORS[generator]
    variant = seed % known.variants if known.variants else seed
    return _drawn(generator, variant, round(aspect, 1) if known.once else 1.0, colors if known.once else ())


@lru_cache(maxsize=CACHED_TILES)
def _drawn(generator: str, variant: int, aspect: float, colors: tuple[Color, ...]) -> TextureTile:
    known = GENERATORS[generator]
    request = Request(known.shape, max(aspect, 0.1), colors)
    made = known.draw(np.random.default_rng([variant, *generator.encode()]), request)
    return picture_tile(made) if isinstance(made, Picture) else pattern_tile(made, known.units)


def pattern_tile(pattern: Pattern, units: tuple[float, float]) -> TextureTile:
    """Return the tile of a repeating pattern that is ``units`` (u, v) units wide and high."""
    shape = next(field.shape for field in (*pattern.weights, pattern.shade, pattern.height) if field is not None)
    full = np.zeros((*shape, CHANNELS), np.float32)
    for k, weight in enumerate(pattern.weights):
        full[..., k] = weight
    full[..., 3] = 0.5 if pattern.shade is None else 0.5 * pattern.shade
    full[..., 4] = 0.5 if pattern.roughness is None else 0.5 + 0.5 * pattern.roughness
    return _finished(full, pattern.height, units, False)


def picture_tile(picture: Picture) -> TextureTile:
    """Return the tile of a picture with colours of its own, one unit wide and high."""
    full = np.zeros((*picture.rgb.shape[:2], CHANNELS), np.float32)
    full[..., :3] = picture.rgb
    full[..., 3] = 0.0
    full[..., 4] = 1.0 if picture.roughness is None else 1.0 + picture.roughness
    return _finished(full, picture.height, (1.0, 1.0), True)


def image_tile(maps: ImageMaps) -> TextureTile:
    """Return the tile of a user's images, one unit wide and high, v = 0 at the lower edge; images are resampled to powers of two.

    Raises:
        ValueError: no image, or an image that is not uint8 of the right shape.
    """
    given = {name: image for name, image in maps._asdict().items() if image is not None}
    if not given:
        raise ValueError("texture: expected at least one image, got none")
    for name, image in given.items():
        wanted = 2 if name in ("roughness", "metallic") else 3
        if image.dtype != np.uint8 or image.ndim != wanted or 0 in image.shape or (wanted == 3 and image.shape[2] != 3):
            raise ValueError(f"texture {name}: expected uint8 (h, w{', 3' if wanted == 3 else ''}), got {image.dtype} {image.shape}")
    height, width = (min(2048, 1 << max(0, round(np.log2(max(image.shape[axis] for image in given.values()))))) for axis in (0, 1))
    full = np.ones((height, width, CHANNELS), np.float32)
    for name, image in given.items():
        values = _resampled(image.astype(np.float32) / 255.0, height, width)[::-1]
        if name == "color":
            full[..., :3] = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
        elif name == "metallic":
            full[..., 3] = values
        elif name == "roughness":
            full[..., 4] = values
    slopes = np.zeros((height, width, 2), np.float32)
    if maps.normal is not None:
        normal = _resampled(maps.normal.astype(np.float32) / 127.5 - 1.0, height, width)[::-1]
        slopes = -normal[..., :2] / np.maximum(normal[..., 2:], 0.1)
    return _tile_of_slopes(full, slopes.astype(np.float32), True)


def _resampled(image: NDArray[np.float32], height: int, width: int) -> NDArray[np.float32]:
    """Return an image at another size: the mean over the area that a new texel covers, or the nearest texel where it covers less."""
    for axis, count in ((0, height), (1, width)):
        old = image.shape[axis]
        if old == count:
            continue
        edges = np.arange(count + 1) * (old / count)
        sums = np.concatenate([np.zeros_like(np.take(image, [0], axis)), np.cumsum(image, axis=axis, dtype=np.float64)], axis=axis)
        low = np.minimum(np.floor(edges).astype(np.int64), old - 1)
        part = (edges - low).reshape([-1 if k == axis else 1 for k in range(image.ndim)])
        at = np.take(sums, low, axis) + part * np.take(image, low, axis)
        image = (np.diff(at, axis=axis) * (count / old)).astype(np.float32)
    return image


def _finished(full: NDArray[np.float32], height: Field | None, units: tuple[float, float], picture: bool) -> TextureTile:
    slopes = np.zeros((*full.shape[:2], 2), np.float32)
    if height is not None:
        for k, axis in ((0, 1), (1, 0)):
            step = 2.0 * units[k] / full.shape[axis]
            slopes[..., k] = (np.roll(height, -1, axis) - np.roll(height, 1, axis)) * np.float32(1.0 / step)
    return _tile_of_slopes(full, slopes, picture)


def _tile_of_slopes(full: NDArray[np.float32], slopes: NDArray[np.float32], picture: bool) -> TextureTile:
    steepest = max(float(np.abs(slopes).max()), 1e-6)
    full[..., 5:7] = slopes * np.float32(1.0 / steepest)
    full[..., 7] = 0.0
    square = full[..., 5] ** 2 + full[..., 6] ** 2
    levels = [_packed(full, square, picture)]
    while full.shape[0] > 1 or full.shape[1] > 1:
        full, square = _halved(full), _halved(square[..., None])[..., 0]
        levels.append(_packed(full, square, picture))
    return TextureTile(tuple(levels), picture, steepest)


def _halved(fields: NDArray[np.float32]) -> NDArray[np.float32]:
    if fields.shape[0] > 1:
        fields = 0.5 * (fields[0::2] + fields[1::2])
    return 0.5 * (fields[:, 0::2] + fields[:, 1::2]) if fields.shape[1] > 1 else fields


def _packed(full: NDArray[np.float32], square: Field, picture: bool) -> NDArray[np.uint8]:
    """Return one level as bytes; ``square`` is the mean square of the slopes under each texel."""
    texels = np.empty(full.shape, np.float32)
    texels[..., :5] = full[..., :5]
    if picture:
        rgb = np.clip(full[..., :3], 0.0, 1.0)
        texels[..., :3] = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** np.float32(1.0 / 2.4) - 0.055)
    texels[..., 5:7] = 128.0 / 255.0 + (127.0 / 255.0) * full[..., 5:7]
    rest = square - full[..., 5] ** 2 - full[..., 6] ** 2
    texels[..., 7] = np.sqrt(0.5 * np.maximum(rest, 0.0))
    texels *= 255.0
    texels += 0.5
    packed: NDArray[np.uint8] = np.clip(texels, 0.0, 255.0).astype(np.uint8)
    return packed
