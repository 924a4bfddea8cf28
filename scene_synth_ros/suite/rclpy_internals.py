"""What the suite uses of rclpy without rclpy having a public name for it: one place, whose test names what a new release broke."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.impl.rcutils_logger import RcutilsLogger as Logger
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node

__all__ = ["RCL_ERRORS", "ChangeState", "Logger", "overrides_of", "wrap_change_state"]

RCL_ERRORS: tuple[type[Exception], ...] = (
    rclpy_implementation.RCLError,
    rclpy_implementation.RCUtilsError,
    rclpy_implementation.RMWError,
    rclpy_implementation.UnknownROSArgsError,
)
"""What rcl raises for words that are no ROS arguments or names, and where it cannot go on."""
ChangeState = Callable[[Any, Any], Any]
"""Callback of the service ``~/change_state``: request, response -> response."""


def overrides_of(node: Node) -> dict[str, Any]:
    """Return the values that a node is started with, by parameter name: from parameter files, command line and constructor.

    An empty list of a parameter file has no type in ROS; its value is None here.  (rclpy would raise if it were to declare one by itself.)
    """
    return {name: parameter.value for name, parameter in node._parameter_overrides.items()}


def wrap_change_state(node: LifecycleNode, wrap: Callable[[ChangeState], ChangeState]) -> None:
    """Put something around the callback of a managed node's service ``~/change_state``."""
    service = node._service_change_state
    service.callback = wrap(service.callback)
