"""Asks other nodes for their parameters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.client import Client
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

from scene_synth_ros.suite.parameters import ROS_OWN
from scene_synth_ros.suite.suite_node import SuiteNode


class ParameterCollector:
    """Asks each node once, when it is told of it; a node that does not answer is left out.

    Args:
        on_change: called with node name -> parameter name -> value when there is more to tell.
    """

    def __init__(self, node: SuiteNode, on_change: Callable[[dict[str, dict[str, Any]]], None]) -> None:
        self._node, self._on_change = node, on_change
        self._asked: dict[str, tuple[Client, Client]] = {}
        self._waiting: set[str] = set()
        self.values: dict[str, dict[str, Any]] = {}

    def ask(self, name: str) -> None:
        """Ask a node, given by its fully qualified name, for its parameters."""
        if name not in self._asked:
            clients = (
                self._node.create_client(ListParameters, f"{name}/list_parameters"),
                self._node.create_client(GetParameters, f"{name}/get_parameters"),
            )
            self._asked[name] = clients
            self._waiting.add(name)

    def step(self) -> None:
        """Send the requests whose services have appeared; to be called now and then."""
        for name in sorted(self._waiting):
            lister, getter = self._asked[name]
            if self._node.count_services(getter.srv_name) > 1:
                self._waiting.discard(name)
                self._node.warn(f"the parameters of {name} are left out: two nodes have that name")
            elif lister.service_is_ready() and getter.service_is_ready():
                self._waiting.discard(name)
                lister.call_async(ListParameters.Request()).add_done_callback(lambda future, name=name: self._get(name, future))

    def _get(self, name: str, future: Future) -> None:
        names = [known for known in future.result().result.names if not known.startswith(ROS_OWN)]
        request = GetParameters.Request(names=names)
        self._asked[name][1].call_async(request).add_done_callback(lambda done: self._take(name, names, done))

    def _take(self, name: str, names: list[str], future: Future) -> None:
        values = [parameter_value_to_python(value) for value in future.result().values]
        plain = [list(value) if hasattr(value, "tolist") else value for value in values]
        self.values[name] = {key: value for key, value in zip(names, plain, strict=True) if value is not None}
        self._on_change(self.values)
