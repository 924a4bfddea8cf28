"""The pose of a camera as its topic says it."""

from __future__ import annotations

from typing import NamedTuple

from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message

from scene_description import SceneSynthError
from scene_synth_ros.messages.stamps import NANOSECONDS


class PoseReadError(SceneSynthError):
    """Bytes that are no pose; one line."""


class TimedPose(NamedTuple):
    """The optical pose of a camera in a frame of the world, as its topic said it."""

    stamp_ns: int
    world: str
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def read_pose(data: bytes) -> TimedPose:
    """Return what a serialised geometry_msgs/PoseStamped says.

    Raises:
        PoseReadError: the bytes are no such message.
    """
    try:
        message = deserialize_message(data, PoseStamped)
    except (RuntimeError, UnicodeDecodeError) as error:  # of Fast CDR, and of a frame id that is no text
        raise PoseReadError(f"a pose cannot be read ({len(data)} bytes): {' '.join(str(error).split())[:200]}") from None
    stamp, position, q = message.header.stamp, message.pose.position, message.pose.orientation
    return TimedPose(
        stamp.sec * NANOSECONDS + stamp.nanosec, message.header.frame_id, (position.x, position.y, position.z), (q.x, q.y, q.z, q.w)
    )
