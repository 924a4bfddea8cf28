"""Serialised images as arrays, without ROS: ``sensor_msgs/Image`` and ``sensor_msgs/CompressedImage`` of whatever sender.

``compressedDepth`` has twelve bytes before its PNG, see :mod:`scene_synth_ros.messages.image_codec`.
"""

import io
import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description import SceneSynthError
from scene_synth_ros.messages.cdr import CdrReader, CdrReadError, Header
from scene_synth_ros.messages.streams import IMAGE_TYPE, TRANSPORTS

ENCODINGS: Mapping[str, tuple[str, int]] = {
    "mono8": ("u1", 1), "8UC1": ("u1", 1), "mono16": ("u2", 1), "16UC1": ("u2", 1), "16SC1": ("i2", 1), "32SC1": ("i4", 1),
    "32FC1": ("f4", 1), "64FC1": ("f8", 1), "32FC2": ("f4", 2), "64FC2": ("f8", 2), "32FC3": ("f4", 3), "64FC3": ("f8", 3),
    "rgb8": ("u1", 3), "bgr8": ("u1", 3), "8UC3": ("u1", 3),
}  # fmt: skip
"""Image encoding -> kind and size of a number, numbers a pixel."""
MAX_PIXELS = 8192 * 8192
"""Of an image whose camera does not tell its size: those of the largest camera of this package."""
_PLAIN_MODES = ("L", "RGB", "I;16", "I;16B", "I")
"""What Pillow calls pixels that are kept as they are; others become red, green, blue."""
_DEPTH_HEAD = struct.Struct("<iff")


class CodecError(SceneSynthError):
    """An image that cannot be read, or compressed as asked; one line."""


class ReadImage(NamedTuple):
    """An image: header, encoding (of compressed ones, their format), pixels (height, width) or (height, width, channels), writable."""

    header: Header
    encoding: str
    pixels: NDArray[Any]


def read_image(type_name: str, data: bytes | memoryview, topic: str, size: tuple[int, int] | None = None) -> ReadImage:
    """Return the image in a serialised message; ``bgr8`` as red, green, blue.

    ``topic``: says of a compressed image whether it is depth.
    ``size``: height and width that it must have, those of its camera; None for any of up to ``MAX_PIXELS``.

    Raises:
        CodecError: the message is cut off, its pixels cannot be decoded, or they are of another size.
    """
    try:
        reader = CdrReader(data)
        return _read_raw(reader, size) if type_name == IMAGE_TYPE else _read_compressed(reader, topic, size)
    except CdrReadError as error:
        raise CodecError(str(error)) from None


def told_size(data: bytes | memoryview) -> tuple[int, int] | None:
    """Return height and width in a serialised CameraInfo; None where it has none, or is cut off."""
    try:
        reader = CdrReader(data)
        reader.header()
        height, width = reader.number("I"), reader.number("I")
    except CdrReadError:
        return None
    return (height, width) if height and width else None


def read_compressed(data: bytes | memoryview) -> bytes:
    """Return the file in a serialised CompressedImage.

    Raises:
        CdrReadError: the message is cut off.
    """
    reader = CdrReader(data)
    reader.header()
    reader.text()
    return bytes(reader.octets())


def _read_raw(reader: CdrReader, size: tuple[int, int] | None) -> ReadImage:
    head, height, width, encoding = reader.header(), reader.number("I"), reader.number("I"), reader.text()
    order, step = ">" if reader.number("B") else "<", reader.number("I")
    _refuse_size((height, width), size)
    pixels = raw_pixels(encoding, height, width, reader.octets(), step, order)
    own = np.array(pixels[..., ::-1] if encoding == "bgr8" else pixels, pixels.dtype.newbyteorder("="), order="C")
    return ReadImage(head, encoding, own)


