"""A robot that Twists drive through a room by its own laser, over DDS: it stops at what is in its way, and its bag is true."""

from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from rclpy.serialization import deserialize_message
from scene_synth_ros_suite import Child, Peer, dds_context, environment, record_command, stop
from sensor_msgs.msg import LaserScan

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.prove.prove import lines_of, prove_bag
from scene_synth_ros.suite.qos import stream_qos
from scene_synth_ros.verify.bag_verify import verify_bag

pytestmark = pytest.mark.slow

RADIUS_M, CLEAR_M = 0.22, 0.8
FRAMES = 210
OVERRIDES = (
    "grammar_node.rate_hz:=15.0", "grammar_node.motion.kind:=base", "grammar_node.motion.body_radius_m:=0.22",
    "grammar_node.motion.camera_m:=[0.05,0.0,0.25]",
    "renderer_node.body.enabled:=true", "renderer_node.imu.enabled:=true", "renderer_node.wheels.enabled:=true",
    "renderer_node.scan.enabled:=true", "renderer_node.scan.height_m:=0.15", "renderer_node.scan.range_min_m:=0.02",
    "renderer_node.scan.mount_m:=[-0.05,0.0,0.0]",
    "renderer_node.lidar.enabled:=true", "renderer_node.lidar.columns:=300",
    "renderer_node.lidar.mount_m:=[0.0,0.0,0.3]", "renderer_node.camera.row_time_s:=0.0001", "renderer_node.drive.enabled:=true",
    "renderer_node.drive.max_speed_m_s:=1.0", "renderer_node.drive.acceleration_m_s2:=2.0", f"renderer_node.drive.radius_m:={RADIUS_M}",
    *(f"renderer_node.streams.{layer}:=false" for layer in ("color", "normals", "semantic", "instance")),
)  # fmt: skip


class Pilot:
    """Turns a robot to the left until nothing stands in the first part of its way, then tells it to go ahead at a metre a second."""

    def __init__(self, peer: Peer) -> None:
        self._command = Twist()
        publisher = peer.node.create_publisher(Twist, "cmd_vel", stream_qos(1))
        self._scans = peer.node.create_subscription(LaserScan, "/synth/scan_ideal", self._see, stream_qos(5))
        self._timer = peer.node.create_timer(0.05, lambda: publisher.publish(self._command))

    def _see(self, scan: LaserScan) -> None:
        ranges = np.array(scan.ranges)
        angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
        ahead_m, aside_m = ranges * np.cos(angles), ranges * np.sin(angles)
        in_the_way = (ahead_m > 0.0) & (ahead_m < CLEAR_M) & (np.abs(aside_m) < RADIUS_M + 0.05)
        if self._command.linear.x == 0.0:
            self._command.angular.z = 0.8 if in_the_way.any() else 0.0
            self._command.linear.x = 0.0 if in_the_way.any() else 1.0


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of fourteen seconds, in which a robot turns to where its way is free, and is told to go ahead from then on."""
    folder, env = tmp_path_factory.mktemp("driven") / "bag", environment()
    words = [word for override in OVERRIDES for word in ("-p", override)]
    process = Child(record_command(folder, "--rooms", 1, "--frames", FRAMES, "--seed", 6, *words), env=env)
    try:
        with dds_context(int(env["ROS_DOMAIN_ID"])) as context:
            peer = Peer(context)
            Pilot(peer)
            peer.spin_until(lambda: process.poll() is not None, 300, "the end of the run")
    finally:
        stop(process)
    assert process.returncode == 0, "\n".join(process.said())
    return folder


def messages(bag: Path, topic: str) -> list:
    with BagReader(bag) as reader:
        return [deserialize_message(found.data, message_class(found.type_name)) for found in reader.messages([topic])]


def test_it_drives_until_something_is_in_its_way_and_stands_there(bag: Path) -> None:
    told = messages(bag, "/synth/odom/ideal")
    places = np.array([(at.pose.pose.position.x, at.pose.pose.position.y) for at in told])
    speeds = np.array([at.twist.twist.linear.x for at in told])
    assert np.linalg.norm(places[-1] - places[0]) > 0.1
    assert 0.2 < speeds.max() <= 1.0 + 1e-9 and speeds.min() > -1e-9
    assert np.abs(speeds[-60:]).max() < 1e-9
    nearest = [min(scan.ranges) for scan in messages(bag, "/synth/scan_ideal")]
    assert min(nearest) >= RADIUS_M - 1e-3 and nearest[-1] < 1.0


def test_its_bag_is_whole_made_again_and_true(bag: Path) -> None:
    assert inspect_bag(bag).faults == ()
    again = verify_bag(bag)
    assert again.good and again.frames == FRAMES, again
    proof = prove_bag(bag)
    assert proof.good, list(lines_of(proof))
    assert {"imu", "motion", "odometry", "scan", "lidar", "clock"} <= {verdict.check for verdict in proof.verdicts if verdict.checked}
