"""Images as a page keeps them, so that a script in a browser reads the numbers back.

Numbers up to 16 bits are PNG with the high byte in red and the low byte in green: a canvas gives those bytes back unchanged, which it
would not do for 16-bit PNG.  An image that is larger than asked loses whole rows and columns, so what stays is what the bag has.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from renderer.film.false_color import DIRECTION, DISTANCE
from renderer.film.layer import Layer
from scene_description import SceneSynthError
from scene_synth_ros.bags.bag_images import layer_picture
from scene_synth_ros.pages.document import picture_base64

NO_HIT_MM, MOST_MM = 65535, 65534
"""Codes of distances: 0 is invalid, ``NO_HIT_MM`` infinity, ``MOST_MM`` all that is as far or farther; the others are millimetres."""

Pixels = NDArray[np.generic]


class PageImageError(SceneSynthError):
    """An image that a page cannot hold; one line."""


class Form(NamedTuple):
    """How a kind of layer is kept: pixels of a bag -> bytes (height, width, 3) uint8; lossless or not."""

    keep: Callable[[Pixels], NDArray[np.uint8]]
    lossless: bool


def distance_codes(pixels: Pixels) -> NDArray[np.uint16]:
    """Return distances as codes (height, width): float images are metres, others whole millimetres with 0 for none."""
    if pixels.dtype.kind != "f":
        return np.minimum(pixels.astype(np.int64), MOST_MM).clip(0).astype(np.uint16)
    metres = pixels.astype(np.float64)
    millimetres = np.rint(np.nan_to_num(metres, nan=0.0, posinf=0.0, neginf=0.0) * 1000.0)
    codes = np.where(metres > 0.0, np.clip(millimetres, 1, MOST_MM), 0)
    return np.where(np.isposinf(metres), NO_HIT_MM, codes).astype(np.uint16)


def _two_bytes(numbers: NDArray[np.uint16]) -> NDArray[np.uint8]:
    return np.stack([numbers >> 8, numbers & 255, np.zeros_like(numbers)], axis=-1).astype(np.uint8)


def _three_channels(picture: Pixels) -> NDArray[np.uint8]:
    grey = picture if picture.ndim == 3 else np.repeat(picture[..., None], 3, axis=2)
    return np.ascontiguousarray(grey[..., :3]).astype(np.uint8)


FORMS: dict[str, Form] = {
    "picture": Form(_three_channels, False),
    "direction": Form(lambda pixels: DIRECTION.of(pixels.astype(np.float32)).astype(np.uint8), True),
    "distance": Form(lambda pixels: _two_bytes(distance_codes(pixels)), True),
    "ids": Form(lambda pixels: _two_bytes(pixels.astype(np.uint16)), True),
}
"""Name of a form, which the page's script knows too -> form."""
_CHANNELS = {"picture": (1, 3, 4), "direction": (3,), "distance": (1,), "ids": (1,)}


def form_of(layer: Layer) -> str:
    """Return the form of a layer: by its labels, then by how people see it."""
    if layer.labels is not None:
        return "ids"
    return {id(DISTANCE): "distance", id(DIRECTION): "direction"}.get(id(layer.picture), "picture")


def page_image(pixels: Pixels, form: str, layer: Layer | None, max_size: int) -> dict[str, Any]:
    """Return an image as the page's script takes it.

    The pixels are as a bag has them, ``form`` is a key of ``FORMS``, ``layer`` None of an image of no known layer.

    Returns:
        width, height: in the bag; shown: width and height in the page; type and data: image file, base64; sum: of all its bytes, for
        lossless forms, so that the script can tell whether it reads what was written; counts: id -> pixels in the bag, for ids.

    Raises:
        PageImageError: the image is empty, or has another number of channels than its form.
    """
    channels = pixels.shape[2] if pixels.ndim == 3 else 1
    expected = sorted({*_CHANNELS[form], *([layer.channels] if layer is not None and form == "picture" else [])})
    if not pixels.size or channels not in expected or pixels.dtype.kind not in "uif":
        size = f"{pixels.dtype} {' x '.join(map(str, pixels.shape))}"
        raise PageImageError(f"expected pixels of {' or '.join(map(str, expected))} channels, got {size}")
    height, width = pixels.shape[:2]
    scale = min(1.0, max_size / max(height, width))
    shown = max(1, round(width * scale)), max(1, round(height * scale))
    entry: dict[str, Any] = {"width": width, "height": height, "shown": shown}
    if FORMS[form].lossless:
        if form == "ids":
            ids, counts = np.unique(pixels, return_counts=True)
            entry["counts"] = {int(key): int(count) for key, count in zip(ids, counts, strict=True)}
        kept = FORMS[form].keep(pixels[_taken(height, shown[1])][:, _taken(width, shown[0])])
        entry["sum"] = int(kept.sum(dtype=np.int64))
        picture = Picture.fromarray(kept)
    else:
        picture = Picture.fromarray(FORMS[form].keep(pixels if layer is None else layer_picture(layer, pixels)))
        picture = picture.resize(shown, Picture.Resampling.LANCZOS) if picture.size != shown else picture
    kind = "PNG" if FORMS[form].lossless else "JPEG"
    return entry | {"type": f"image/{kind.lower()}", "data": picture_base64(picture, kind)}


def _taken(length: int, shown: int) -> NDArray[np.int64]:
    """Return which rows or columns stay: those under the middles of the pixels shown."""
    return ((np.arange(shown) + 0.5) * length / shown).astype(np.int64)
