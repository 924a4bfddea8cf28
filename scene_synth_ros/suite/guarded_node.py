"""A node none of whose callbacks can lose what it raises.

What a callback raises beyond what a user can cause is a fault of the program: it is logged with its traceback and counted in
``/diagnostics``, and the node goes on; with the parameter ``exit_when_done`` it tells its peers and ends with ``FAULT_STATUS``.
"""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.guard_condition import GuardCondition
from rclpy.lifecycle import LifecycleNode
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from scene_synth_ros.suite.faults import FAULT_STATUS, Faults

STEADY = Clock(clock_type=ClockType.STEADY_TIME)
"""Goes on evenly whatever becomes of wall clock and ``/clock``; timers, timeouts and throttled lines go by it."""


class GuardedNode(LifecycleNode):  # type: ignore[misc]
    """Tells what its callbacks raise, and keeps the newest warning.

    Threading: callbacks and :meth:`fail` run in the executor's thread; ``faults``, :meth:`warn` and :meth:`refuse` are for any thread.

    Attributes:
        exit_code: None while the node runs; what its process shall end with.
        faults: the faults of the program that have come up in this node.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.exit_code: int | None = None
        self.faults = Faults(lambda text: self.get_logger().error(text))
        self._faults_seen = 0
        self._warning, self._warned_s = "", 0.0
        self.create_timer(0.5, self._look_for_faults)

    def fail(self, reason: str) -> None:
        """Tell the peers that the node has failed; its process ends next."""

    def at_work(self) -> str:
        """Return the room at work, with its seed, as a fault's report names it; empty if there is none."""
        return ""

    def warn(self, text: str) -> None:
        """Log a warning, one a second at most, and keep it for ``/diagnostics``."""
        self._warning, self._warned_s = text, time.monotonic()
        self.get_logger().warning(text, throttle_duration_sec=1.0, throttle_time_source_type=STEADY)

    def refuse(self, text: str) -> None:
        """Log as an error that something asked for is refused, one a second at most, and keep it for ``/diagnostics``."""
        self._warning, self._warned_s = text, time.monotonic()
        self.get_logger().error(text, throttle_duration_sec=1.0, throttle_time_source_type=STEADY)

    def last_warning(self, seconds: float = math.inf) -> str:
        """Return the newest warning or refusal if it is not older than so many seconds, else nothing."""
        return self._warning if time.monotonic() - self._warned_s < seconds else ""

    def create_subscription(self, msg_type: type, topic: str, callback: Callable[..., Any], *args: Any, **options: Any) -> Subscription:
        """Make a subscription; what its callback raises is told."""
        return super().create_subscription(msg_type, topic, self._telling(callback, f"a message of {topic}"), *args, **options)

    def create_service(self, srv_type: type, srv_name: str, callback: Callable[[Any, Any], Any], **options: Any) -> Service:
        """Make a service; what its callback raises is told, and the caller gets the response as it is, a Trigger's with the reason."""

        def answer(request: Any, response: Any) -> Any:
            try:
                return callback(request, response)
            except Exception as error:
                line = self.faults.tell(error, self.doing(f"a call of {srv_name}"))
                if hasattr(response, "success"):
                    response.success = False
                if hasattr(response, "message"):
                    response.message = line
                return response

        return super().create_service(srv_type, srv_name, answer, **options)

    def create_timer(self, timer_period_sec: float, callback: Callable[[], None], *, clock: Clock = STEADY, **options: Any) -> Timer:
        """Make a timer that goes by the steady clock unless another is given.

        rclpy's own default is the node's clock: a wall clock that is set back an hour would silence the node for that hour, and with
        ``use_sim_time`` a node that the next frame waits for would itself wait for the next frame.
        """
        told = self._telling(callback, f"the timer of {getattr(callback, '__name__', 'a callback').lstrip('_')}")
        return super().create_timer(timer_period_sec, told, clock=clock, **options)

    def create_guard_condition(self, callback: Callable[[], None], **options: Any) -> GuardCondition:
        """Make a guard condition, by which any thread lets the executor's call something; what that raises is told."""
        return super().create_guard_condition(self._telling(callback, "a guard condition"), **options)

    def doing(self, what: str) -> str:
        """Return what this node has handled, and at which room, as a fault's report says it."""
        room = self.at_work()
        return f"{self.get_name()} handled {what}" + (f" at {room}" if room else "")

    def _telling(self, callback: Callable[..., Any], what: str) -> Callable[..., None]:
        """Return a callback that tells what the given one raises; the executor goes on."""

        @functools.wraps(callback)
        def telling(*args: Any) -> None:
            try:
                callback(*args)
            except Exception as error:
                self.faults.tell(error, self.doing(what))

        return telling

    def _look_for_faults(self) -> None:
        """End the process after a fault, if it is one of a run that shall end."""
        if self.faults.count == self._faults_seen:
            return
        self._faults_seen = self.faults.count
        ends = self.has_parameter("exit_when_done") and self.get_parameter("exit_when_done").value is True
        if ends and self.exit_code is None:
            self.exit_code = FAULT_STATUS
            self.fail(self.faults.last)
