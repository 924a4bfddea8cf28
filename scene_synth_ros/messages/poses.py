"""Serialised poses: what a camera's topic says, read, and transforms, written; ``tf2_msgs`` is not installed everywhere."""

from collections.abc import Sequence
from typing import NamedTuple

from scene_description import CameraPose, SceneSynthError
from scene_synth_ros.messages.cdr import CdrReader, CdrReadError, CdrWriter, json_object

Position = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class PoseReadError(SceneSynthError):
    """Bytes that are no pose; one line."""


class StampedTransform(NamedTuple):
    """The pose of frame ``child``, unnamed where a camera's topic says it, in frame ``parent``: metres, unit quaternion (x, y, z, w)."""

    stamp_ns: int
    parent: str
    child: str
    position_m: Position
    quaternion: Quaternion

    @property
    def camera_pose(self) -> CameraPose:
        """The pose as scenes have it, without the names of frames."""
        return CameraPose(stamp_ns=self.stamp_ns, position_m=self.position_m, orientation=self.quaternion)


def read_pose(data: bytes | memoryview) -> StampedTransform:
    """Return what a serialised geometry_msgs/PoseStamped says, as a transform.

    Raises:
        PoseReadError: the bytes are no such message.
    """
    return _read(data, child=False)


def read_odometry_pose(data: bytes | memoryview) -> StampedTransform:
    """Return the pose that a serialised nav_msgs/Odometry says, as a transform.

    Raises:
        PoseReadError: the bytes are no such message.
    """
    return _read(data, child=True)


def _read(data: bytes | memoryview, *, child: bool) -> StampedTransform:
    """Read a header, the name of a ``child`` where there is one, and a pose."""
    try:
        reader = CdrReader(data)
        header, name = reader.header(), reader.text() if child else ""
        numbers = reader.numbers("d", 7)
    except CdrReadError as error:
        raise PoseReadError(f"a pose cannot be read ({len(data)} bytes): {error}") from None
    return StampedTransform(header.stamp_ns, header.frame_id, name, _three(numbers[:3]), _four(numbers[3:]))


def read_rig_frames(data: bytes | memoryview) -> tuple[StampedTransform, ...]:
    """Return the frames that the settings of a frame, a serialised std_msgs/String of JSON, say are fixed to each other.

    Raises:
        PoseReadError: what it says of them is not what settings say.
    """
    if b'"frames"' not in bytes(data):
        return ()
    settings = json_object(data)
    try:
        return tuple(
            StampedTransform(int(settings["stamp_ns"]), frame["parent"], frame["child"], _three(frame["place_m"]), _four(frame["turn"]))
            for frame in settings.get("frames", ())
        )
    except (ValueError, TypeError, KeyError) as error:
        raise PoseReadError(f"fixed frames cannot be read ({len(data)} bytes): {error}") from None


def _three(values: Sequence[float]) -> Position:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _four(values: Sequence[float]) -> Quaternion:
    x, y, z, w = (float(value) for value in values)
    return x, y, z, w


def encode_tf_message(transforms: Sequence[StampedTransform]) -> bytes:
    """Return a ``tf2_msgs/msg/TFMessage`` as little-endian plain CDR with its encapsulation header.

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
        writer.numbers("d", *transform.position_m, *transform.quaternion)
    return writer.message()
