"""The QoS that a replayed topic offers, from what its publishers offered when it was recorded."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSLivelinessPolicy, QoSProfile, QoSReliabilityPolicy

from scene_synth_ros.bags.qos_metadata import INFINITE_NS, OfferedQos

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
