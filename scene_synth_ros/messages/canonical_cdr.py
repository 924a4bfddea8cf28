"""Serialises messages so that equal ones are equal bytes.

CDR aligns fields (OMG DDS-RTPS 2.5, section 10.2), and serialisers leave what was in memory in the gaps; here these are zero.
"""

import importlib
import struct
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from rosidl_parser.definition import AbstractNestedType, AbstractSequence, AbstractString, Array, BasicType, NamespacedType
from sensor_msgs.msg import Image
from std_msgs.msg import String

from renderer.camera.config import CameraConfig
from scene_synth_ros.messages.cdr import CdrWriter
from scene_synth_ros.messages.conversions import camera_info_to_msg, image_step
from scene_synth_ros.messages.stamps import NANOSECONDS

_START = 4
"""Bytes of the encapsulation header; positions are counted from behind it."""
_LARGEST = 8
_SIZES = {
    **dict.fromkeys(("boolean", "octet", "char", "uint8", "int8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float"), 4),
    **dict.fromkeys(("int64", "uint64", "double"), 8),
}
"""Primitive of IDL -> its size, which is its alignment too."""


def canonical_cdr(message: Any) -> bytes:
    """Return a message as plain little-endian CDR with its encapsulation header; bytes are such a message already.

    Raises:
        ValueError: it holds a kind of field that no message of this suite has.
    """
    writer = _WRITERS.get(type(message))
    if writer is not None:
        return writer(message)
    data = bytes(serialize_message(message))
    walk = _Walk(data)
    walk.structure(type(message))
    if not walk.position <= len(data) - _START < walk.position + _LARGEST:  # an empty list of doubles at the end may be aligned
        raise ValueError(f"{type(message).__name__}: expected fields up to byte {len(data) - _START}, got {walk.position}")
    pieces, begin = [], 0
    for start, end in walk.gaps:
        if any(data[start:end]):
            pieces += [data[begin:start], bytes(end - start)]
            begin = end
    return b"".join([*pieces, data[begin : _START + walk.position]])


def image_cdr(image: NDArray[np.generic], encoding: str, stamp_ns: int, frame_id: str) -> bytes:
    """Return what ``image_to_msg`` makes of the same values, serialised; the pixels are copied once.

    Raises:
        ValueError: dtype, channels or memory layout do not fit the encoding.
    """
    step = image_step(image, encoding)
    return _image(stamp_ns, frame_id, image.shape[0], image.shape[1], encoding, 0, step, image.data.cast("B"))


def camera_info_cdr(camera: CameraConfig, stamp_ns: int, frame_id: str) -> bytes:
    """Return what ``camera_info_to_msg`` makes of the same values, serialised; all but the stamp is kept from call to call."""
    unstamped = _unstamped_camera_info(camera, frame_id)
    return unstamped[:_START] + struct.pack("<iI", *divmod(stamp_ns, NANOSECONDS)) + unstamped[_START + 8 :]


@lru_cache(16)
def _unstamped_camera_info(camera: CameraConfig, frame_id: str) -> bytes:
    return canonical_cdr(camera_info_to_msg(camera, 0, frame_id))


def _image(stamp_ns: int, frame_id: str, height: int, width: int, encoding: str, is_bigendian: int, step: int, pixels: memoryview) -> bytes:
    fields = CdrWriter()
    fields.header(stamp_ns, frame_id)
    fields.numbers("I", height, width)
    fields.text(encoding)
    fields.numbers("B", is_bigendian)
    fields.numbers("I", step, len(pixels))
    return b"".join([fields.message(), pixels])


def _image_message(message: Image) -> bytes:
    """Return an image without going through the serialiser, which copies the pixels three times."""
    stamp, frame_id = message.header.stamp, message.header.frame_id
    stamp_ns, size = stamp.sec * NANOSECONDS + stamp.nanosec, (message.height, message.width)
    return _image(stamp_ns, frame_id, *size, message.encoding, message.is_bigendian, message.step, memoryview(message.data))


def _text_message(message: String) -> bytes:
    fields = CdrWriter()
    fields.text(message.data)
    return fields.message()


_WRITERS: dict[type, Callable[[Any], bytes]] = {bytes: bytes, Image: _image_message, String: _text_message}
"""Type of a message -> what serialises it without looking for gaps."""


class _Walk:
    """Goes through a serialised message field by field and notes where it was padded.

    Attributes:
        position: of the next field, without padding before it.
        gaps: first byte of each padding, and the one after it, in the whole message.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.position = 0
        self.gaps: list[tuple[int, int]] = []

    def structure(self, message_type: Any) -> None:
        """Go through all fields of a message of a type."""
        for field in message_type.SLOT_TYPES:
            self._field(field)

    def _field(self, field: Any) -> None:
        if isinstance(field, BasicType):
            self._numbers(_SIZES[field.typename], 1)
        elif isinstance(field, AbstractString):
            self._numbers(1, self._length())
        elif isinstance(field, NamespacedType):
            self.structure(_class_of(field))
        elif isinstance(field, AbstractNestedType):
            count = self._length() if isinstance(field, AbstractSequence) else field.size if isinstance(field, Array) else 0
            if isinstance(field.value_type, BasicType):
                self._numbers(_SIZES[field.value_type.typename], count)
            else:
                for _ in range(count):
                    self._field(field.value_type)
        else:
            raise ValueError(f"expected numbers, strings, messages and lists of them, got {type(field).__name__}")

    def _length(self) -> int:
        self._numbers(4, 1)
        return int(struct.unpack_from("<I", self._data, _START + self.position - 4)[0])

    def _numbers(self, size: int, count: int) -> None:
        """Pass numbers of one size; an empty list is not aligned."""
        gap = -self.position % size if count else 0
        if gap:
            self.gaps.append((_START + self.position, _START + self.position + gap))
        self.position += gap + size * count


def _class_of(field: NamespacedType) -> Any:
    return _class(tuple(field.namespaces), field.name)


@cache
def _class(namespaces: tuple[str, ...], name: str) -> Any:
    return getattr(importlib.import_module(".".join(namespaces)), name)