def raw_pixels(encoding: str, height: int, width: int, octets: Any, step: int = 0, order: str = "<") -> NDArray[Any]:
    """Return the pixels of an Image, (height, width) or (height, width, channels), as it has them; a view where rows have no gaps.

    ``step``: bytes of a row; 0 for as many as its pixels have.
    ``order``: of the bytes of a number, ``<`` or ``>``.

    Raises:
        CodecError: the encoding is none of these, or the data is too short.
    """
    if encoding not in ENCODINGS:
        raise CodecError(f"expected an image encoded as one of {', '.join(ENCODINGS)}, got '{encoding[:40]}'")
    kind, channels = ENCODINGS[encoding]
    dtype = np.dtype(f"{order}{kind}")
    row = width * channels * dtype.itemsize
    step = step or row
    if step < row or len(octets) < step * height:
        raise CodecError(f"expected {height} rows of {row} bytes ({encoding}), got {len(octets)} bytes in rows of {step}")
    rows = np.frombuffer(octets, np.uint8, step * height).reshape(height, step)[:, :row]
    pixels = np.ascontiguousarray(rows).view(dtype)
    return pixels if channels == 1 else pixels.reshape(height, width, channels)


def _read_compressed(reader: CdrReader, topic: str, size: tuple[int, int] | None) -> ReadImage:
    head, form = reader.header(), reader.text()
    return ReadImage(head, form, decode_pixels(topic, reader.octets(), size))


def _refuse_size(found: tuple[int, int], size: tuple[int, int] | None) -> None:
    height, width = found
    if size is not None and found != size:
        raise CodecError(f"expected {size[1]}x{size[0]} pixels, as camera_info says, got {width}x{height}")
    if not 0 < height * width <= MAX_PIXELS:
        raise CodecError(f"expected an image of 1 to {MAX_PIXELS} pixels, got {width}x{height}")


def decode_pixels(topic: str, data: bytes | memoryview, size: tuple[int, int] | None = None) -> NDArray[Any]:
    """Return the pixels of a compressed image.

    The compressed topic says whether it is depth; ``size`` is as :func:`read_image` has it.

    Raises:
        CodecError: it is neither PNG nor JPEG, damaged, or of another size, which is found before its pixels are decoded.
    """
    from PIL import Image as Picture  # nodes that read no pictures start without it

    is_depth = topic.endswith(TRANSPORTS[2])
    a, b, data = split_depth(data) if is_depth else (0.0, 0.0, data)
    try:
        with Picture.open(io.BytesIO(data), formats=("PNG", "JPEG")) as picture:
            _refuse_size((picture.height, picture.width), size)
            pixels = np.array(picture if picture.mode in _PLAIN_MODES else picture.convert("RGB"))
    except CodecError:
        raise
    except Exception as error:  # of files that were damaged, or made to do harm, Pillow raises whatever its parts meet
        raise CodecError(f"expected PNG or JPEG ({' '.join(str(error).split())[:100]})") from None
    if is_depth and pixels.ndim != 2:
        raise CodecError("compressedDepth: expected a PNG of one channel, got one of colours")
    return depth_from_codes(pixels, a, b)


def split_depth(data: bytes | memoryview) -> tuple[float, float, bytes | memoryview]:
    """Return A, B and the PNG of a ``compressedDepth``.

    Raises:
        CodecError: it is too short.
    """
    if len(data) <= _DEPTH_HEAD.size:
        raise CodecError(f"compressedDepth: expected more than {_DEPTH_HEAD.size} bytes, got {len(data)}")
    _, a, b = _DEPTH_HEAD.unpack_from(data)
    return a, b, data[_DEPTH_HEAD.size :]


def depth_from_codes(codes: NDArray[np.uint16], a: float, b: float) -> NDArray[Any]:
    """Return depth: float32 metres of inverse depth, +inf where none is stored; millimetres (A is 0) as they are."""
    if not a:
        return codes
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(codes > 0, a / (codes - np.float64(b)), np.inf).astype(np.float32)
