"""Serialised images as arrays, without ROS: ``sensor_msgs/Image`` and ``sensor_msgs/CompressedImage`` of whatever sender.

``compressedDepth`` has twelve bytes before its PNG, see :mod:`scene_synth_ros.messages.image_codec`.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from scene_description import SceneSynthError
from scene_synth_ros.messages.cdr_reader import CdrReader, CdrReadError, Header
from scene_synth_ros.messages.streams import COMPRESSED_TYPE, IMAGE_TYPE, TRANSPORTS

_ENCODINGS: Mapping[str, tuple[str, int]] = {
    "mono8": ("u1", 1), "8UC1": ("u1", 1), "mono16": ("u2", 1), "16UC1": ("u2", 1), "16SC1": ("i2", 1), "32SC1": ("i4", 1),
    "32FC1": ("f4", 1), "64FC1": ("f8", 1), "32FC2": ("f4", 2), "64FC2": ("f8", 2), "32FC3": ("f4", 3), "64FC3": ("f8", 3),
    "rgb8": ("u1", 3), "bgr8": ("u1", 3), "8UC3": ("u1", 3),
}  # fmt: skip
"""Image encoding -> kind and size of a number, numbers a pixel."""
_DEPTH_HEAD = struct.Struct("<iff")


class CodecError(SceneSynthError):
    """An image that cannot be read, or compressed as asked; one line."""


class ReadImage(NamedTuple):
    """An image: header, encoding (of compressed ones, their format), pixels (height, width) or (height, width, channels), writable."""

    header: Header
    encoding: str
    pixels: NDArray[Any]


def read_image(type_name: str, data: bytes | memoryview, topic: str) -> ReadImage:
    """Return the image in a serialised message; ``bgr8`` as red, green, blue.

    Args:
        type_name: a key of ``IMAGE_READERS``.
        data: the message as plain CDR.
        topic: says of a compressed image whether it is depth.

    Raises:
        CodecError: the message is cut off, or its pixels cannot be decoded.
    """
    try:
        return IMAGE_READERS[type_name](CdrReader(data), topic)
    except CdrReadError as error:
        raise CodecError(f"{topic}: {error}") from None


def read_compressed(data: bytes | memoryview) -> bytes:
    """Return the file in a serialised CompressedImage.

    Raises:
        CdrReadError: the message is cut off.
    """
    reader = CdrReader(data)
    reader.header()
    reader.text()
    return bytes(reader.octets())


def _read_raw(reader: CdrReader, topic: str) -> ReadImage:
    head, height, width, encoding = reader.header(), reader.number("I"), reader.number("I"), reader.text()
    order, step = ">" if reader.number("B") else "<", reader.number("I")
    if encoding not in _ENCODINGS:
        raise CodecError(f"expected an image encoded as one of {', '.join(_ENCODINGS)}, got '{encoding[:40]}'")
    kind, channels = _ENCODINGS[encoding]
    dtype = np.dtype(f"{order}{kind}")
    octets, row = reader.octets(), width * channels * dtype.itemsize
    step = step or row
    if step < row or len(octets) < step * height:
        raise CodecError(f"expected {height} rows of {row} bytes ({encoding}), got {len(octets)} bytes in rows of {step}")
    rows = np.frombuffer(octets, np.uint8, step * height).reshape(height, step)[:, :row]
    pixels = rows.copy().view(dtype).astype(dtype.newbyteorder("="), copy=False)
    shaped = pixels if channels == 1 else pixels.reshape(height, width, channels)
    return ReadImage(head, encoding, np.ascontiguousarray(shaped[..., ::-1]) if encoding == "bgr8" else shaped)


def _read_compressed(reader: CdrReader, topic: str) -> ReadImage:
    head, form = reader.header(), reader.text()
    return ReadImage(head, form, decode_pixels(topic, reader.octets()))


IMAGE_READERS: Mapping[str, Callable[[CdrReader, str], ReadImage]] = {IMAGE_TYPE: _read_raw, COMPRESSED_TYPE: _read_compressed}
"""Message type -> what reads it."""


def decode_pixels(topic: str, data: bytes | memoryview) -> NDArray[Any]:
    """Return the pixels of a compressed image.

    Args:
        topic: compressed; says whether it is depth.
        data: of the message.

    Raises:
        CodecError: it is neither PNG nor JPEG.
    """
    a = b = 0.0
    if topic.endswith(TRANSPORTS[2]):
        a, b, data = split_depth(data)
    try:
        with Picture.open(io.BytesIO(data), formats=("PNG", "JPEG")) as picture:
            pixels = np.array(picture)
    except (OSError, ValueError, Picture.DecompressionBombError) as error:
        raise CodecError(f"{topic}: expected PNG or JPEG ({' '.join(str(error).split())[:100]})") from None
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
