"""Laser scans as messages, and the names of their topics.  No node here."""

from collections.abc import Iterator

import numpy as np
from geometry_msgs.msg import PoseStamped, TransformStamped
from numpy.typing import NDArray
from sensor_msgs.msg import LaserScan

from renderer.lidar.config import ScanConfig
from renderer.lidar.scan import Scan
from scene_description.types import CameraPose
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.conversions import header, pose_to_msg, transform_to_msg
from scene_synth_ros.messages.streams import Stream

SCAN_STREAMS = (Stream("", streams.SCAN), Stream("", streams.SCAN_IDEAL), Stream(streams.LASER, streams.POSE))
"""Below the namespace; their messages have stamps of their own, between those of frames."""
SCAN, SCAN_IDEAL, LASER_POSE = (stream.topic for stream in SCAN_STREAMS)


def scan_to_msgs(scan: Scan, config: ScanConfig, frame_id: str) -> Iterator[tuple[str, LaserScan]]:
    """Yield topic and message of what the scanner reads, and of the true distances, which have no intensities."""
    for topic, ranges, intensities in ((SCAN, scan.ranges, scan.intensities), (SCAN_IDEAL, scan.ideal, np.zeros(0, np.float32))):
        yield topic, _scan_to_msg(config, ranges, intensities, scan.stamp_ns, frame_id)


def _scan_to_msg(
    config: ScanConfig, ranges: NDArray[np.float32], intensities: NDArray[np.float32], stamp_ns: int, frame_id: str
) -> LaserScan:
    message = LaserScan(header=header(stamp_ns, frame_id))
    values = {
        "angle_min": config.angle_min_rad,
        "angle_max": config.angle_max_rad,
        "angle_increment": config.angle_increment_rad,
        "time_increment": config.time_increment_s,
        "scan_time": 1.0 / config.rate_hz,
        "range_min": config.range_min_m,
        "range_max": config.range_max_m,
    }
    for name, value in values.items():  # rounded, as on the way, so that what comes back is equal
        setattr(message, name, float(np.float32(value)))
    message.ranges.frombytes(ranges.data.cast("B"))
    message.intensities.frombytes(intensities.data.cast("B") if len(intensities) else b"")
    return message


def laser_pose_to_msgs(pose: CameraPose, world: str, laser: str) -> tuple[PoseStamped, TransformStamped]:
    """Return the pose of the scanner's frame ``laser`` in ``world``, and the same as a transform."""
    return pose_to_msg(pose, world), transform_to_msg(pose.stamp_ns, world, laser, pose.position_m, pose.orientation)
