"""What the nodes of the suite have in common: they are managed (lifecycle) nodes that start by themselves unless told otherwise.

| transition | what happens |
|---|---|
| configure | publishers, subscriptions, services and threads are made |
| activate | the node works: rooms go out, frames are rendered, messages are recorded |
| deactivate | it pauses after what it has in hand; everything stays connected |
| cleanup | everything made by *configure* is taken down; parameters stay |
| shutdown | the process ends; before its run is over with status 1 |
"""

import functools
import math
import os
import time
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.guard_condition import GuardCondition
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_msgs.msg import String
from std_srvs.srv import Trigger

from scene_description import FieldError, SceneSynthError, error_line
from scene_synth_ros.suite.environment import RUN, SUPERVISED
from scene_synth_ros.suite.faults import FAULT_STATUS, Faults
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.rclpy_internals import RCL_ERRORS, ChangeState, wrap_change_state
from scene_synth_ros.suite.status import NodeStatus, status_from_json

STEADY = Clock(clock_type=ClockType.STEADY_TIME)
"""Goes on evenly whatever becomes of wall clock and ``/clock``; timers, timeouts and throttled lines go by it."""


_STRANGER = "is in this namespace, but no renderer of this run: its frames are left out; end it, or run in another namespace"
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
REFUSALS = (
    OSError,
    SceneSynthError,
    ParameterException,
    NameValidationException,
    *RCL_ERRORS,
)
"""What making a node's parts raises for bad input: one line.  The last six are rclpy's, for words that are no ROS arguments or names."""


