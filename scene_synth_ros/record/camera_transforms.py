"""Transforms of cameras from their poses, for bags: ``tf2_msgs`` is not installed everywhere."""

from __future__ import annotations

from typing import NamedTuple

from scene_description.poses import LINK_FROM_OPTICAL, conjugate_quaternion, multiply_quaternions
from scene_synth_ros.messages.timed_pose import TimedPose
from scene_synth_ros.messages.transforms_cdr import StampedTransform, encode_tf_message


class TransformMessages(NamedTuple):
    """Serialised ``tf2_msgs/msg/TFMessage``: of ``/tf_static``, None where nothing is new, and of ``/tf``."""

    static: bytes | None
    moving: bytes


class CameraTransforms:
    """Says world -> link at every pose, and link -> optical frame of all cameras so far when a camera is new."""

    def __init__(self) -> None:
        self._links: dict[str, str] = {}

    def of_pose(self, pose: TimedPose, camera: str) -> TransformMessages:
        """Return the transforms of a camera's optical pose."""
        link, static = f"{camera}_link", None
        if camera not in self._links:
            self._links[camera] = link
            static = encode_tf_message(
                [
                    StampedTransform(pose.stamp_ns, known_link, f"{known}_optical_frame", (0.0, 0.0, 0.0), LINK_FROM_OPTICAL)
                    for known, known_link in sorted(self._links.items())
                ]
            )
        rotation = multiply_quaternions(pose.quaternion, conjugate_quaternion(LINK_FROM_OPTICAL))
        return TransformMessages(static, encode_tf_message([StampedTransform(pose.stamp_ns, pose.world, link, pose.position_m, rotation)]))
