"""The publishers of a camera: each with its own QoS."""

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSReliabilityPolicy
from scene_synth_ros_suite import claim_domain, dds_context

from renderer import CameraConfig
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.render.streams import StreamPublishers

COLOR, DEPTH, CLOCK = "/synth/camera/color/image_raw", "/synth/camera/depth/image_raw", "/clock"


def test_an_override_of_a_topic_changes_that_one() -> None:
    overrides = [
        Parameter(f"qos_overrides.{COLOR}.publisher.depth", value=30),
        Parameter(f"qos_overrides.{COLOR}.publisher.reliability", value="best_effort"),
        Parameter("qos_overrides./clock.publisher.depth", value=7),
    ]
    with dds_context(claim_domain()) as context:
        node = Node("renderer_node", namespace="/synth", context=context, parameter_overrides=overrides)
        output = StreamPublishers(node, StreamConfig(), CameraConfig())
        depths = {publisher.topic_name: publisher.qos_profile.depth for publisher in node.publishers}
        assert (depths[COLOR], depths[DEPTH], depths[CLOCK]) == (30, 10, 7)
        others = {name for name, depth in depths.items() if depth == 30} - {COLOR}
        assert not others
        offered = {topic: node.get_publishers_info_by_topic(topic)[0].qos_profile.reliability for topic in (COLOR, DEPTH)}
        assert offered == {COLOR: QoSReliabilityPolicy.BEST_EFFORT, DEPTH: QoSReliabilityPolicy.RELIABLE}
        assert output.depth == 7, "no more frames may wait for a recorder than the publisher that keeps least holds for it"
        untouched = StreamPublishers(Node("second", namespace="/other", context=context), StreamConfig(), CameraConfig())
        assert untouched.depth == 10
