"""What ids mean, as ``vision_msgs/msg/LabelInfo``, made of the JSON labels beside it; vision_msgs is not installed everywhere.

The message maps ids of 16 bits to names.  Colours and, of objects, classes are in the JSON only.  Its ``threshold``, below which a detector
drops what it has found, is 0: nothing was dropped.
"""

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message

from renderer.film.layers import LAYERS
from scene_description import SceneSynthError
from scene_description.labels import LabelTable
from scene_synth_ros.messages.cdr import CdrReadError, CdrWriter, read_text
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.messages.streams import LABEL_INFO_TYPE, LABELS, STRING_TYPE, parse

_LARGEST_ID = 2**16 - 1


class LabelReadError(SceneSynthError):
    """Bytes that are no labels; one line."""


class TimedLabels(NamedTuple):
    """The names of ids at a stamp."""

    stamp_ns: int
    names: dict[int, str]


def is_labels(topic: str, type_name: str) -> bool:
    """Return whether a topic carries the JSON labels of a layer."""
    stream = parse(topic, type_name)
    return stream is not None and stream.role is LABELS and stream.layer in LAYERS and LAYERS[stream.layer].labels is not None


def label_info_to_msg(labels: LabelTable, stamp: int, frame_id: str) -> Any:
    """Return an id table as a message; the class of its type must be installed."""
    data = encode_label_info(stamp, frame_id, {key: str(value["name"]) for key, value in labels.items()})
    return deserialize_message(data, message_class(LABEL_INFO_TYPE))


def read_labels(data: bytes) -> TimedLabels:
    """Return what serialised JSON labels say.

    Raises:
        LabelReadError: they have no stamp, or no names by ids of 16 bits.
    """
    try:
        stamp = stamp_ns(STRING_TYPE, data)
        table = json.loads(read_text(data))["labels"]
        names = {int(key): value["name"] for key, value in table.items()}
    except (CdrReadError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise LabelReadError(f"labels cannot be read ({len(data)} bytes): {' '.join(str(error).split())[:200]}") from None
    if stamp is None or not all(0 <= key <= _LARGEST_ID and isinstance(name, str) for key, name in names.items()):
        raise LabelReadError(f"labels cannot be read: expected a stamp and names by ids from 0 to {_LARGEST_ID}")
    return TimedLabels(stamp, names)


def encode_label_info(stamp: int, frame_id: str, names: Mapping[int, str]) -> bytes:
    """Return the message as little-endian plain CDR with its encapsulation header.

    Raises:
        ValueError: the stamp does not fit ``builtin_interfaces/Time``.
    """
    writer = CdrWriter()
    writer.header(stamp, frame_id)
    writer.numbers("I", len(names))
    for key, name in names.items():
        writer.numbers("H", key)
        writer.text(name)
    writer.numbers("f", 0.0)
    return writer.message()
