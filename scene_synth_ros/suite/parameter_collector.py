"""Asks other nodes for their parameters."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

from scene_description.strict import shorten
from scene_synth_ros.suite.parameters import ROS_OWN
from scene_synth_ros.suite.suite_node import REFUSALS, SuiteNode

_AGAIN_S, _PATIENCE_S = 2.0, 5.0
"""How long an answer may take before one asks again, as it may be lost while connections are made, and before nobody waits for it."""


class ParameterCollector:
    """Asks each node for its parameters until it answers, from when it is told of it; one that does not, or not as nodes do, is left out.

    Args:
        on_change: called with node name -> parameter name -> value when there is more to tell.
    """

    def __init__(self, node: SuiteNode, on_change: Callable[[dict[str, dict[str, Any]]], None]) -> None:
        self._node, self._on_change = node, on_change
        self._asked: set[str] = set()
        self._waiting: dict[str, tuple[Client, Client]] = {}
        self._told_at: dict[str, float] = {}
        self._sent_at: dict[str, float] = {}
        self.values: dict[str, dict[str, Any]] = {}

    def ask(self, name: str) -> None:
        """Ask a node, given by its fully qualified name, for its parameters."""
        if name in self._asked:
            return
        self._asked.add(name)
        try:
            lister = self._node.create_client(ListParameters, f"{name}/list_parameters")
            self._waiting[name] = lister, self._node.create_client(GetParameters, f"{name}/get_parameters")
            self._told_at[name] = time.monotonic()
        except REFUSALS:
            self._leave_out(shorten(name), "expected the name of a node")

    @property
    def expects_answers(self) -> bool:
        """Whether a node has been told of, not long ago, that has not answered yet."""
        now = time.monotonic()
        return any(now - self._told_at[name] < _PATIENCE_S for name in self._waiting)

    def step(self) -> None:
        """Send the requests whose services have appeared, once more where no answer has come; to be called now and then."""
        now = time.monotonic()
        for name, (lister, getter) in sorted(self._waiting.items()):
            if self._node.count_services(getter.srv_name) > 1:
                del self._waiting[name]
                self._leave_out(name, "two nodes have that name")
            elif now - self._sent_at.get(name, -_AGAIN_S) >= _AGAIN_S and lister.service_is_ready() and getter.service_is_ready():
                self._sent_at[name] = now
                lister.call_async(ListParameters.Request()).add_done_callback(partial(self._get, name, getter))

    def _get(self, name: str, getter: Client, future: Future) -> None:
        names = [known for known in future.result().result.names if not known.startswith(ROS_OWN)]
        getter.call_async(GetParameters.Request(names=names)).add_done_callback(partial(self._take, name, names))

    def _take(self, name: str, names: list[str], future: Future) -> None:
        if self._waiting.pop(name, None) is None:
            return
        try:
            values = [parameter_value_to_python(value) for value in future.result().values]
        except (RuntimeError, ValueError) as error:
            self._leave_out(name, str(error))
            return
        if len(values) != len(names):
            self._leave_out(name, f"expected the values of {len(names)}, got {len(values)}")
            return
        plain = [list(value) if hasattr(value, "tolist") else value for value in values]
        self.values[name] = {key: value for key, value in zip(names, plain, strict=True) if value is not None}
        self._on_change(self.values)

    def _leave_out(self, name: str, reason: str) -> None:
        self._node.warn(f"the parameters of {name} are left out: {reason}")
