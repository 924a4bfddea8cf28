"""Which topics every frame has: what recorders wait for before they write one."""

from __future__ import annotations

from collections.abc import Iterable

from scene_synth_ros.messages.detections import ANNOTATIONS, detection_topics
from scene_synth_ros.messages.label_info import label_info_topic
from scene_synth_ros.messages.scan_messages import has_own_stamps


def frame_topics(published: Iterable[str]) -> frozenset[str]:
    """Return those of a renderer's topics that have a message with every frame."""
    return frozenset(topic for topic in published if not topic.startswith("/tf") and not has_own_stamps(topic))


def with_derived(recorded: Iterable[str]) -> set[str]:
    """Return the recorded topics of frames with those that the recording derives of them."""
    topics = set(recorded)
    derived = {label_info_topic(topic) for topic in topics if topic.endswith("/labels")}
    derived |= {name for topic in topics if topic.endswith(f"/{ANNOTATIONS}") for name in detection_topics(topic)}
    if any(topic.endswith("/pose") for topic in topics):
        derived.add("/tf")
    return topics | derived
