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

import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import linear_from_srgb
from renderer.textures.generators import GENERATORS
from renderer.textures.noise import Field
from renderer.textures.packing import CHANNELS, SLOPE_U, SLOPE_V, SRGB_BYTES, fill_slopes, halve_fields, pack_texels, scale_slopes
from renderer.textures.pattern import Color, Pattern, Picture, Request


class Sized(Protocol):
    """What says how much memory it takes."""

    @property
    def size_bytes(self) -> int:
        """Memory that it takes."""


Item = TypeVar("Item", bound=Sized)


class TileCache(Generic[Item]):
    """Keeps what was used last.  Bytes are counted, not items, so that a run of many rooms soon takes as much memory as it ever will.

    Threads may share it; what two of them draw at the same time is drawn twice and kept once.
    """

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._items: OrderedDict[Hashable, Item] = OrderedDict()
        self._lock = threading.Lock()
        self.size_bytes = 0

    def get(self, key: Hashable, draw: Callable[[], Item]) -> Item:
        """Return the item of a key, drawn if it is not kept; the one just asked for is kept in any case."""
        with self._lock:
            if key in self._items:
                self._items.move_to_end(key)
                return self._items[key]
        drawn = draw()
        with self._lock:
            item = self._items.setdefault(key, drawn)
            self._items.move_to_end(key)
            self.size_bytes += item.size_bytes if item is drawn else 0
            while self.size_bytes > self._max_bytes and len(self._items) > 1:
                self.size_bytes -= self._items.popitem(last=False)[1].size_bytes
            return item

    def clear(self) -> None:
        """Keep nothing."""
        with self._lock:
            self._items.clear()
            self.size_bytes = 0


CACHED_BYTES = 48 * 2**20
"""How much memory the tiles that are kept for the next rooms may take; one has at most 5.6 MB, a room some twenty."""


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


_KEPT: TileCache[TextureTile] = TileCache(CACHED_BYTES)


class TileKey(NamedTuple):
    """What decides a tile of a generator; ``colors`` are there for pictures only."""

    generator: str
    variant: int
    aspect: float
    colors: tuple[Color, ...]


def tile_key(generator: str, seed: int, aspect: float, colors: tuple[Color, ...]) -> TileKey:
    """Return which tile of a generator a seed means.

    ``aspect``: width over height of what a texture is mapped on once; ``colors``: base colour first, linear, for pictures.

    Raises:
        KeyError: the generator is unknown.
    """
    known = GENERATORS[generator]
    variant = seed % known.variants if known.variants else seed
    return TileKey(generator, variant, round(aspect, 1) if known.once else 1.0, colors if known.inked else ())


def generated_tile(key: TileKey) -> TextureTile:
    """Return a tile of a generator; the same one again while it is kept."""
    return _KEPT.get(key, lambda: _drawn(*key))


def forget_tiles() -> None:
    """Give back the memory of the tiles that were kept for the next rooms; what is drawn again is the same."""
    _KEPT.clear()


def _drawn(generator: str, variant: int, aspect: float, colors: tuple[Color, ...]) -> TextureTile:
    known = GENERATORS[generator]
    request = Request(known.shape, max(aspect, 0.1), colors)
    made = known.draw(np.random.default_rng([variant, *generator.encode()]), request)
    return picture_tile(made) if isinstance(made, Picture) else pattern_tile(made, known.units)


def pattern_tile(pattern: Pattern, units: tuple[float, float]) -> TextureTile:
    """Return the tile of a repeating pattern that is ``units`` (u, v) units wide and high."""
    shape = next(field.shape for field in (*pattern.weights, pattern.shade, pattern.height) if field is not None)
    full = np.empty((CHANNELS, *shape), np.float32)
    for k in range(3):
        full[k] = pattern.weights[k] if k < len(pattern.weights) else 0.0
    full[3] = 0.5 if pattern.shade is None else 0.5 * pattern.shade
    full[4] = 0.5 if pattern.roughness is None else 0.5 + 0.5 * pattern.roughness
    return _finished(full, pattern.height, units, False)


def picture_tile(picture: Picture) -> TextureTile:
    """Return the tile of a picture with colours of its own, one unit wide and high."""
    full = np.empty((CHANNELS, *picture.rgb.shape[:2]), np.float32)
    full[:3] = np.moveaxis(picture.rgb, -1, 0)
    full[3] = 0.0
    full[4] = 1.0 if picture.roughness is None else 1.0 + picture.roughness
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
    height, width = (min(2048, 1 << max(0, round(math.log2(max(image.shape[axis] for image in given.values()))))) for axis in (0, 1))
    full = np.ones((CHANNELS, height, width), np.float32)
    for name, image in given.items():
        values = _resampled(image.astype(np.float32) / 255.0, height, width)[::-1]
        if name == "color":
            full[:3] = np.moveaxis(linear_from_srgb(values), -1, 0)
        elif name == "metallic":
            full[3] = values
        elif name == "roughness":
            full[4] = values
    full[SLOPE_U : SLOPE_V + 1] = 0.0
    if maps.normal is not None:
        normal = _resampled(maps.normal.astype(np.float32) / 127.5 - 1.0, height, width)[::-1]
        full[SLOPE_U : SLOPE_V + 1] = np.moveaxis(-normal[..., :2] / np.maximum(normal[..., 2:], 0.1), -1, 0)
    return _tile_of_slopes(full, True)


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
    if height is None:
        full[SLOPE_U : SLOPE_V + 1] = 0.0
    else:
        fill_slopes(full, np.broadcast_to(height, full.shape[1:]), units)
    return _tile_of_slopes(full, picture)


def _tile_of_slopes(full: NDArray[np.float32], picture: bool) -> TextureTile:
    steepest = float(scale_slopes(full))
    levels = []
    while True:
        packed = np.empty((*full.shape[1:], CHANNELS), np.uint8)
        pack_texels(full, picture, SRGB_BYTES, packed)
        levels.append(packed)
        if full.shape[1] == full.shape[2] == 1:
            return TextureTile(tuple(levels), picture, steepest)
        halved = np.empty((CHANNELS, max(full.shape[1] // 2, 1), max(full.shape[2] // 2, 1)), np.float32)
        halve_fields(full, halved)
        full = halved
