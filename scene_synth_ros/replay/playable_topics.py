"""Which topics of a bag are published again, and with which message classes."""

import difflib
from collections.abc import Sequence
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSLivelinessPolicy, QoSProfile, QoSReliabilityPolicy

from scene_description import SceneSynthError
from scene_synth_ros.bags.bag_metadata import TopicInfo
from scene_synth_ros.bags.bag_reader import BagReadError, BagSummary
from scene_synth_ros.bags.qos_metadata import INFINITE_NS, OfferedQos
from scene_synth_ros.messages.message_definitions import MessageDefinitionError, message_class, message_definition
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.replay.replay_config import ReplayConfig
from scene_synth_ros.suite.parameters import ParameterError

DEFAULT_DEPTH = 10
MAX_DEPTH = 10_000


def replay_qos(recorded: Sequence[OfferedQos]) -> QoSProfile:
    """Return a profile that every subscriber of the recorded publishers would have matched.

    Publishers that differed are replayed with the weaker policy of each kind; unknown policies and none recorded give the default of
    ROS 2, reliable and volatile, the last ten.  Liveliness is asserted by the program, which every subscriber accepts: see
    :class:`~scene_synth_ros.replay.playback.Playback`.
    """
    if not recorded:
        return QoSProfile(depth=DEFAULT_DEPTH)
    reliable = all(qos.reliability != "best_effort" for qos in recorded)
    latched = all(qos.durability == "transient_local" for qos in recorded)
    keep_all = any(qos.history == "keep_all" for qos in recorded)
    depth = max((qos.depth for qos in recorded if qos.history == "keep_last"), default=0) or DEFAULT_DEPTH
    return QoSProfile(
        history=QoSHistoryPolicy.KEEP_ALL if keep_all else QoSHistoryPolicy.KEEP_LAST,
        depth=min(depth, MAX_DEPTH),
        reliability=QoSReliabilityPolicy.RELIABLE if reliable else QoSReliabilityPolicy.BEST_EFFORT,
        durability=QoSDurabilityPolicy.TRANSIENT_LOCAL if latched else QoSDurabilityPolicy.VOLATILE,
        liveliness=QoSLivelinessPolicy.MANUAL_BY_TOPIC,
        deadline=_duration(max(qos.deadline_ns for qos in recorded)),
        lifespan=_duration(min(qos.lifespan_ns for qos in recorded)),
        avoid_ros_namespace_conventions=all(qos.avoid_ros_namespace_conventions for qos in recorded),
    )


def _duration(duration_ns: int) -> Duration:
    """Return the duration; 0, which means unspecified, for an infinite one."""
    return Duration(nanoseconds=0 if duration_ns >= INFINITE_NS else duration_ns)


CLOCK_TOPIC = "/clock"


class UnplayableError(SceneSynthError):
    """A topic that cannot be published here; one line."""


def chosen_topics(summary: BagSummary, config: ReplayConfig) -> list[TopicInfo]:
    """Return the topics of a bag that the parameters ask for.

    Raises:
        BagReadError: the bag holds no messages.
        ParameterError: a topic is not in the bag, or the start lies beyond its end.
    """
    if summary.start_ns is None or summary.end_ns is None:
        raise BagReadError(f"{config.bag}: the bag holds no messages" + (f"; {summary.faults[0]}" if summary.faults else ""))
    duration_s = (summary.end_ns - summary.start_ns) / NANOSECONDS
    if config.start_offset_s > duration_s:
        got = f"expected at most the bag's {duration_s} s, got {config.start_offset_s}"
        raise ParameterError(f"replay_node: parameter start_offset_s: {got}")
    known = {topic.name: topic for topic in summary.topics}
    for name in config.topics:
        if name not in known:
            close = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean '{close[0]}'?" if close else f"it has {', '.join(sorted(known))}"
            raise ParameterError(f"replay_node: parameter topics: '{name}' is not in the bag; {hint}")
    chosen = [topic for topic in summary.topics if not config.topics or topic.name in config.topics]
    return [topic for topic in chosen if not (config.clock_hz and topic.name == CLOCK_TOPIC)]


def import_type(topic: TopicInfo) -> Any:
    """Return the message class of a recorded topic.

    Raises:
        UnplayableError: the class is not installed or not the one that was recorded, or the messages are not CDR.
    """
    if topic.serialization_format != "cdr":
        raise UnplayableError(f"expected messages in cdr, got {topic.serialization_format[:40]!r}")
    try:
        definition = message_definition(topic.type_name)
    except MessageDefinitionError as error:
        raise UnplayableError(str(error)) from None
    if topic.type_hash and definition.type_hash and topic.type_hash != definition.type_hash:
        raise UnplayableError(f"type {topic.type_name} was recorded with another definition than the installed one")
    try:
        return message_class(topic.type_name)
    except (ImportError, AttributeError):
        debian_name = f"ros-jazzy-{topic.type_name.partition('/')[0].replace('_', '-')}"
        raise UnplayableError(f"type {topic.type_name} is not installed; install the package {debian_name}") from None
