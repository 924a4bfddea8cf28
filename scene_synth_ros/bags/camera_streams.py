"""Which topics of a bag belong to which camera, told from names and types.

A camera is what stands before ``/<layer>/image_raw``, ``/pose`` or ``/annotations`` in topic names.  Functions take topics as name -> type.
"""

from __future__ import annotations

from collections.abc import Mapping

from renderer import LAYERS
from scene_synth_ros.messages.cloud_messages import CLOUDS
from scene_synth_ros.messages.detections import ANNOTATIONS, DETECTION_TYPES

POSE_TYPE, CLOUD_TYPE = "geometry_msgs/msg/PoseStamped", "sensor_msgs/msg/PointCloud2"
IMAGE_TYPE, COMPRESSED_TYPE = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
FRAME_TYPES = (IMAGE_TYPE, COMPRESSED_TYPE, "sensor_msgs/msg/CameraInfo", CLOUD_TYPE, POSE_TYPE)
_BESIDE = {"pose": POSE_TYPE, **dict.fromkeys(CLOUDS, CLOUD_TYPE), ANNOTATIONS: "std_msgs/msg/String", **DETECTION_TYPES}
"""Name below ``<camera>/`` of what a camera has once, and not for every layer -> its type."""
_TRANSPORTS = ("/compressed", "/compressedDepth")
_LABELLED_LAYERS = {name for name, row in LAYERS.items() if row.labels is not None}


def is_scene(name: str, type_name: str) -> bool:
    """Return whether a topic carries scene descriptions."""
    return name.rsplit("/", 1)[-1] == "scene" and type_name == "std_msgs/msg/String"


def cameras(topics: Mapping[str, str]) -> dict[str, list[str]]:
    """Return camera -> topics whose stamps must agree; cameras without an image are left out."""
    found: dict[str, list[str]] = {}
    for name, type_name in topics.items():
        if type_name in FRAME_TYPES and type_name not in _BESIDE.values():
            found.setdefault(published_name(name, type_name).rsplit("/", 2)[0], []).append(name)
    for name, type_name in topics.items():
        camera, _, last = name.rpartition("/")
        if camera in found and _BESIDE.get(last) == type_name:
            found[camera].append(name)
    return found


def label_topics(topics: Mapping[str, str]) -> list[str]:
    """Return the topics that tell what the ids in the images of these topics mean."""
    layers = [published_name(name, kind).rsplit("/", 1)[0] for name, kind in topics.items() if _layer_of(name, kind) in _LABELLED_LAYERS]
    return [f"{layer}/labels" for layer in layers]


def published_name(name: str, type_name: str) -> str:
    """Return the topic of an image without what its compressed form appends."""
    for ending in _TRANSPORTS if type_name == COMPRESSED_TYPE else ():
        name = name.removesuffix(ending)
    return name


def _layer_of(name: str, type_name: str) -> str:
    parts = published_name(name, type_name).rsplit("/", 2)
    return parts[1] if type_name in (IMAGE_TYPE, COMPRESSED_TYPE) and parts[-1] == "image_raw" and len(parts) == 3 else ""
