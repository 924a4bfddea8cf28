"""Reads and writes plain CDR field by field: messages whose packages are not installed everywhere, and large ones without copies.

Plain CDR aligns every primitive to its own size, counted from behind the encapsulation header (OMG DDS-RTPS 2.5, section 10).
"""

import json
import struct
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from scene_description import SceneSynthError
from scene_synth_ros.messages.stamps import NANOSECONDS, CdrBytes

_ENDIANNESS = {0: ">", 1: "<", 6: ">", 7: "<"}
_HEADER_SIZE = 4


@lru_cache(maxsize=256)
def _layout(text: str) -> struct.Struct:
    return struct.Struct(text)


class CdrReadError(SceneSynthError):
    """Bytes that are no such message; one line."""


class Header(NamedTuple):
    """A ``std_msgs/Header``."""

    stamp_ns: int
    frame_id: str


class CdrReader:
    """A message that is read from front to back.

    Args:
        data: the message with its encapsulation header; views of it are handed out, so it must not change.

    Raises:
        CdrReadError: there is no encapsulation header of plain CDR.  Every method raises it where the message ends too early.
    """

    def __init__(self, data: CdrBytes) -> None:
        self._data = memoryview(data).cast("B")
        if len(data) < _HEADER_SIZE or self._data[0] != 0 or self._data[1] not in _ENDIANNESS:
            raise CdrReadError(f"expected a message as plain CDR, got {len(data)} other bytes")
        self.endianness = _ENDIANNESS[self._data[1]]
        """``<`` or ``>``."""
        self._at = _HEADER_SIZE

    def numbers(self, kind: str, count: int = 1) -> tuple[float, ...]:
        """Return numbers of one kind, a character of :mod:`struct`."""
        layout, size = _layout(f"{self.endianness}{count}{kind}"), _layout(kind).size
        self._at += -(self._at - _HEADER_SIZE) % size
        return layout.unpack(self.view(size * count))

    def number(self, kind: str) -> int:
        """Return one whole number of a kind, a character of :mod:`struct`."""
        return int(self.numbers(kind)[0])

    def view(self, size: int) -> memoryview:
        """Return the next bytes without a copy."""
        if size > len(self._data) - self._at:
            raise CdrReadError(f"expected {size} more bytes at byte {self._at} of the message, got {len(self._data) - self._at}")
        self._at += size
        return self._data[self._at - size : self._at]

    def octets(self) -> memoryview:
        """Return a sequence of bytes without a copy."""
        return self.view(self.number("I"))

    def text(self) -> str:
        """Return a string."""
        return self._decoded(self.octets())

    def _decoded(self, octets: memoryview) -> str:
        try:
            return bytes(octets).rstrip(b"\x00").decode()
        except UnicodeDecodeError:
            raise CdrReadError(f"expected text before byte {self._at} of the message, got other bytes") from None

    def header(self) -> Header:
        """Return a ``std_msgs/Header``."""
        self._at += -self._at % 4
        sec, nanosec, size = _layout(f"{self.endianness}iII").unpack(self.view(12))
        return Header(sec * NANOSECONDS + nanosec, self._decoded(self.view(size)))


_LITTLE_ENDIAN_CDR = b"\x00\x01\x00\x00"


def read_text(data: CdrBytes) -> str:
    """Return the text of a serialised std_msgs/String.

    Raises:
        CdrReadError: it is cut off.
    """
    return CdrReader(data).text()


def json_object(data: CdrBytes) -> Mapping[str, Any]:
    """Return the JSON object in a serialised std_msgs/String; empty if there is none."""
    try:
        value = json.loads(read_text(data))
    except (CdrReadError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, Mapping) else {}


class CdrWriter:
    """A message that grows field by field; gaps between fields are zero."""

    def __init__(self) -> None:
        self._payload = bytearray()

    def numbers(self, kind: str, *values: float) -> None:
        """Append numbers of one kind, a character of :mod:`struct`."""
        self._payload += bytes(-len(self._payload) % struct.calcsize(kind))
        self._payload += struct.pack(f"<{len(values)}{kind}", *values)

    def text(self, text: str) -> None:
        """Append a string: length with the final zero, characters, zero."""
        encoded = text.encode() + b"\x00"
        self.numbers("I", len(encoded))
        self._payload += encoded

    def header(self, stamp_ns: int, frame_id: str) -> None:
        """Append a ``std_msgs/Header``.

        Raises:
            ValueError: the stamp does not fit ``builtin_interfaces/Time``.
        """
        sec, nanosec = divmod(stamp_ns, NANOSECONDS)
        if not -(2**31) <= sec < 2**31:
            raise ValueError(f"expected a stamp of 32-bit seconds, got {sec} s")
        self.numbers("i", sec)
        self.numbers("I", nanosec)
        self.text(frame_id)

    def message(self) -> bytes:
        """Return the message with its encapsulation header."""
        return _LITTLE_ENDIAN_CDR + bytes(self._payload)
