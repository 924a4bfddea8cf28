"""What the suite uses of rclpy without rclpy having a public name for it: one place, whose test names what a new release broke."""

from collections.abc import Callable, Iterator
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.impl.rcutils_logger import RcutilsLogger as Logger
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription

__all__ = ["RCL_ERRORS", "ChangeState", "LateAnswer", "Logger", "overrides_of", "waiting", "wrap_change_state"]

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


def waiting(subscription: Subscription, most: int) -> Iterator[Any]:
    """Yield messages that wait to be taken, as the subscription's callback gets them, ``most`` of them.

    An executor takes one of each topic, then waits anew for all that a node has, which takes longer than to take a small message.
    """
    with subscription.handle:
        for _ in range(most):
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if taken is None:
                return
            yield taken[0]


def wrap_change_state(node: LifecycleNode, wrap: Callable[[ChangeState], ChangeState]) -> None:
    """Put something around the callback of a managed node's service ``~/change_state``."""
    service = node._service_change_state
    service.callback = wrap(service.callback)


class LateAnswer:
    """What the callback of a service may return in place of a response, to send that later: an executor has no other way to wait for it.

    A coroutine that waits would keep the executor of this release busy meanwhile.
    """

    def __init__(self, service: Service) -> None:
        self._send: Callable[[Any], None] | None = None
        if "send_response" not in service.__dict__:
            send = service.send_response

            def send_or_keep(response: Any, header: Any) -> None:
                if isinstance(response, LateAnswer):
                    response._send = lambda answer: send(answer, header)
                else:
                    send(response, header)

            service.send_response = send_or_keep

    @property
    def is_due(self) -> bool:
        """Whether the executor has taken note that the response comes later."""
        return self._send is not None

    def send(self, response: Any) -> None:
        """Send the response, once it is due."""
        assert self._send is not None
        self._send(response)
