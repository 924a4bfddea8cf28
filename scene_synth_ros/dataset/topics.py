"""Which topics of a bag hold what of a frame; nothing is decoded, and no table of layers is needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from scene_synth_ros.messages.streams import ANNOTATIONS, INFO, LABELS, POSE, SETTINGS, Role, Stream, find_images, find_streams


@dataclass(slots=True, kw_only=True)
class CameraTopics:
    """The topics of one camera: layer -> image, layer -> camera info, layer -> labels; "" where there is none; all settings."""

    images: dict[str, str] = field(default_factory=dict)
    infos: dict[str, str] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)
    pose: str = ""
    annotations: str = ""
    settings: tuple[str, ...] = ()


def find_cameras(types: Mapping[str, str]) -> dict[str, CameraTopics]:
    """Return the cameras of a bag by their names with namespace (``/synth/camera``), in the order of these.

    Args:
        types: topic -> type.
    """
    cameras: dict[str, CameraTopics] = {}
    for image, topic in find_images(types).items():
        if image.camera:
            cameras.setdefault(image.base, CameraTopics()).images[image.layer] = topic
    there = set(find_streams(types, INFO, LABELS, POSE, ANNOTATIONS).values())
    settings = tuple(sorted(find_streams(types, SETTINGS)))

    def of_layers(camera: str, role: Role) -> dict[str, str]:
        streams = [Stream(camera, role, layer) for layer in cameras[camera].images]
        return {stream.layer: stream.topic for stream in streams if stream in there}

    for camera, topics in cameras.items():
        topics.infos, topics.labels, topics.settings = of_layers(camera, INFO), of_layers(camera, LABELS), settings
        pose, annotations = Stream(camera, POSE), Stream(camera, ANNOTATIONS)
        topics.pose = pose.topic if pose in there else ""
        topics.annotations = annotations.topic if annotations in there else ""
    return dict(sorted(cameras.items()))
