"""QoS profiles, by function and by name.

Publishers are reliable, as REP 2003 asks of sensor drivers: a best-effort subscriber connects to them as well, and large images are not
lost in fragments.  What describes the world rather than a moment is latched (transient local), so that late subscribers get it.
"""

from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy

BURST_DEPTH = 4000
"""What is kept of streams that are faster than frames: all samples between two frames go out at once."""
CLOUD_DEPTH = 40
"""The same of clouds, which are large."""


def stream_qos(depth: int = 10) -> QoSProfile:
    """Images, camera info, poses, clock: reliable, volatile, keep the last ``depth``."""
    return _last(depth, QoSReliabilityPolicy.RELIABLE, QoSDurabilityPolicy.VOLATILE)


def latched_qos(depth: int = 1) -> QoSProfile:
    """Scene, markers, map, labels, node status: reliable, transient local."""
    return _last(depth, QoSReliabilityPolicy.RELIABLE, QoSDurabilityPolicy.TRANSIENT_LOCAL)


def _last(depth: int, reliability: QoSReliabilityPolicy, durability: QoSDurabilityPolicy) -> QoSProfile:
    return QoSProfile(history=QoSHistoryPolicy.KEEP_LAST, depth=depth, reliability=reliability, durability=durability)


PROFILES = {
    "reliable": stream_qos(10),
    "deep": stream_qos(100),
    "latest": stream_qos(1),
    "sensor_data": _last(5, QoSReliabilityPolicy.BEST_EFFORT, QoSDurabilityPolicy.VOLATILE),
}
"""Profiles of streams by name: the default; for slow subscribers of bursts; for those that want only the newest; that of sensor drivers
before REP 2003, where a loss is better than a delay."""
