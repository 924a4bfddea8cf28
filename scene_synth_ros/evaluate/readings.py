"""Serialised messages as arrays: one reader a message type, for truth and estimates alike.

A reader takes the bytes of a message and returns a :class:`Reading`.  Images come as (height, width) or (height, width, channels) with the
dtype that their encoding says.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from geometry_msgs.msg import Pose
from nav_msgs.msg import Odometry, Path
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2, PointField

from scene_description import CameraPose
from scene_synth_ros.evaluate.errors import EstimateError
from scene_synth_ros.messages.cdr import CdrReader, CdrReadError
from scene_synth_ros.messages.image_reader import CodecError, read_image
from scene_synth_ros.messages.poses import PoseReadError, read_pose
from scene_synth_ros.messages.stamps import NANOSECONDS, CdrBytes
from scene_synth_ros.messages.streams import (
    CLOUD_TYPE,
    COMPRESSED_TYPE,
    DETECTIONS_2D_TYPE,
    DETECTIONS_3D_TYPE,
    IMAGE_TYPE,
    ODOMETRY_TYPE,
    PATH_TYPE,
    POSE_TYPE,
    TF_TYPE,
)

_POINT_TYPES = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}
_LABEL_TYPES = {PointField.UINT8: "u1", PointField.UINT16: "u2", PointField.UINT32: "u4", PointField.INT32: "i4"}


@dataclass(frozen=True, slots=True, eq=False)
class BoxList:
    """What a detector has found in a frame.

    Attributes:
        class_ids: (n,) the class of each box, as text.
        scores: (n,) float64, in [0, 1].
        boxes: (n, 4) float64, left, top, width and height in pixels; or (n, 10): centre [m], quaternion (x, y, z, w), size [m].
        ids: (n,) of the objects; empty texts where a detector does not track.
        distances_m: (n,) float64, where the objects are along the optical axis, as the poses in the message say; None where it has none.
    """

    class_ids: tuple[str, ...]
    scores: NDArray[np.float64]
    boxes: NDArray[np.float64]
    ids: tuple[str, ...]
    distances_m: NDArray[np.float64] | None = None


class Cloud(NamedTuple):
    """The finite points of a cloud: (n, 3) float64, metres; class ids (n,) where the cloud has the field ``label``."""

    points: NDArray[np.float64]
    labels: NDArray[np.int64] | None = None


class Reading(NamedTuple):
    """What a message says: an array, a Cloud, a BoxList or a tuple of CameraPose; and the frame that its header names.

    What an algorithm has returned has no header; it is meant in the frame of the truth, and ``frame_id`` is None.
    """

    value: Any
    frame_id: str | None


def _read_image(type_name: str, data: bytes, topic: str) -> Reading:
    image = read_image(type_name, data, topic)
    return Reading(image.pixels, image.header.frame_id)


def _read_cloud(data: bytes, topic: str) -> Reading:
    message = deserialize_message(data, PointCloud2)
    fields = {field.name: field for field in message.fields}
    if not {"x", "y", "z"} <= fields.keys() or any(fields[axis].datatype not in _POINT_TYPES for axis in "xyz"):
        raise EstimateError(f"expected points with x, y and z as float32 or float64, got {', '.join(fields) or 'no fields'}")
    kinds = {axis: _POINT_TYPES[fields[axis].datatype] for axis in "xyz"}
    if "label" in fields and fields["label"].datatype in _LABEL_TYPES:
        kinds["label"] = _LABEL_TYPES[fields["label"].datatype]
    outside = [name for name, kind in kinds.items() if fields[name].offset + np.dtype(kind).itemsize > message.point_step]
    if outside:  # numpy adds such numbers in 32 bits, and would read beyond the message
        raise EstimateError(f"expected fields within points of {message.point_step} bytes, got {outside[0]} at {fields[outside[0]].offset}")
    order = ">" if message.is_bigendian else "<"
    record: Any = {
        "names": list(kinds),
        "formats": [f"{order}{kind}" for kind in kinds.values()],
        "offsets": [fields[name].offset for name in kinds],
        "itemsize": message.point_step,
    }
    try:
        form = np.dtype(record)
        rows = np.frombuffer(message.data, np.uint8, message.row_step * message.height).reshape(message.height, message.row_step)
        octets = np.ascontiguousarray(rows[:, : message.point_step * message.width])
        records = octets.reshape(-1).view(form) if octets.size else np.empty(0, form)
    except ValueError:  # numpy's, for too few bytes
        got = f"{len(message.data)} bytes in rows of {message.row_step}"
        raise EstimateError(f"expected {message.width}x{message.height} points of {message.point_step} bytes, got {got}") from None
    points = np.stack([records[axis].astype(np.float64) for axis in "xyz"], axis=1)
    finite = np.isfinite(points).all(axis=1)
    labels = records["label"].astype(np.int64)[finite] if "label" in kinds else None
    return Reading(Cloud(points[finite], labels), message.header.frame_id)


def _stamped(header: Any, pose: Pose) -> CameraPose:
    p, q = pose.position, pose.orientation
    stamp_ns = header.stamp.sec * NANOSECONDS + header.stamp.nanosec
    return CameraPose(stamp_ns=stamp_ns, position_m=(p.x, p.y, p.z), orientation=(q.x, q.y, q.z, q.w))


def _read_pose(data: bytes, topic: str) -> Reading:
    pose = read_pose(data)
    return Reading((pose.camera_pose,), pose.parent)


def _read_odometry(data: bytes, topic: str) -> Reading:
    message = deserialize_message(data, Odometry)
    return Reading((_stamped(message.header, message.pose.pose),), message.header.frame_id)


def _read_path(data: bytes, topic: str) -> Reading:
    message = deserialize_message(data, Path)
    return Reading(tuple(_stamped(pose.header, pose.pose) for pose in message.poses), message.header.frame_id)


def read_transforms(data: bytes, child: str) -> Reading:
    """Return the poses of one frame in a ``tf2_msgs/msg/TFMessage``, in whatever frame is above it.

    An empty ``child`` takes every transform.
    """
    reader = CdrReader(data)
    poses, parent = [], ""
    for _ in range(reader.number("I")):
        header, name, numbers = reader.header(), reader.text(), reader.numbers("d", 7)
        if name == child or not child:
            parent = header.frame_id
            x, y, z, qx, qy, qz, qw = numbers
            poses.append(CameraPose(stamp_ns=header.stamp_ns, position_m=(x, y, z), orientation=(qx, qy, qz, qw)))
    return Reading(tuple(poses), parent)


def _read_detections_2d(data: bytes, topic: str) -> Reading:
    def box(reader: CdrReader) -> tuple[float, ...]:
        x, y, _, width, height = reader.numbers("d", 5)
        return x - 0.5 * width, y - 0.5 * height, width, height

    return _read_detections(data, box, 4)


def _read_detections_3d(data: bytes, topic: str) -> Reading:
    return _read_detections(data, lambda reader: reader.numbers("d", 10), 10)


def _read_detections(data: bytes, read_box: Callable[[CdrReader], tuple[float, ...]], width: int) -> Reading:
    reader = CdrReader(data)
    header = reader.header()
    classes, scores, boxes, ids, distances = [], [], [], [], []
    for _ in range(reader.number("I")):
        reader.header()
        best, score, distance = "", -np.inf, np.nan
        for _ in range(reader.number("I")):
            name, value = reader.text(), reader.numbers("d")[0]
            pose = reader.numbers("d", 7 + 36)
            if value > score:
                best, score, distance = name, value, pose[2]
        classes.append(best)
        scores.append(max(score, 0.0))
        boxes.append(read_box(reader))
        ids.append(reader.text())
        distances.append(distance)
    numbers = np.array(boxes, np.float64).reshape(-1, width)
    found = BoxList(tuple(classes), np.array(scores, np.float64), numbers, tuple(ids), np.array(distances, np.float64))
    return Reading(found, header.frame_id)


READERS: dict[str, Callable[[bytes, str], Reading]] = {
    IMAGE_TYPE: partial(_read_image, IMAGE_TYPE),
    COMPRESSED_TYPE: partial(_read_image, COMPRESSED_TYPE),
    CLOUD_TYPE: _read_cloud,
    POSE_TYPE: _read_pose,
    ODOMETRY_TYPE: _read_odometry,
    PATH_TYPE: _read_path,
    TF_TYPE: lambda data, topic: read_transforms(data, topic.partition("@")[2]),
    DETECTIONS_2D_TYPE: _read_detections_2d,
    DETECTIONS_3D_TYPE: _read_detections_3d,
}
"""Message type -> its reader, which takes the bytes and the topic; a topic of transforms says which frame after an @: ``/tf@base_link``."""


def read_message(type_name: str, data: CdrBytes, topic: str) -> Reading:
    """Return what a message says.

    Raises:
        EstimateError: it is damaged, or of a form that no task takes; one line without the topic.
    """
    try:
        return READERS[type_name](bytes(data), topic)
    except (RuntimeError, UnicodeDecodeError, CdrReadError, CodecError, PoseReadError) as error:  # the first two of Fast CDR
        raise EstimateError(f"a {type_name} cannot be read ({len(data)} bytes): {' '.join(str(error).split())[:200]}") from None
