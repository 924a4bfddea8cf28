"""A live scanner: scans for who subscribes, at their own rate, with their transforms, and nothing for anybody else."""

import json

import numpy as np
import pytest
from rclpy.context import Context
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from renderer.lidar.config import ScanConfig
from renderer.lidar.scanner import scanner_poses, scans_of_path
from scene_description import scene_to_json
from scene_synth_ros.suite.qos import latched_qos, stream_qos

SETTINGS = {"camera.width": 32, "camera.height": 24, "streams.camera": "eye", "scan.enabled": True, "scan.rate_hz": 40.0}
CONFIG = ScanConfig(enabled=True, rate_hz=40.0)


def stamp_of(header) -> int:
    return header.stamp.sec * 10**9 + header.stamp.nanosec


def test_scans_and_transforms_come_and_nothing_is_rendered_or_sent_for_nobody() -> None:
    scene = sample_scene()
    path, count = scene.camera_path, len(scans_of_path(CONFIG, scene.camera_path))
    with node_process("renderer_node", SETTINGS) as context:
        peer, scans, moving, counts = listen(context)
        sender = peer.node.create_publisher(String, "scene", latched_qos())
        peer.spin_until(lambda: peer.node.count_publishers("scan") and peer.node.count_publishers("/tf"), 120, "the renderer")
        sender.publish(String(data=scene_to_json(scene)))
        peer.spin_until(lambda: len(scans) == count and counts.get("/synth/laser/pose", 0) > count, 120, "scans and the end of the path")
        peer.spin_until(lambda: len([item for message in moving for item in message.transforms]) == counts["/tf"], 120, "transforms")
    assert [stamp_of(scan.header) - path[0].stamp_ns for scan in scans] == [k * 25_000_000 for k in range(count)]
    found = {stamp_of(item.header): item for message in moving for item in message.transforms if item.child_frame_id == "laser"}
    for scan in scans:
        assert np.isfinite(scan.ranges).mean() > 0.5
        for pose in scanner_poses(CONFIG, path, stamp_of(scan.header)):
            place = found[pose.stamp_ns].transform.translation
            assert (place.x, place.y, place.z) == pytest.approx(pose.position_m)
    assert counts["/synth/scan"] == count
    assert counts["/synth/scan_ideal"] == counts["/synth/eye/color/image_raw"] == counts["/synth/eye/depth/image_raw"] == 0


def listen(context: Context) -> tuple[Peer, list[LaserScan], list[TFMessage], dict[str, int]]:
    """Return a peer, the scans and transforms that it hears, and what the renderer says that it has published."""
    peer, scans, moving, counts = Peer(context), [], [], {}
    peer.node.create_subscription(LaserScan, "scan", scans.append, stream_qos(100))
    peer.node.create_subscription(TFMessage, "/tf", moving.append, stream_qos(100))
    peer.node.create_subscription(String, "status", lambda message: counts.update(json.loads(message.data)["counts"]), latched_qos(100))
    return peer, scans, moving, counts
