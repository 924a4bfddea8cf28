"""Which topics of a bag hold what of a frame, told from their names and types; nothing is decoded, and no table of layers is needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from scene_synth_ros.messages.image_reader import COMPRESSED_TYPE, IMAGE_TYPE

INFO_TYPE, POSE_TYPE, STRING = "sensor_msgs/msg/CameraInfo", "geometry_msgs/msg/PoseStamped", "std_msgs/msg/String"
_FORMS = (("/image_raw", IMAGE_TYPE), ("/image_raw/compressed", COMPRESSED_TYPE), ("/image_raw/compressedDepth", COMPRESSED_TYPE))
"""End of the topic of a layer -> its type, in the order in which they are taken."""


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
    found: dict[str, CameraTopics] = {}
    for end, kind in _FORMS:
        for topic in sorted(types):
            camera, _, layer = topic.removesuffix(end).rpartition("/")
            if types[topic] == kind and topic.endswith(end) and camera:
                found.setdefault(camera, CameraTopics()).images.setdefault(layer, topic)
    settings = tuple(sorted(topic for topic, kind in types.items() if kind == STRING and topic.endswith("/settings")))
    for camera, topics in found.items():
        for layer in topics.images:
            topics.infos |= _named(types, f"{camera}/{layer}/camera_info", INFO_TYPE, layer)
            topics.labels |= _named(types, f"{camera}/{layer}/labels", STRING, layer)
        topics.pose = _named(types, f"{camera}/pose", POSE_TYPE, "").get("", "")
        topics.settings = settings
        topics.annotations = _named(types, f"{camera}/annotations", STRING, "").get("", "")
    return dict(sorted(found.items()))


def find_scenes(types: Mapping[str, str]) -> list[str]:
    """Return the topics of scene descriptions."""
    return sorted(topic for topic, kind in types.items() if kind == STRING and topic.rsplit("/", 1)[-1] == "scene")


def _named(types: Mapping[str, str], topic: str, kind: str, key: str) -> dict[str, str]:
    return {key: topic} if types.get(topic) == kind else {}
