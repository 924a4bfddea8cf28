"""Reads and writes encoded images; the only file of the renderer that imports Pillow."""

import io
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from renderer.core.errors import MeshFileError, RenderError

MAX_IMAGE_SIDE = 16_384
MAX_IMAGE_PIXELS = 67_108_864
"""Pixels of all images of one model file together: four of 4096 x 4096."""
_FORMATS = ("PNG", "JPEG", "WEBP")


def write_png(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    """Write a PNG: uint8 (height, width) or (height, width, 3), or uint16 (height, width), losslessly.

    Raises:
        RenderError: the array has another shape or type.
        OSError: the file cannot be written.
    """
    grey = image.ndim == 2 and image.dtype in (np.uint8, np.uint16)
    color = image.ndim == 3 and image.shape[2] == 3 and image.dtype == np.uint8
    if not (grey or color) or image.size == 0:
        raise RenderError(f"{path}: expected uint8 or uint16 (h, w), or uint8 (h, w, 3), got {image.dtype} {image.shape}")
    Image.fromarray(np.ascontiguousarray(image)).save(path, format="PNG")


def image_size(data: bytes, path: str) -> tuple[int, int]:
    """Return (width, height) that the header of a PNG, JPEG or WebP states; nothing is decoded.

    Raises:
        MeshFileError: another format, a broken header, or a side beyond the limit.
    """
    with _opened(data, path) as image:
        width, height = image.size
    if not (0 < width <= MAX_IMAGE_SIDE and 0 < height <= MAX_IMAGE_SIDE and width * height <= MAX_IMAGE_PIXELS):
        raise MeshFileError(f"{path}: expected sides of at most {MAX_IMAGE_SIDE} and {MAX_IMAGE_PIXELS} pixels, got {width} x {height}")
    return width, height


def decode_image(data: bytes, path: str, most_side: int) -> NDArray[np.uint8]:
    """Return an image as uint8 (height, width, 4), RGB with alpha, reduced by averaging until no side is longer than ``most_side``.

    Raises:
        MeshFileError: the image is too large or does not decode.
    """
    width, height = image_size(data, path)
    factor = -(-max(width, height) // most_side)
    try:
        with _opened(data, path) as image:
            if factor > 1:
                image.draft("RGB", (-(-width // factor), -(-height // factor)))
            plain = image.convert("RGBA")
    except MeshFileError:
        raise
    except Exception as error:  # decoders raise what they like on broken data
        raise MeshFileError(f"{path}: expected an image that decodes, got {type(error).__name__}") from None
    factor = -(-max(plain.size) // most_side)
    return np.array(plain.reduce(factor) if factor > 1 else plain)


def _opened(data: bytes, path: str) -> Image.Image:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # sizes are checked against our own limit
        try:
            return Image.open(io.BytesIO(data), formats=_FORMATS)
        except Exception as error:  # a header can be broken in many ways
            reason = "a size beyond any limit" if isinstance(error, Image.DecompressionBombError) else "another format or a broken header"
            raise MeshFileError(f"{path}: expected a PNG, JPEG or WebP image, got {reason}") from None


def encode_image(image: NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32], form: str, *, quality: int = 90) -> bytes:
    """Return an image as the bytes of a file.

    Args:
        image: uint8 (height, width) or (height, width, 3), for PNG also uint16 (height, width), for TIFF also float32 (height, width).
        form: ``png`` (lossless, compressed quickly), ``tiff`` (lossless, not compressed) or ``jpeg``.
        quality: of JPEG, 1 to 100.
    """
    options: dict[str, int] = {"png": {"compress_level": 1}, "tiff": {}}.get(form, {"quality": quality})
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image)).save(buffer, format=form.upper(), **options)
    return buffer.getvalue()


def through_jpeg(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Return what JPEG of this quality, 1 to 100, leaves of an image (height, width, 3), uint8.

    Colour has half the resolution of brightness, as the encoder does unless told otherwise.
    """
    with Image.open(io.BytesIO(encode_image(image, "jpeg", quality=quality))) as decoded:
        return np.array(decoded)
