"""Serialises ``tf2_msgs/msg/TFMessage`` without the package tf2_msgs, which not every installation has."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

from scene_synth_ros.messages.stamps import NANOSECONDS

_LITTLE_ENDIAN_CDR = b"\x00\x01\x00\x00"


class StampedTransform(NamedTuple):
    """The pose of frame ``child`` in frame ``parent``: metres, unit quaternion (x, y, z, w)."""

    stamp_ns: int
    parent: str
    child: str
    translation_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def encode_tf_message(transforms: Sequence[StampedTransform]) -> bytes:
    """Return the message as little-endian plain CDR with its encapsulation header.

    Plain CDR aligns every primitive to its own size, counted from behind the encapsulation header (OMG DDS-RTPS 2.5, section 10).

    Raises:
        ValueError: a stamp does not fit ``builtin_interfaces/Time``.
    """
    payload = bytearray(struct.pack("<I", len(transforms)))
    for transform in transforms:
        sec, nanosec = divmod(transform.stamp_ns, NANOSECONDS)
        if not -(2**31) <= sec < 2**31:
            raise ValueError(f"transform {transform.parent} -> {transform.child}: expected a stamp of 32-bit seconds, got {sec} s")
        _align(payload, 4)
        payload += struct.pack("<iI", sec, nanosec)
        _append_string(payload, transform.parent)
        _append_string(payload, transform.child)
        _align(payload, 8)
        payload += struct.pack("<7d", *transform.translation_m, *transform.quaternion)
    return _LITTLE_ENDIAN_CDR + bytes(payload)


def _append_string(payload: bytearray, text: str) -> None:
    """Append length (with the final zero), characters, zero."""
    encoded = text.encode() + b"\x00"
    _align(payload, 4)
    payload += struct.pack("<I", len(encoded)) + encoded


def _align(payload: bytearray, size: int) -> None:
    payload += bytes(-len(payload) % size)
