"""Which topics a recorder's parameters ask for."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable

from scene_synth_ros.record.frame_topics import made_of
from scene_synth_ros.record.recorder_config import RecorderConfig


def is_chosen(topic: str, config: RecorderConfig, namespace: str, is_published: Callable[[str], object]) -> bool:
    """Return whether the parameters ask for a topic.

    What comes next is left out, as it will come on ``scene``, and what the recorder makes itself: of the suite's images the form that
    ``images.*`` asks for, of labels the LabelInfo, of annotations the detections.

    Args:
        topic: fully qualified.
        config: of the recorder.
        namespace: of the suite, ending with a slash.
        is_published: whether anybody publishes a topic.
    """
    if topic in ("/tf", "/tf_static", f"{namespace}status"):
        return False
    if not config.topics and (topic.endswith("/transition_event") or topic == f"{namespace}scene/next"):
        return False
    source = made_of(topic) if topic.startswith(namespace) else ""
    if source and is_published(source) and is_chosen(source, config, namespace, is_published):
        return False
    chosen = (*(config.topics or (f"{namespace}*", "/clock", "/diagnostics")), *config.extra_topics)
    return any(fnmatch.fnmatchcase(topic, pattern) for pattern in chosen) and not any(
        fnmatch.fnmatchcase(topic, pattern) for pattern in config.exclude
    )
