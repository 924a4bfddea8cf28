"""What a recorder makes of messages that it records: transforms of poses, LabelInfo of labels, detections of annotations.

Bags have them also where ``tf2_msgs`` and ``vision_msgs`` are not installed, and whether or not anybody publishes them.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from rclpy.qos import QoSProfile

from scene_description.annotations import FrameAnnotations
from scene_description.poses import LINK_FROM_OPTICAL, conjugate_quaternion, multiply_quaternions
from scene_synth_ros.messages.detections import AnnotationsReadError, encode_detections, read_annotations
from scene_synth_ros.messages.label_info import LabelReadError, TimedLabels, encode_label_info, is_labels, read_labels
from scene_synth_ros.messages.poses import (
    PoseReadError,
    StampedTransform,
    encode_tf_message,
    read_odometry_pose,
    read_pose,
    read_rig_frames,
)
from scene_synth_ros.messages.streams import (
    ANNOTATIONS,
    LASER,
    ODOM_IDEAL,
    POSE,
    SETTINGS,
    TF,
    TF_STATIC,
    CameraFrames,
    Stream,
    camera_frames,
    derived_streams,
    laser_frame,
    parse,
)
from scene_synth_ros.suite.qos import latched_qos, stream_qos


class DerivedTopic(NamedTuple):
    """A topic that nobody needs to publish."""

    name: str
    type_name: str
    qos: QoSProfile


class DerivedMessage(NamedTuple):
    """A message for a bag, and the topics that are opened with it; ``aside``: it belongs to no frame, though its topic may."""

    topic: str
    stamp_ns: int
    data: bytes
    opens: tuple[DerivedTopic, ...]
    aside: bool = False


Derive = Callable[[bytes], Iterator[DerivedMessage]]
"""Returns what is derived of a serialised message; raises one of :data:`NOT_DERIVED` where that cannot be read."""
NOT_DERIVED: dict[type[Exception], str] = {PoseReadError: "transform", LabelReadError: "LabelInfo", AnnotationsReadError: "detections"}
"""What a message lacks that could not be read."""
_TF = DerivedTopic(Stream("/", TF).topic, TF.type_name, stream_qos(100))
_TF_STATIC = DerivedTopic(Stream("/", TF_STATIC).topic, TF_STATIC.type_name, latched_qos())


class Deriver:
    """Derives messages of those of one recording; it remembers the cameras that there are.

    Attributes:
        has_body: whether the suite's body is recorded, from which the cameras' frames hang.
    """

    def __init__(self, frame_prefix: str = "") -> None:
        self._prefix = frame_prefix
        self._cameras: dict[str, CameraFrames] = {}
        self._frames: dict[str, StampedTransform] = {}
        self.has_body = False

    def of_topic(self, topic: str, type_name: str, namespace: str) -> Derive | None:
        """Return what derives messages of a topic's, None where there is nothing; ``namespace`` of the suite ends with a slash."""
        stream = parse(topic, type_name)
        if stream is None:
            return None
        if stream.role is ODOM_IDEAL:
            self.has_body = self.has_body or topic.startswith(namespace)
            return lambda data: self._of_moving(read_odometry_pose(data))
        if stream.role is SETTINGS:
            return lambda data: self._of_settings(read_rig_frames(data))
        if stream.role is POSE:
            if stream.camera == LASER:
                return lambda data: self._of_moving(read_pose(data)._replace(child=laser_frame(self._prefix)))
            return (lambda data: self._of_camera_pose(read_pose(data), stream.camera)) if stream.camera else None
        if is_labels(topic, type_name):
            return lambda data: self._of_labels(read_labels(data), topic)
        if stream.role is ANNOTATIONS and topic.startswith(namespace):
            return lambda data: self._of_annotations(read_annotations(data), topic)
        return None

    def _of_camera_pose(self, pose: StampedTransform, camera: str) -> Iterator[DerivedMessage]:
        """Yield world -> link at every pose and, when a camera is new, link -> optical frame of all cameras so far.

        On a body, whose pose and fixed frames say the same, nothing.
        """
        if self.has_body:
            return
        link = camera_frames(camera, self._prefix).link
        rotation = multiply_quaternions(pose.quaternion, conjugate_quaternion(LINK_FROM_OPTICAL))
        moving = encode_tf_message([pose._replace(child=link, quaternion=rotation)])
        if camera not in self._cameras:
            self._cameras[camera] = camera_frames(camera, self._prefix)
            static = [
                StampedTransform(pose.stamp_ns, known.link, known.optical, (0.0, 0.0, 0.0), LINK_FROM_OPTICAL)
                for _, known in sorted(self._cameras.items())
            ]
            yield DerivedMessage(_TF_STATIC.name, pose.stamp_ns, encode_tf_message(static), (_TF, _TF_STATIC))
        yield DerivedMessage(_TF.name, pose.stamp_ns, moving, (_TF, _TF_STATIC))

    def _of_moving(self, pose: StampedTransform) -> Iterator[DerivedMessage]:
        """Yield where a named frame is: odom -> base, world -> scanner."""
        yield DerivedMessage(_TF.name, pose.stamp_ns, encode_tf_message([pose]), (_TF, _TF_STATIC), aside=True)

    def _of_settings(self, frames: Sequence[StampedTransform]) -> Iterator[DerivedMessage]:
        """Yield all fixed frames so far when one of them is new or has another place."""
        new = {frame.child: frame._replace(stamp_ns=0) for frame in frames if self.has_body}
        if any(self._frames.get(child) != frame for child, frame in new.items()):
            self._frames.update(new)
            stamp_ns = frames[0].stamp_ns
            data = encode_tf_message([frame._replace(stamp_ns=stamp_ns) for _, frame in sorted(self._frames.items())])
            yield DerivedMessage(_TF_STATIC.name, stamp_ns, data, (_TF, _TF_STATIC))

    def _of_labels(self, labels: TimedLabels, topic: str) -> Iterator[DerivedMessage]:
        """Yield the LabelInfo beside the labels of a topic."""
        for stream in derived_streams(topic):
            data = encode_label_info(labels.stamp_ns, stream.frame_id(self._prefix), labels.names)
            yield _derived(stream, labels.stamp_ns, data, latched_qos())

    def _of_annotations(self, annotations: FrameAnnotations, topic: str) -> Iterator[DerivedMessage]:
        """Yield the detections beside the annotations of a topic."""
        for stream in derived_streams(topic):
            data = encode_detections(stream.role.type_name, annotations, stream.frame_id(self._prefix))
            yield _derived(stream, annotations.stamp_ns, data, stream_qos())


def _derived(stream: Stream, stamp_ns: int, data: bytes, qos: QoSProfile) -> DerivedMessage:
    """Return a message that alone opens the topic of its stream."""
    return DerivedMessage(stream.topic, stamp_ns, data, (DerivedTopic(stream.topic, stream.role.type_name, qos),))
