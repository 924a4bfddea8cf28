"""Writes plain CDR, little-endian, for messages whose packages are not installed everywhere.

Plain CDR aligns every primitive to its own size, counted from behind the encapsulation header (OMG DDS-RTPS 2.5, section 10).
"""

from __future__ import annotations

import struct

from scene_synth_ros.messages.stamps import NANOSECONDS

_LITTLE_ENDIAN_CDR = b"\x00\x01\x00\x00"


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
