"""Takes the serialised messages of one topic into a recording, with what is derived of them."""

from __future__ import annotations

from collections.abc import Callable

from scene_synth_ros.messages.detections import AnnotationsReadError, read_annotations
from scene_synth_ros.messages.label_info import LabelReadError, is_labels, read_labels
from scene_synth_ros.messages.poses import PoseReadError, read_pose
from scene_synth_ros.messages.stamps import sent_before
from scene_synth_ros.messages.streams import ANNOTATIONS, LASER, POSE, SETTINGS, parse
from scene_synth_ros.record.recording import Recording


def message_taker(recording: Recording, topic: str, type_name: str, namespace: str, warn: Callable[[str], None]) -> Callable[[bytes], None]:
    """Return what takes a message of a topic: transforms are derived of poses, LabelInfo of labels, detections of annotations.

    Args:
        recording: of which the topic is one.
        topic: fully qualified.
        type_name: ``package/msg/Type``.
        namespace: of the suite, ending with a slash.
        warn: called with one line for a message of which nothing can be derived.
    """
    stream = parse(topic, type_name)
    role = stream.role if stream is not None else None
    camera = stream.camera if stream is not None and role is POSE else ""
    own_stamps = stream is not None and stream.has_own_stamps
    settings = role is SETTINGS
    labels = is_labels(topic, type_name)
    annotations = topic.startswith(namespace) and role is ANNOTATIONS

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
