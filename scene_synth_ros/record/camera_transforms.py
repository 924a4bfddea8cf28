"""Transforms of cameras from their poses, for bags: ``tf2_msgs`` is not installed everywhere."""

from __future__ import annotations

from typing import NamedTuple

from scene_description.poses import LINK_FROM_OPTICAL, conjugate_quaternion, multiply_quaternions
from scene_synth_ros.messages.poses import StampedTransform, TimedPose, encode_tf_message
from scene_synth_ros.messages.streams import CameraFrames, camera_frames


class TransformMessages(NamedTuple):
    """Serialised ``tf2_msgs/msg/TFMessage``: of ``/tf_static``, None where nothing is new, and of ``/tf``."""

    static: bytes | None
    moving: bytes


class CameraTransforms:
    """Says world -> link at every pose, and link -> optical frame of all cameras so far when a camera is new.

    Args:
        frame_prefix: stands before the names of links and optical frames.
    """

    def __init__(self, frame_prefix: str = "") -> None:
        self._prefix = frame_prefix
        self._known: dict[str, CameraFrames] = {}

    def of_pose(self, pose: TimedPose, camera: str) -> TransformMessages:
        """Return the transforms of a camera's optical pose."""
        link, static = camera_frames(camera, self._prefix).link, None
        if camera not in self._known:
            self._known[camera] = camera_frames(camera, self._prefix)
            static = encode_tf_message(
                [
                    StampedTransform(pose.stamp_ns, known.link, known.optical, (0.0, 0.0, 0.0), LINK_FROM_OPTICAL)
                    for _, known in sorted(self._known.items())
                ]
            )
        rotation = multiply_quaternions(pose.quaternion, conjugate_quaternion(LINK_FROM_OPTICAL))
        return TransformMessages(static, encode_tf_message([StampedTransform(pose.stamp_ns, pose.world, link, pose.position_m, rotation)]))
