"""What the suite uses of rclpy without a public name: each test names what a new release of rclpy broke."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.srv import ChangeState
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter
from scene_synth_ros_suite import Peer, claim_domain, dds_context, wait_until
from std_msgs.msg import String

from scene_synth_ros.suite import rclpy_internals


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    with dds_context(claim_domain()) as context:
        yield context


def test_node_parameter_overrides_are_those_of_files_command_line_and_constructor(context: Context, tmp_path: Path) -> None:
    assert hasattr(Node("probe", context=context), "_parameter_overrides"), "rclpy.node.Node._parameter_overrides"
    file = tmp_path / "parameters.yaml"
    file.write_text("/**:\n  ros__parameters:\n    of_file: 1\n    empty: []\n")
    words = ["--ros-args", "--params-file", str(file), "-p", "of_line:=two"]
    node = Node("overridden", context=context, cli_args=words, parameter_overrides=[Parameter("of_constructor", value=3.0)])
    assert rclpy_internals.overrides_of(node) == {"of_file": 1, "empty": None, "of_line": "two", "of_constructor": 3.0}
    node.destroy_node()


def test_the_callback_of_change_state_can_be_wrapped(context: Context) -> None:
    peer, node, seen = Peer(context), LifecycleNode("managed", context=context), []
    assert hasattr(node, "_service_change_state"), "rclpy.lifecycle.LifecycleNode._service_change_state"

    def wrap(change_state: rclpy_internals.ChangeState) -> rclpy_internals.ChangeState:
        def wrapped(request: Any, response: Any) -> Any:
            seen.append(request.transition.id)
            return change_state(request, response)

        return wrapped

    rclpy_internals.wrap_change_state(node, wrap)
    peer.spin_too(node)
    client = peer.node.create_client(ChangeState, "/managed/change_state")
    peer.spin_until(client.service_is_ready, 20, "the service")
    request = ChangeState.Request()
    request.transition.id = 1
    answer = client.call_async(request)
    peer.spin_until(answer.done, 20, "the answer")
    assert seen == [1] and answer.result().success, "the callback of a Service is read when a request comes"


def test_what_waits_of_a_topic_is_taken_in_its_order_and_no_more_than_was_asked_for(context: Context) -> None:
    node = Node("hears", context=context)
    subscription = node.create_subscription(String, "said", lambda _: None, 10)
    assert hasattr(subscription.handle, "take_message"), "rclpy.subscription.Subscription.handle.take_message"
    publisher = node.create_publisher(String, "said", 10)
    wait_until(publisher.get_subscription_count, 20, "the subscription")
    for word in ("one", "two", "three"):
        publisher.publish(String(data=word))
    assert publisher.wait_for_all_acked(Duration(seconds=10))
    taken = [[message.data for message in rclpy_internals.waiting(subscription, 2)] for _ in range(3)]
    assert taken == [["one", "two"], ["three"], []]
    node.destroy_node()


def test_the_errors_of_rcl_have_names() -> None:
    assert [error.__name__ for error in rclpy_internals.RCL_ERRORS] == ["RCLError", "RCUtilsError", "RMWError", "UnknownROSArgsError"]
    assert hasattr(rclpy_internals.Logger, "warning"), "rclpy.impl.rcutils_logger.RcutilsLogger"
