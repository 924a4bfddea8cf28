"""The stamp of a serialised message, read from its CDR bytes without decoding the rest.

A message with a ``std_msgs/Header`` as its first field has the stamp in the first eight bytes after the four-byte encapsulation header
(OMG DDS-RTPS 2.5, section 10.2); others have a reader of their own in a table.
"""

import json
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeGuard

from scene_synth_ros.messages.streams import CLOCK_TYPE, MARKERS_TYPE, STRING_TYPE, TF_TYPE

CdrBytes = bytes | bytearray | memoryview
StampReader = Callable[[CdrBytes, str], "int | None"]

NANOSECONDS = 1_000_000_000

_ENCAPSULATION_SIZE = 4
_ENDIANNESS = {0: ">", 1: "<", 6: ">", 7: "<"}
_MAX_JSON_LENGTH = 64 * 2**20
_MAX_STAMP_NS = 2**63


def stamp_ns(type_name: str, cdr: CdrBytes) -> int | None:
    """Return the stamp of a message in nanoseconds, or None if it has none or is cut off.

    It is plain CDR of either endianness (XCDR1 or final XCDR2 types).
    """
    reader = STAMP_READERS.get(type_name)
    if reader is None or len(cdr) < _ENCAPSULATION_SIZE or cdr[0] != 0 or cdr[1] not in _ENDIANNESS:
        return None
    return reader(cdr, _ENDIANNESS[cdr[1]])


def _time_at(cdr: CdrBytes, endianness: str, offset: int) -> int | None:
    if len(cdr) < offset + 8:
        return None
    sec, nanosec = struct.unpack_from(f"{endianness}iI", cdr, offset)
    return _join(sec, nanosec)


def _first_time(cdr: CdrBytes, endianness: str) -> int | None:
    """Read a ``builtin_interfaces/Time`` that stands first, itself or in a header."""
    return _time_at(cdr, endianness, _ENCAPSULATION_SIZE)


def _first_item_time(cdr: CdrBytes, endianness: str) -> int | None:
    """Read the header stamp of the first item of a sequence that stands first."""
    if len(cdr) < _ENCAPSULATION_SIZE + 4 or not struct.unpack_from(f"{endianness}I", cdr, _ENCAPSULATION_SIZE)[0]:
        return None
    return _time_at(cdr, endianness, _ENCAPSULATION_SIZE + 4)


def _json_time(cdr: CdrBytes, endianness: str) -> int | None:
    """Read ``stamp_ns`` or ``stamp: {sec, nanosec}`` of a JSON object, or the first stamp of the camera path of a scene."""
    data = _json_object(cdr, endianness)
    whole = data.get("stamp_ns")
    if _is_integer(whole):
        return whole
    stamp = data.get("stamp")
    if isinstance(stamp, Mapping) and _is_integer(stamp.get("sec")) and _is_integer(stamp.get("nanosec")):
        return _join(stamp["sec"], stamp["nanosec"])
    return next(iter(_path_stamps(data)), None)


@dataclass(frozen=True, slots=True)
class AnnouncedRoom:
    """What a scene description says of the frames to come: number of the room (None if it has none), stamps of its camera path."""

    index: int | None
    stamps_ns: list[int]


def announced_room(cdr: CdrBytes) -> AnnouncedRoom:
    """Read the scene description in a serialised ``std_msgs/msg/String``; without stamps if it is none."""
    if len(cdr) < _ENCAPSULATION_SIZE or cdr[0] != 0 or cdr[1] not in _ENDIANNESS:
        return AnnouncedRoom(None, [])
    data = _json_object(cdr, _ENDIANNESS[cdr[1]])
    index = data.get("index")
    return AnnouncedRoom(index if _is_integer(index) else None, _path_stamps(data))


class FramePlace(NamedTuple):
    """What the settings of a frame say of its place in the order of time.

    Attributes:
        stamp_ns: of the frame.
        sent_ns: topic below the namespace -> stamp of its last message that was sent before the frame.
        asked: whether it was asked for, and has no place there.
    """

    stamp_ns: int
    sent_ns: dict[str, int]
    asked: bool


def frame_place(cdr: CdrBytes) -> FramePlace | None:
    """Read ``sent`` and ``asked`` of frame settings in a serialised ``std_msgs/msg/String``; None if there is nothing of the kind."""
    if not (b'"sent"' in (text := bytes(cdr)) or b'"asked"' in text) or cdr[0] != 0 or cdr[1] not in _ENDIANNESS:
        return None
    data = _json_object(cdr, _ENDIANNESS[cdr[1]])
    stamp, sent, asked = data.get("stamp_ns"), data.get("sent", {}), data.get("asked", False)
    if not _is_integer(stamp) or not isinstance(sent, Mapping):
        return None
    return FramePlace(stamp, {str(name): last for name, last in sent.items() if _is_integer(last)}, asked is True)


def _path_stamps(data: Mapping[str, Any]) -> list[int]:
    path = data.get("camera_path")
    if not isinstance(path, list):
        return []
    stamps = [pose.get("stamp_ns") for pose in path if isinstance(pose, Mapping)]
    return [stamp for stamp in stamps if _is_integer(stamp)]


def _json_object(cdr: CdrBytes, endianness: str) -> Mapping[str, Any]:
    """Return the JSON object that a serialised string holds; empty if it holds none."""
    start = _ENCAPSULATION_SIZE + 4
    if len(cdr) < start or len(cdr) > _MAX_JSON_LENGTH:
        return {}
    (length,) = struct.unpack_from(f"{endianness}I", cdr, _ENCAPSULATION_SIZE)
    try:
        data = json.loads(bytes(cdr[start : start + max(length - 1, 0)]))
    except (ValueError, RecursionError):
        return {}
    return data if isinstance(data, Mapping) else {}


def _is_integer(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < _MAX_STAMP_NS


def _join(sec: int, nanosec: int) -> int | None:
    stamp = sec * NANOSECONDS + nanosec
    return stamp if 0 <= nanosec < NANOSECONDS and abs(stamp) < _MAX_STAMP_NS else None


_HEADER_FIRST = """
diagnostic_msgs/msg/DiagnosticArray
geometry_msgs/msg/PointStamped geometry_msgs/msg/PolygonStamped geometry_msgs/msg/PoseArray geometry_msgs/msg/PoseStamped
geometry_msgs/msg/PoseWithCovarianceStamped geometry_msgs/msg/TransformStamped geometry_msgs/msg/TwistStamped
nav_msgs/msg/OccupancyGrid nav_msgs/msg/Odometry nav_msgs/msg/Path
sensor_msgs/msg/CameraInfo sensor_msgs/msg/CompressedImage sensor_msgs/msg/Image sensor_msgs/msg/Imu sensor_msgs/msg/JointState
sensor_msgs/msg/LaserScan sensor_msgs/msg/PointCloud2 sensor_msgs/msg/Range
vision_msgs/msg/Detection2DArray vision_msgs/msg/Detection3DArray vision_msgs/msg/LabelInfo
visualization_msgs/msg/ImageMarker visualization_msgs/msg/Marker
""".split()

STAMP_READERS: Mapping[str, StampReader] = {
    **dict.fromkeys(_HEADER_FIRST, _first_time),
    CLOCK_TYPE: _first_time,
    TF_TYPE: _first_item_time,
    MARKERS_TYPE: _first_item_time,
    STRING_TYPE: _json_time,
}
