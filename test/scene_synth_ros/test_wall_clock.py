"""A run whose stamps are the time of day, in real processes."""

import time

import pytest
from rosgraph_msgs.msg import Clock
from scene_synth_ros_suite import SMALL, Child, Peer, command, dds_context, environment, stop
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import String

from scene_synth_ros.suite.qos import latched_qos, stream_qos

pytestmark = pytest.mark.slow

WALL = ["grammar_node.clock:=wall", "grammar_node.lock_step:=false", "grammar_node.rate_hz:=5.0", "grammar_node.frames_per_room:=10"]


def test_frames_are_stamped_with_the_time_at_which_they_come_and_no_clock_is_published():
    env = environment()
    late_s: list[float] = []
    clocks: list[Clock] = []
    scenes: list[String] = []

    def take(info: CameraInfo) -> None:
        late_s.append(time.time() - info.header.stamp.sec - info.header.stamp.nanosec * 1e-9)

    suite = Child(command("run", "--params", "live", *(word for override in (*SMALL, *WALL) for word in ("-p", override))), env=env)
    try:
        with dds_context(int(env["ROS_DOMAIN_ID"])) as context:
            peer = Peer(context)
            peer.node.create_subscription(CameraInfo, "camera/depth/camera_info", take, stream_qos(100))
            peer.node.create_subscription(String, "scene", scenes.append, latched_qos(10))
            peer.node.create_subscription(Clock, "/clock", clocks.append, stream_qos(100))
            peer.spin_until(lambda: len(late_s) >= 15 and len(scenes) >= 2, 180, "the frames of two rooms")
            assert not clocks and not peer.node.count_publishers("/clock")
    finally:
        stop(suite)
    newest = sorted(late_s[5:])
    assert newest[0] > -0.01 and newest[len(newest) // 2] < 0.25, newest
