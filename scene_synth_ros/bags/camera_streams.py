"""The streams of each camera of a bag, whose stamps must agree.  Functions take topics as name -> type."""

from __future__ import annotations

from collections.abc import Mapping

from renderer import LAYERS
from scene_synth_ros.messages.streams import (
    CLOUD_TYPE,
    COMPRESSED_TYPE,
    IMAGE_FORMS,
    IMAGE_TYPE,
    INFO_TYPE,
    LABELS,
    POSE_TYPE,
    find_streams,
    parse,
)

FRAME_TYPES = (IMAGE_TYPE, COMPRESSED_TYPE, INFO_TYPE, CLOUD_TYPE, POSE_TYPE)
_IMAGE_TYPES = FRAME_TYPES[:3]


def cameras(topics: Mapping[str, str]) -> dict[str, list[str]]:
    """Return camera -> topics whose stamps must agree; cameras without an image are left out."""
    found: dict[str, list[str]] = {}
    for topic, type_name in topics.items():
        if type_name in _IMAGE_TYPES:
            stream = parse(topic, type_name)
            found.setdefault(stream.base if stream is not None else topic.rsplit("/", 2)[0], []).append(topic)
    for topic, type_name in topics.items():
        stream = parse(topic, type_name)
        if stream is not None and stream.role.of == "camera" and stream.base in found:
            found[stream.base].append(topic)
    return found


def label_topics(topics: Mapping[str, str]) -> list[str]:
    """Return the topics that tell what the ids in the images of these topics mean."""
    labelled = {name for name, row in LAYERS.items() if row.labels is not None}
    return [stream.beside(LABELS).topic for stream in find_streams(topics, *IMAGE_FORMS).values() if stream.layer in labelled]
