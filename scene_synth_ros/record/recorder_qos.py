"""The QoS that a recorder asks for, from what the publishers of a topic offer."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy


def complete_qos(offered: QoSProfile) -> QoSProfile:
    """Fill in history and depth, which discovery does not tell, as latched and stream publishers of this package have them."""
    depth = 1 if offered.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL else 10
    return QoSProfile(history=QoSHistoryPolicy.KEEP_LAST, depth=depth, reliability=offered.reliability, durability=offered.durability)


def matching_qos(offered: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """Return the strongest QoS that every publisher meets, as ``ros2 bag record`` chooses it."""
    reliable = all(qos.reliability == QoSReliabilityPolicy.RELIABLE for qos in offered)
    latched = all(qos.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL for qos in offered)
    return QoSProfile(
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=QoSReliabilityPolicy.RELIABLE if reliable else QoSReliabilityPolicy.BEST_EFFORT,
        durability=QoSDurabilityPolicy.TRANSIENT_LOCAL if latched else QoSDurabilityPolicy.VOLATILE,
    )
