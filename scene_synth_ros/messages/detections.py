"""Annotations of a frame as ``vision_msgs`` detections, made of the JSON annotations beside them; vision_msgs is not installed everywhere.

A detection's ``id`` is the object's id in the instance image; it has one result of score 1, whose ``class_id`` is the NYU40 class id in
decimal, a key of the LabelInfo on ``semantic/label_info``, and whose pose is the oriented box's, in the optical frame.  A Detection2D
bounds the visible pixels, in image coordinates (see ``scene_description.annotations``); a Detection3D is the oriented box.
"""

from collections.abc import Callable
from typing import Any

from rclpy.serialization import deserialize_message
from std_msgs.msg import String

from scene_description import SceneSynthError
from scene_description.annotations import FrameAnnotations, ObjectAnnotation, annotations_from_json, annotations_to_json
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.cdr import CdrWriter, read_text
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.messages.streams import DETECTIONS_2D_TYPE, DETECTIONS_3D_TYPE, Role

ANNOTATIONS = streams.ANNOTATIONS.name
"""Stands among the layers that a frame must have for what is told of its objects."""

_SCORE = 1.0
_COVARIANCE = (0.0,) * 36


class AnnotationsReadError(SceneSynthError):
    """Bytes that are no annotations; one line."""


def annotations_to_msg(role: Role, annotations: FrameAnnotations, frame_id: str) -> Any:
    """Return annotations, the JSON or detections, as a message; the class of its type must be installed."""
    if role is streams.ANNOTATIONS:
        return String(data=annotations_to_json(annotations))
    return deserialize_message(encode_detections(role.type_name, annotations, frame_id), message_class(role.type_name))


def read_annotations(data: bytes) -> FrameAnnotations:
    """Return what serialised JSON annotations say.

    Raises:
        AnnotationsReadError: they do not fit their schema.
    """
    try:
        return annotations_from_json(read_text(data))
    except SceneSynthError as error:
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
    box = item.visible_box
    writer.numbers("d", box.x + 0.5 * box.width, box.y + 0.5 * box.height, 0.0, box.width, box.height)


def _write_box_3d(writer: CdrWriter, item: ObjectAnnotation) -> None:
    writer.numbers("d", *item.camera_box.center_m, *item.camera_box.orientation, *item.camera_box.size_m)


_BOX_NUMBERS: dict[str, Callable[[CdrWriter, ObjectAnnotation], None]] = {
    DETECTIONS_2D_TYPE: _write_box_2d,
    DETECTIONS_3D_TYPE: _write_box_3d,
}
