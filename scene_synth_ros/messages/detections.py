"""Annotations of a frame as ``vision_msgs`` detections, made of the JSON annotations beside them; vision_msgs is not installed everywhere.

A detection's ``id`` is the object's id in the instance image; it has one result of score 1, whose ``class_id`` is the NYU40 class id in
decimal, a key of the LabelInfo on ``semantic/label_info``, and whose pose is the oriented box's, in the optical frame.  A Detection2D
bounds the visible pixels, in image coordinates (see ``scene_description.annotations``); a Detection3D is the oriented box.
"""

from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Vector3
from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from scene_description import SceneSynthError
from scene_description.annotations import FrameAnnotations, ObjectAnnotation, OrientedBox, annotations_from_json, annotations_to_json
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.cdr_writer import CdrWriter
from scene_synth_ros.messages.conversions import header
from scene_synth_ros.messages.streams import DETECTIONS_2D_TYPE, DETECTIONS_3D_TYPE, Role

try:
    from vision_msgs.msg import (
        BoundingBox2D,
        BoundingBox3D,
        Detection2D,
        Detection2DArray,
        Detection3D,
        Detection3DArray,
        ObjectHypothesis,
        ObjectHypothesisWithPose,
        Point2D,
        Pose2D,
    )
except ImportError:  # not among the PyPI wheels; live there are the JSON annotations only
    Detection2DArray = Detection3DArray = None

ANNOTATIONS = streams.ANNOTATIONS.name
"""Stands among the layers that a frame must have for what is told of its objects."""

_SCORE = 1.0
_COVARIANCE = (0.0,) * 36


class AnnotationsReadError(SceneSynthError):
    """Bytes that are no annotations; one line."""


def annotations_to_msg(annotations: FrameAnnotations, frame_id: str) -> String:
    """Return the JSON as a message; the frame is that of its camera, and not in it."""
    del frame_id
    return String(data=annotations_to_json(annotations))


def detections_2d_to_msg(annotations: FrameAnnotations, frame_id: str) -> Detection2DArray:
    """Return the visible boxes as a message; vision_msgs must be there."""
    head = header(annotations.stamp_ns, frame_id)
    return Detection2DArray(
        header=head,
        detections=[
            Detection2D(header=head, results=[_result(item)], bbox=_box_2d(*_visible_box(item)), id=str(item.id))
            for item in annotations.objects
        ],
    )


def detections_3d_to_msg(annotations: FrameAnnotations, frame_id: str) -> Detection3DArray:
    """Return the oriented boxes in the optical frame as a message; vision_msgs must be there."""
    head = header(annotations.stamp_ns, frame_id)
    return Detection3DArray(
        header=head,
        detections=[
            Detection3D(header=head, results=[_result(item)], bbox=_box_3d(item.camera_box), id=str(item.id))
            for item in annotations.objects
        ],
    )


ANNOTATION_MESSAGES: dict[Role, Callable[[FrameAnnotations, str], object]] = {streams.ANNOTATIONS: annotations_to_msg}
"""Role -> what makes its message of a frame's annotations, given the optical frame; those that can be made here."""
if Detection2DArray is not None:
    ANNOTATION_MESSAGES |= {streams.DETECTIONS_2D: detections_2d_to_msg, streams.DETECTIONS_3D: detections_3d_to_msg}


def _visible_box(item: ObjectAnnotation) -> tuple[float, float, float, float]:
    """Return centre and size."""
    box = item.visible_box
    return box.x + 0.5 * box.width, box.y + 0.5 * box.height, box.width, box.height


def _box_2d(x: float, y: float, width: float, height: float) -> BoundingBox2D:
    return BoundingBox2D(center=Pose2D(position=Point2D(x=x, y=y)), size_x=width, size_y=height)


def _box_3d(box: OrientedBox) -> BoundingBox3D:
    depth, width, height = box.size_m
    return BoundingBox3D(center=_pose(box), size=Vector3(x=depth, y=width, z=height))


def _result(item: ObjectAnnotation) -> ObjectHypothesisWithPose:
    hypothesis = ObjectHypothesis(class_id=str(item.label), score=_SCORE)
    return ObjectHypothesisWithPose(hypothesis=hypothesis, pose=PoseWithCovariance(pose=_pose(item.camera_box)))


def _pose(box: OrientedBox) -> Pose:
    (x, y, z), (a, b, c, w) = box.center_m, box.orientation
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=a, y=b, z=c, w=w))


def read_annotations(data: bytes) -> FrameAnnotations:
    """Return what serialised JSON annotations say.

    Raises:
        AnnotationsReadError: they do not fit their schema.
    """
    try:
        return annotations_from_json(deserialize_message(data, String).data)
    except (RuntimeError, UnicodeDecodeError, SceneSynthError) as error:
        raise AnnotationsReadError(f"annotations cannot be read ({len(data)} bytes): {' '.join(str(error).split())[:200]}") from None


def encode_detections(type_name: str, annotations: FrameAnnotations, frame_id: str) -> bytes:
    """Return a message of detections as little-endian plain CDR with its encapsulation header.

    Raises:
        ValueError: the stamp does not fit ``builtin_interfaces/Time``.
    """
    writer = CdrWriter()
    writer.header(annotations.stamp_ns, frame_id)
    writer.numbers("I", len(annotations.objects))
    for item in annotations.objects:
        writer.header(annotations.stamp_ns, frame_id)
        writer.numbers("I", 1)
        writer.text(str(item.label))
        writer.numbers("d", _SCORE, *item.camera_box.center_m, *item.camera_box.orientation, *_COVARIANCE)
        _BOX_NUMBERS[type_name](writer, item)
        writer.text(str(item.id))
    return writer.message()


def _write_box_2d(writer: CdrWriter, item: ObjectAnnotation) -> None:
    x, y, width, height = _visible_box(item)
    writer.numbers("d", x, y, 0.0, width, height)


def _write_box_3d(writer: CdrWriter, item: ObjectAnnotation) -> None:
    writer.numbers("d", *item.camera_box.center_m, *item.camera_box.orientation, *item.camera_box.size_m)


_BOX_NUMBERS: dict[str, Callable[[CdrWriter, ObjectAnnotation], None]] = {
    DETECTIONS_2D_TYPE: _write_box_2d,
    DETECTIONS_3D_TYPE: _write_box_3d,
}
