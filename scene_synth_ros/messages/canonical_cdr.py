"""Serialises messages so that equal ones are equal bytes.

CDR aligns fields (OMG DDS-RTPS 2.5, section 10.2), and serialisers leave what was in memory in the gaps; here these are zero.
"""

from __future__ import annotations

import importlib
import struct
from functools import cache
from typing import Any

from rclpy.serialization import serialize_message
from rosidl_parser.definition import AbstractNestedType, AbstractSequence, AbstractString, Array, BasicType, NamespacedType
from sensor_msgs.msg import Image

from scene_synth_ros.messages.cdr_writer import CdrWriter
from scene_synth_ros.messages.stamps import NANOSECONDS

_START = 4
"""Bytes of the encapsulation header; positions are counted from behind it."""
_SIZES = {
    **dict.fromkeys(("boolean", "octet", "char", "uint8", "int8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float"), 4),
    **dict.fromkeys(("int64", "uint64", "double"), 8),
}
"""Primitive of IDL -> its size, which is its alignment too."""


def canonical_cdr(message: Any) -> bytes:
    """Return a message as plain little-endian CDR with its encapsulation header.

    Raises:
        ValueError: it holds a kind of field that no message of this suite has.
    """
    if type(message) is Image:
        return _image_cdr(message)
    data = bytes(serialize_message(message))
    walk = _Walk(data)
    walk.structure(type(message))
    if not walk.position <= len(data) - _START < walk.position + 4:
        raise ValueError(f"{type(message).__name__}: expected fields up to byte {len(data) - _START}, got {walk.position}")
    pieces, begin = [], 0
    for start, end in walk.gaps:
        if any(data[start:end]):
            pieces += [data[begin:start], bytes(end - start)]
            begin = end
    return b"".join([*pieces, data[begin : _START + walk.position]])


def _image_cdr(message: Image) -> bytes:
    """Return an image without going through the serialiser, which copies the pixels three times."""
    stamp = message.header.stamp
    fields = CdrWriter()
    fields.header(stamp.sec * NANOSECONDS + stamp.nanosec, message.header.frame_id)
    fields.numbers("I", message.height, message.width)
    fields.text(message.encoding)
    fields.numbers("B", message.is_bigendian)
    fields.numbers("I", message.step, len(message.data))
    return b"".join([fields.message(), memoryview(message.data)])


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
