"""Takes the serialised messages of one topic into a recording, with what is derived of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from scene_description.poses import LINK_FROM_OPTICAL, conjugate_quaternion, multiply_quaternions
from scene_synth_ros.messages.camera_frames import CameraFrames, camera_frames
from scene_synth_ros.messages.detections import AnnotationsReadError, is_annotations, read_annotations
from scene_synth_ros.messages.label_info import LabelReadError, is_labels, read_labels
from scene_synth_ros.messages.scan_messages import LASER, has_own_stamps
from scene_synth_ros.messages.stamps import sent_before
from scene_synth_ros.messages.timed_pose import PoseReadError, TimedPose, read_pose
from scene_synth_ros.messages.transforms_cdr import StampedTransform, encode_tf_message
from scene_synth_ros.record.recording import Recording


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


def message_taker(recording: Recording, topic: str, type_name: str, namespace: str, warn: Callable[[str], None]) -> Callable[[bytes], None]:
    """Return what takes a message of a topic: transforms are derived of poses, LabelInfo of labels, detections of annotations.

    Args:
        recording: of which the topic is one.
        topic: fully qualified.
        type_name: ``package/msg/Type``.
        namespace: of the suite, ending with a slash.
        warn: called with one line for a message of which nothing can be derived.
    """
    camera = topic.rsplit("/", 2)[-2] if type_name == "geometry_msgs/msg/PoseStamped" and topic.endswith("/pose") else ""
    own_stamps = has_own_stamps(topic)
    settings = topic.endswith("/settings") and type_name == "std_msgs/msg/String"
    labels = is_labels(topic, type_name)
    annotations = topic.startswith(namespace) and is_annotations(topic, type_name)

    def take(data: bytes) -> None:
        if settings and (sent := sent_before(data)) is not None:
            recording.add_sent(sent.stamp_ns, {namespace + name: stamp for name, stamp in sent.stamps_ns.items()})
        if recording.add(topic, data):
            derive(data)
        if own_stamps:
            recording.reach(topic, data)

    def derive(data: bytes) -> None:
        try:
            if camera == LASER:
                recording.add_laser_pose(read_pose(data))
            elif camera:
                recording.add_pose(read_pose(data), camera)
            if labels:
                recording.add_labels(read_labels(data), topic)
            if annotations:
                recording.add_annotations(read_annotations(data), topic)
        except PoseReadError as error:
            warn(f"{topic}: {error}; it has no transform")
        except LabelReadError as error:
            warn(f"{topic}: {error}; it has no LabelInfo")
        except AnnotationsReadError as error:
            warn(f"{topic}: {error}; it has no detections")

    return take
