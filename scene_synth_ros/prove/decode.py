"""Messages as rows of numbers, read field by field as their definitions say."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.messages.cdr import CdrReader
from scene_synth_ros.prove.stack import Columns, Stack

Floats = NDArray[np.float64]


class Heads(NamedTuple):
    """How messages begin: stamps (n,) int64, frames (n,) str; of plain images height and width (n,), else zeros."""

    stamps: NDArray[np.int64]
    frames: NDArray[np.str_]
    height: NDArray[np.int64]
    width: NDArray[np.int64]


class ImuRows(NamedTuple):
    """sensor_msgs/Imu: stamps (n,) int64, frames (n,) str; quaternion (n, 4), rate and force (n, 3), covariances (n, 9)."""

    stamps: NDArray[np.int64]
    frames: NDArray[np.str_]
    quaternion: Floats
    rate: Floats
    rate_covariance: Floats
    force: Floats
    force_covariance: Floats


class OdometryRows(NamedTuple):
    """nav_msgs/Odometry: place (n, 3), quaternion (n, 4) in the frame; velocity and spin (n, 3) in the child; covariances (n, 36)."""

    stamps: NDArray[np.int64]
    frames: NDArray[np.str_]
    children: NDArray[np.str_]
    place: Floats
    quaternion: Floats
    covariance: Floats
    velocity: Floats
    spin: Floats


class JointRows(NamedTuple):
    """sensor_msgs/JointState of always the same joints: names (n, k) str, position (n, k)."""

    stamps: NDArray[np.int64]
    frames: NDArray[np.str_]
    names: NDArray[np.str_]
    position: Floats


class PoseRows(NamedTuple):
    """geometry_msgs/PoseStamped, whose children have no names, or the transforms of tf2_msgs/TFMessage; place (n, 3), quaternion (n, 4)."""

    stamps: NDArray[np.int64]
    frames: NDArray[np.str_]
    children: NDArray[np.str_]
    place: Floats
    quaternion: Floats


class ScanRow(NamedTuple):
    """A sensor_msgs/LaserScan; seconds, radians, metres."""

    stamp_ns: int
    frame: str
    angle_min: float
    angle_increment: float
    time_increment: float
    ranges: Floats


class CloudRow(NamedTuple):
    """A sensor_msgs/PointCloud2: a structured array of its points, (height, width)."""

    stamp_ns: int
    frame: str
    points: NDArray[Any]


def heads_of_images(stack: Stack) -> list[Columns]:
    """Read how sensor_msgs/Image begin."""
    return [(*stack.header(), stack.numbers("u4")[:, 0].astype(np.int64), stack.numbers("u4")[:, 0].astype(np.int64))]


def heads(stack: Stack) -> list[Columns]:
    """Read the headers that messages begin with."""
    stamps, frames = stack.header()
    return [(stamps, frames, np.zeros_like(stamps), np.zeros_like(stamps))]


def imu_rows(stack: Stack) -> list[Columns]:
    """Read sensor_msgs/Imu."""
    head, quaternion, _ = stack.header(), stack.numbers("f8", 4), stack.numbers("f8", 9)
    rate, rate_covariance = stack.numbers("f8", 3), stack.numbers("f8", 9)
    return [(*head, quaternion, rate, rate_covariance, stack.numbers("f8", 3), stack.numbers("f8", 9))]


def odometry_rows(stack: Stack) -> list[Columns]:
    """Read nav_msgs/Odometry."""
    placed = _placed(stack)
    return [(*placed, stack.numbers("f8", 36), stack.numbers("f8", 3), stack.numbers("f8", 3))]


def joint_rows(stack: Stack) -> list[Columns]:
    """Read sensor_msgs/JointState."""
    head = stack.header()
    names = np.stack([stack.text() for _ in range(stack.number("u4"))], axis=1)
    return [(*head, names, stack.numbers("f8", stack.number("u4")))]


def pose_rows(stack: Stack) -> list[Columns]:
    """Read geometry_msgs/PoseStamped."""
    stamps, frames = stack.header()
    return [(stamps, frames, np.full(len(stamps), ""), stack.numbers("f8", 3), stack.numbers("f8", 4))]


def transform_rows(stack: Stack) -> list[Columns]:
    """Read tf2_msgs/TFMessage."""
    return [_placed(stack) for _ in range(stack.number("u4"))]


def clock_ticks(stack: Stack) -> list[Columns]:
    """Read the stamps of rosgraph_msgs/Clock."""
    return [(stack.stamp(),)]


def _placed(stack: Stack) -> Columns:
    """Read header, child, place and quaternion."""
    return *stack.header(), stack.text(), stack.numbers("f8", 3), stack.numbers("f8", 4)


def scan_row(reader: CdrReader) -> ScanRow:
    """Read a sensor_msgs/LaserScan."""
    head, numbers = reader.header(), reader.numbers("f", 7)
    ranges = np.array(reader.numbers("f", reader.number("I")), np.float64)
    return ScanRow(head.stamp_ns, head.frame_id, numbers[0], numbers[2], numbers[3], ranges)


_KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def cloud_row(reader: CdrReader) -> CloudRow:
    """Read a sensor_msgs/PointCloud2.

    Raises:
        ValueError: its fields do not fit its points, or those do not fit its data.
    """
    head, height, width = reader.header(), reader.number("I"), reader.number("I")
    fields = [(reader.text(), reader.number("I"), reader.number("B"), reader.number("I")) for _ in range(reader.number("I"))]
    order = ">" if reader.number("B") else "<"
    size = reader.numbers("I", 2)[0]
    names, offsets, kinds = [row[0] for row in fields], [row[1] for row in fields], [order + _KINDS.get(row[2], "f4") for row in fields]
    record = np.dtype({"names": names, "formats": kinds, "offsets": offsets, "itemsize": int(size)})
    return CloudRow(head.stamp_ns, head.frame_id, np.frombuffer(reader.octets(), record).reshape(height, width))


def xyz_of(points: NDArray[Any]) -> Floats:
    """Return the places (n, 3) of a cloud's points (n,)."""
    return np.column_stack([points[axis] for axis in "xyz"]).astype(np.float64)


def cut(table: Any, kept: NDArray[np.bool_]) -> Any:
    """Return some rows of a table."""
    return type(table)(*(values[kept] for values in table))
