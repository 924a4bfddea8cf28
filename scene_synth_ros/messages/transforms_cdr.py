"""Serialises ``tf2_msgs/msg/TFMessage`` without the package tf2_msgs, which not every installation has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from scene_synth_ros.messages.cdr_writer import CdrWriter


class StampedTransform(NamedTuple):
    """The pose of frame ``child`` in frame ``parent``: metres, unit quaternion (x, y, z, w)."""

    stamp_ns: int
    parent: str
    child: str
    translation_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def encode_tf_message(transforms: Sequence[StampedTransform]) -> bytes:
    """Return the message as little-endian plain CDR with its encapsulation header.

    Raises:
        ValueError: a stamp does not fit ``builtin_interfaces/Time``.
    """
    writer = CdrWriter()
    writer.numbers("I", len(transforms))
    for transform in transforms:
        try:
            writer.header(transform.stamp_ns, transform.parent)
        except ValueError as error:
            raise ValueError(f"transform {transform.parent} -> {transform.child}: {error}") from None
        writer.text(transform.child)
        writer.numbers("d", *transform.translation_m, *transform.quaternion)
    return writer.message()
