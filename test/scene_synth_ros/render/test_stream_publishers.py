"""The publishers of a camera: each with its own QoS."""

import pytest
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSReliabilityPolicy
from rosgraph_msgs.msg import Clock
from scene_synth_ros_suite import claim_domain, dds_context

from renderer import CameraConfig
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.render import streams
from scene_synth_ros.render.streams import UNNAMED, StreamPublishers
from scene_synth_ros.suite.connections import NAME_NOT_YET_KNOWN, Endpoint, publishers_of

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
        output.settle_clock()
        depths = {publisher.topic_name: publisher.qos_profile.depth for publisher in node.publishers}
        assert (depths[COLOR], depths[DEPTH], depths[CLOCK]) == (30, 10, 7)
        others = {name for name, depth in depths.items() if depth == 30} - {COLOR}
        assert not others
        offered = {topic: node.get_publishers_info_by_topic(topic)[0].qos_profile.reliability for topic in (COLOR, DEPTH)}
        assert offered == {COLOR: QoSReliabilityPolicy.BEST_EFFORT, DEPTH: QoSReliabilityPolicy.RELIABLE}
        assert output.depth == 7, "no more frames may wait for a recorder than the publisher that keeps least holds for it"
        untouched = StreamPublishers(Node("second", namespace="/synth", context=context), StreamConfig(), CameraConfig())
        untouched.settle_clock()
        assert untouched.depth == 10


def suite(context: Context, namespace: str) -> StreamPublishers:
    node = Node("renderer_node", namespace=namespace, context=context)
    return StreamPublishers(node, StreamConfig(), CameraConfig())


def clocks(context: Context, others: int = 0) -> list[str]:
    """Return the nodes that publish /clock."""
    return sorted(endpoint.node for endpoint in publishers_of(Node("looker", context=context), CLOCK))


def test_of_suites_that_begin_together_one_publishes_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    with dds_context(claim_domain()) as context:
        suites = [suite(context, f"/robot{number}") for number in range(3)]
        assert clocks(context) == []
        with monkeypatch.context() as blind:
            blind.setattr(StreamPublishers, "other_clocks", lambda _: [])
            for output in suites:
                output.settle_clock()
        assert len(clocks(context)) == 3, "none had heard of another"
        for output in suites * 2:
            output.settle_clock()
        (first,) = clocks(context)
        for output in suites:
            told = output.settle_clock()
            assert told == ([] if output.has_clock else [first])
        late = suite(context, "/robot9")
        assert late.settle_clock() == [first] and clocks(context) == [first], "who comes later leaves it alone"
        (holder,) = (output for output in suites if output.has_clock)
        holder.settle_clock(wanted=False)
        for output in [late, *suites] * 2:
            output.settle_clock(wanted=output is not holder)
        assert len(clocks(context)) == 1 and clocks(context) != [first], "when that is gone, one takes it over"


def test_the_clock_of_a_stranger_is_left_alone_by_all() -> None:
    with dds_context(claim_domain()) as context:
        output = suite(context, "/synth")
        output.settle_clock()
        simulator = Node("simulator", context=context)
        foreign = simulator.create_publisher(Clock, CLOCK, 10)
        assert output.settle_clock() == ["/simulator"] and clocks(context) == ["/simulator"]
        assert "/clock" not in output.counts, "no recorder waits for it"
        simulator.destroy_publisher(foreign)
        assert output.settle_clock() == [] and output.counts["/clock"] == 0


def test_a_clock_whose_node_has_no_name_yet_is_left_alone_in_plain_words(monkeypatch: pytest.MonkeyPatch) -> None:
    with dds_context(claim_domain()) as context:
        output = suite(context, "/robot1")
        with monkeypatch.context() as early:
            early.setattr(streams, "publishers_of", lambda *_: [Endpoint(f"_NODE_NAMESPACE_UNKNOWN_/{NAME_NOT_YET_KNOWN}", "ff")])
            assert output.settle_clock() == [UNNAMED] and not output.has_clock
        assert output.settle_clock() == [] and output.has_clock
