"""Which topics every frame has, what recorders wait for before they write one, and which topics they make themselves."""

from collections.abc import Iterable

from scene_synth_ros.messages.label_info import is_labels
from scene_synth_ros.messages.streams import (
    CLOCK,
    LABELS,
    ODOM_IDEAL,
    POSE,
    Stream,
    derived_streams,
    has_own_stamps,
    parse,
    source_topic,
    untransported,
)

CLOCK_TOPIC = Stream("/", CLOCK).topic


def frame_topics(published: Iterable[str]) -> frozenset[str]:
    """Return those of a renderer's topics that have a message with every frame, and none between; of a body's, the clock has."""
    topics = set(published)
    ticks_between = any((stream := parse(topic)) is not None and stream.role is ODOM_IDEAL for topic in topics)
    apart = {topic for topic in topics if topic.startswith("/tf") or has_own_stamps(topic)} | ({CLOCK_TOPIC} if ticks_between else set())
    return frozenset(topics - apart)


def with_derived(recorded: Iterable[str]) -> set[str]:
    """Return the recorded topics of frames with those that the recording derives of them."""
    topics = set(recorded)
    derived = {stream.topic for topic in topics for stream in derived_streams(topic)}
    if any(stream.role is POSE for topic in topics if (stream := parse(topic)) is not None):
        derived.add("/tf")
    return topics | derived


def made_of(topic: str) -> str:
    """Return the topic of whose messages a recorder makes those of a topic: an image, labels or annotations; empty for none."""
    source = source_topic(topic)
    stream = parse(source)
    if stream is not None and stream.role is LABELS and not is_labels(source, stream.role.type_name):
        return ""
    return source or untransported(topic)
