"""Faults of the program in a node's callbacks, transitions and threads: told with traceback, seed and room, counted, and survived."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from scene_synth_ros_suite import claim_domain, dds_context
from std_msgs.msg import String
from std_srvs.srv import Trigger

from scene_synth_ros.suite.diagnostics import OK, Diagnostics
from scene_synth_ros.suite.environment import RUN
from scene_synth_ros.suite.faults import FAULT_STATUS
from scene_synth_ros.suite.qos import latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus, status_to_json
from scene_synth_ros.suite.suite_node import SuiteNode


class FaultyNode(SuiteNode):
    """A node whose message, service, timer and transition callbacks make a mistake."""

    def __init__(self, **options: Any) -> None:
        super().__init__("faulty_node", automatically_declare_parameters_from_overrides=True, **options)
        self.failed_because = ""
        self.broken_open = False
        self.begin(True)

    def open(self) -> None:
        if self.broken_open:
            raise KeyError("open")
        self.create_subscription(String, "words", self._on_words, stream_qos())
        self.create_service(Trigger, "~/mistake", self._on_call)
        self.diagnostics = Diagnostics(self, lambda: (OK, "well", {}), 0.2)

    def fail(self, reason: str) -> None:
        self.failed_because = reason

    def at_work(self) -> str:
        return "room 7 of seed 3"

    def _on_words(self, message: String) -> None:
        raise ValueError(f"operands could not be broadcast {message.data}")

    def _on_call(self, _request: Trigger.Request, _response: Trigger.Response) -> Trigger.Response:
        raise IndexError("index 5 is out of bounds")


class World:
    """A faulty node, one that speaks to it, and what the first says of itself."""

    def __init__(self, context: Context, *parameters: Parameter) -> None:
        self.faulty = FaultyNode(context=context, parameter_overrides=list(parameters))
        self.other = Node("other", context=context)
        self.logged: list[str] = []
        self.faulty.faults._log = self.logged.append
        self.values: dict[str, str] = {}
        self.messages: list[str] = []
        self.other.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self.words = self.other.create_publisher(String, "words", stream_qos())
        self.executor = SingleThreadedExecutor(context=context)
        for node in (self.faulty, self.other):
            self.executor.add_node(node)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.values = {item.key: item.value for item in message.status[0].values}
        self.messages.append(message.status[0].message)

    def spin_until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + 15
        while not condition():
            assert time.monotonic() < deadline
            self.executor.spin_once(timeout_sec=0.05)

    def say(self, text: str) -> None:
        self.spin_until(lambda: self.words.get_subscription_count() == 1)
        self.words.publish(String(data=text))


@pytest.fixture
def context() -> Iterator[Context]:
    with dds_context(claim_domain()) as context:
        yield context


def test_a_fault_in_a_callback_is_told_and_counted_and_the_node_goes_on(context: Context) -> None:
    world = World(context)
    for number in (1, 2):
        world.say("(3,) (4,)")
        world.spin_until(lambda number=number: world.values.get("faults") == str(number))
    line = "fault of the program while faulty_node handled a message of words at room 7 of seed 3: ValueError: operands could not"
    assert world.values["last_fault"].startswith(line) and world.messages[-1] == world.values["last_fault"]
    assert "Traceback" in world.logged[0] and "in _on_words" in world.logged[0] and "please report it" in world.logged[0]
    assert world.faulty.exit_code is None and not world.faulty.failed_because


def test_a_caller_of_a_service_with_a_fault_is_answered(context: Context) -> None:
    world = World(context)
    client = world.other.create_client(Trigger, "/faulty_node/mistake")
    world.spin_until(client.service_is_ready)
    future = client.call_async(Trigger.Request())
    world.spin_until(future.done)
    assert not future.result().success and "IndexError: index 5 is out of bounds" in future.result().message
    assert world.faulty.faults.count == 1


def test_a_fault_ends_a_run_that_shall_end(context: Context) -> None:
    world = World(context, Parameter("exit_when_done", value=True))
    world.say("x")
    world.spin_until(lambda: world.faulty.exit_code is not None)
    assert world.faulty.exit_code == FAULT_STATUS and "ValueError" in world.faulty.failed_because


@pytest.mark.parametrize(("shall_end", "reason"), [(True, "ended by SIGTERM before the run was over"), (False, "")])
def test_who_is_ended_tells_the_peers_of_a_run_that_shall_end(context: Context, shall_end: bool, reason: str) -> None:
    world = World(context, Parameter("exit_when_done", value=shall_end))
    world.faulty.leave("ended by SIGTERM")
    assert world.faulty.leaving and world.faulty.failed_because == reason


def test_a_fault_in_a_transition_is_told(context: Context) -> None:
    world = World(context)
    world.faulty.trigger_deactivate()
    world.faulty.trigger_cleanup()
    world.faulty.broken_open = True
    assert world.faulty.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert world.faulty.faults.count == 1 and "handled the transition open at room 7" in world.faulty.faults.last
    world.faulty.broken_open = False
    assert world.faulty.trigger_configure() == TransitionCallbackReturn.SUCCESS


@pytest.mark.parametrize(("own", "names"), [("mine", ["renderer_node", "grammar_node", "recorder_node"]), ("", None)])
def test_renderers_that_a_run_has_not_started_are_told_and_not_heard(
    context: Context, monkeypatch: pytest.MonkeyPatch, own: str, names: list[str] | None
) -> None:
    monkeypatch.setenv(RUN, own)
    world = World(context)
    heard, told = [], []
    world.faulty.hear_status(lambda status: heard.append(status.node), told.append)
    publisher = world.other.create_publisher(String, "status", latched_qos(10))
    all_names = ["renderer_node", "forgotten_node", "forgotten_node", "grammar_node", "recorder_node"]
    for name in all_names:
        role = "renderer" if name == "forgotten_node" else name.partition("_")[0]
        token = "mine" if name == "renderer_node" else ""
        publisher.publish(String(data=status_to_json(NodeStatus(node=name, role=role, state="ready", token=token, start=name))))
    # A line is not lost to another of the same second.
    said = []
    monkeypatch.setattr(world.faulty, "warn_once", said.append)
    world.faulty.warn("something else")
    world.spin_until(lambda: "recorder_node" in heard)
    assert heard == (names or all_names)
    line = "forgotten_node is in this namespace, but no renderer of this run: its frames are left out; end it, or run in another namespace"
    assert said == ([line] if own else []) and told == [] and world.faulty.strangers == ({"forgotten_node"} if own else set())