def serve_trigger(node: Node, name: str, work: Callable[[], str]) -> None:
    """Make a service ``~/name`` (std_srvs/Trigger).

    It answers with what ``work`` returns or, without success, with the line of a SceneSynthError that it raises to refuse.
    """

    def answer(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            response.message, response.success = work(), True
        except SceneSynthError as error:
            response.message = str(error)
        return response

    node.create_service(Trigger, f"~/{name}", answer)


class SuiteNode(LifecycleNode):  # type: ignore[misc]
    """A managed node none of whose callbacks can lose what it raises.

    Subclasses declare parameters in ``__init__``, then call :meth:`begin`, and fill in :meth:`open`, :meth:`resume`, :meth:`pause`,
    :meth:`close`, :meth:`fail` and :meth:`at_work`.  What a callback raises beyond what a user can cause is a fault of the program: it is
    logged with its traceback and counted in ``/diagnostics``, and the node goes on; with the parameter ``exit_when_done`` it tells its
    peers and ends with ``FAULT_STATUS``.

    Threading: callbacks, transitions and :meth:`fail` run in the executor's thread; any may use ``faults``, :meth:`warn`, :meth:`refuse`.

    Attributes:
        active: whether it is in the state *active*.
        exit_code: None while the node runs; what its process shall end with.
        leaving: whether somebody has ended the node.
        token: of the command or launch that has started it, empty where it was started by itself.
        strangers: renderers in the namespace that belong to no run of this node's.
        faults: the faults of the program that have come up in this node.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.active = False
        self.exit_code: int | None = None
        self.leaving = False
        self.token, self.strangers = os.environ.get(RUN, ""), set[str]()
        self.faults = Faults(lambda text: self.get_logger().error(text))
        self._faults_seen = 0
        self._warning, self._warned_s = "", 0.0
        self._refusal: Exception | None = None
        self._before: set[Any] = set()
        self.create_timer(0.5, self._look_for_faults)
        wrap_change_state(self, self._refusing_transitions)

    def open(self) -> None:
        """Make everything beyond parameters (*configure*).

        Raises:
            OSError, SceneSynthError: it cannot be made; one line.
        """

    def close(self) -> None:
        """Free what :meth:`open` has made beyond ROS entities (*cleanup*, end of the process); harmless when repeated."""

    def resume(self) -> None:
        """Begin or go on to work (*activate*).

        Raises:
            OSError, SceneSynthError: it cannot; one line.
        """

    def pause(self) -> None:
        """Stop working (*deactivate*)."""

    def begin(self, autostart: bool) -> None:
        """Configure and activate, if the node shall start by itself.

        Raises:
            OSError, SceneSynthError: as :meth:`open` and :meth:`resume`.
        """
        for trigger in (self.trigger_configure, self.trigger_activate) if autostart else ():
            if trigger() == SUCCESS:
                continue
            if self._refusal is not None:
                raise self._refusal
            self.exit_code = FAULT_STATUS
            return

    def fail(self, reason: str) -> None:
        """Tell the peers that the node has failed; its process ends next."""

    def leave(self, how: str) -> None:
        """Take that somebody ends the node; where its run shall end by itself, tell the peers, who would wait for it for ever.

        Args:
            how: it is ended, as ``ended by SIGTERM``; empty where somebody watches the nodes and ends the run.
        """
        self.leaving = True
        if how and self._ends_with_run:
            reason = f"{how} before the run was over"
            self.get_logger().warning(reason)
            self.fail(reason)

    @property
    def _ends_with_run(self) -> bool:
        """Whether the node ends by itself when its run is over."""
        return self.has_parameter("exit_when_done") and self.get_parameter("exit_when_done").value is True

    def at_work(self) -> str:
        """Return the room at work, with its seed, as a fault's report names it; empty if there is none."""
        return ""

    def warn(self, text: str) -> None:
        """Log a warning, one a second at most, and keep it for ``/diagnostics``."""
        self._warning, self._warned_s = text, time.monotonic()
        self.get_logger().warning(text, throttle_duration_sec=1.0, throttle_time_source_type=STEADY)

    def warn_once(self, text: str) -> None:
        """Log a warning that is said once only, whatever else is said in that second, and keep it for ``/diagnostics``."""
        self._warning, self._warned_s = text, time.monotonic()
        self.get_logger().warning(text)

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
        telling = self._telling(callback, f"the timer of {getattr(callback, '__name__', 'a callback').lstrip('_')}")
        return super().create_timer(timer_period_sec, telling, clock=clock, **options)

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
        if self._ends_with_run and self.exit_code is None:
            self.exit_code = FAULT_STATUS
            self.fail(self.faults.last)

    def hear_status(self, take: Callable[[NodeStatus], None], complain: Callable[[str], None]) -> None:
        """Subscribe to ``status``; one that does not fit is left out, and ``complain`` called with a line.

        So are, with a line for each, renderers that the command or launch of this node has not started: it waits for its own alone.
        """

        def on_message(message: String) -> None:
            try:
                status = status_from_json(message.data)
            except FieldError as error:
                complain(f"ignored a status that does not fit: {error}")
                return
            if status.role != "renderer" or self.token in ("", status.token):
                take(status)
            elif status.node not in self.strangers:
                self.strangers.add(status.node)
                self.warn_once(f"{status.node} {_STRANGER}")

        self.create_subscription(String, "status", on_message, latched_qos(100))

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the node's parts."""
        self._before = self._entities()
        code = self._try(self.open)
        if code != SUCCESS:
            self._take_down()
        return code

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the node work."""
        code = self._try(self.resume)
        self.active = code == SUCCESS
        return code

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Pause the node."""
        self.active = False
        return self._try(self.pause)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take down what *configure* has made."""
        self._try(self.close)
        self._take_down()
        return SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the process."""
        self.active = False
        if self.exit_code is None:
            self.leave("shut down")
            self.exit_code = int(self._ends_with_run or SUPERVISED in os.environ)
        return SUCCESS

    def _try(self, step: Callable[[], None]) -> TransitionCallbackReturn:
        self._refusal = None
        try:
            step()
        except REFUSALS as error:
            self._refusal = error
            self.get_logger().error(error_line(error))
            return FAILURE
        except Exception as error:  # rclpy would drop it
            self.faults.tell(error, self.doing(f"the transition {step.__name__}"))
            return FAILURE
        return SUCCESS

    def _entities(self) -> set[Any]:
        return {*self.publishers, *self.subscriptions, *self.timers, *self.services, *self.clients}

    def _take_down(self) -> None:
        """Destroy the ROS entities that were made since *configure* began."""
        destroy = (
            (self.publishers, self.destroy_publisher),
            (self.subscriptions, self.destroy_subscription),
            (self.timers, self.destroy_timer),
            (self.services, self.destroy_service),
            (self.clients, self.destroy_client),
        )
        for entities, remove in destroy:
            for entity in [entity for entity in entities if entity not in self._before]:
                remove(entity)

    def _refusing_transitions(self, change_state: ChangeState) -> ChangeState:
        """Return the service callback with transitions that the state does not allow answered by ``success: false``."""

        def changed(request: Any, response: Any) -> Any:
            try:
                return change_state(request, response)
            except RuntimeError as error:  # rclpy lets rcl's refusal out, which would end the process of whoever is asked
                self.get_logger().warning(f"transition refused: {' '.join(str(error).split())[:200]}")
                response.success = False
                return response

        return changed
