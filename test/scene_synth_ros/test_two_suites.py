"""Two suites in two namespaces of one ROS graph, in real processes."""

import contextlib

import pytest
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Clock
from scene_synth_ros_suite import SMALL, Child, Peer, command, dds_context, environment, stop
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from scene_synth_ros.suite.qos import latched_qos, stream_qos

pytestmark = pytest.mark.slow


def suite(namespace: str, env: dict[str, str], *overrides: str) -> Child:
    words = [word for override in (*SMALL, "grammar_node.scene.room_type:=hallway", *overrides) for word in ("-p", override)]
    return Child(command("run", "--params", "live", "--namespace", namespace, *words), env=env)


def test_frames_are_apart_and_the_second_suite_leaves_the_clock_to_the_first():
    env = environment()
    frames: dict[str, set[str]] = {}
    clocks: list[Clock] = []
    with contextlib.ExitStack() as stack:
        stack.callback(stop, first := suite("/synth", env))
        peer = Peer(stack.enter_context(dds_context(int(env["ROS_DOMAIN_ID"]))))
        for namespace in ("/synth", "/robot1"):
            heard = frames[namespace] = set()

            def take(message: object, heard: set[str] = heard) -> None:
                heard.add(getattr(message, "markers", [message])[0].header.frame_id)

            peer.node.create_subscription(Image, f"{namespace}/camera/depth/image_raw", take, stream_qos())
            peer.node.create_subscription(PoseStamped, f"{namespace}/camera/pose", take, stream_qos())
            peer.node.create_subscription(MarkerArray, f"{namespace}/scene/markers", take, latched_qos())
        peer.node.create_subscription(Clock, "/clock", clocks.append, stream_qos(1000))
        peer.spin_until(lambda: len(frames["/synth"]) == 2 and clocks, 180, "the first suite")
        stack.callback(stop, suite("/robot1", env))
        peer.spin_until(lambda: len(frames["/robot1"]) == 2, 180, "the second suite")
        told = "/clock is published by /synth/renderer_node too: this camera leaves it alone; "
        peer.spin_until(lambda: any(error.startswith(told) for error in peer.errors), 120, "the second suite's word on /clock")
        assert frames == {"/synth": {"map", "camera_optical_frame"}, "/robot1": {"robot1/map", "robot1/camera_optical_frame"}}
        times = [message.clock.sec * 10**9 + message.clock.nanosec for message in clocks]
        assert times == sorted(times), "one clock"
        stop(first)
        seen = len(clocks)
        peer.spin_until(lambda: len(clocks) > seen, 120, "the second suite's clock, now that it is alone")
