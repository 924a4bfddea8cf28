"""What the nodes of the suite have in common: they are managed (lifecycle) nodes that start by themselves unless told otherwise.

| transition | what happens |
|---|---|
| configure | publishers, subscriptions, services and threads are made |
| activate | the node works: rooms go out, frames are rendered, messages are recorded |
| deactivate | it pauses after what it has in hand; everything stays connected |
| cleanup | everything made by *configure* is taken down; parameters stay |
| shutdown | the process ends, as after SIGTERM |
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from scene_description import SceneSynthError, error_line
from scene_synth_ros.suite.faults import FAULT_STATUS
from scene_synth_ros.suite.guarded_node import STEADY as STEADY
from scene_synth_ros.suite.guarded_node import GuardedNode

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
REFUSALS = (
    OSError,
    SceneSynthError,
    ParameterException,
    NameValidationException,
    rclpy_implementation.RCLError,
    rclpy_implementation.RCUtilsError,
    rclpy_implementation.RMWError,
    rclpy_implementation.UnknownROSArgsError,
)
"""What making a node's parts raises for bad input: one line.  The last six are rclpy's, for words that are no ROS arguments or names."""


class SuiteNode(GuardedNode):
    """A managed node; subclasses declare parameters in ``__init__``, then call :meth:`begin`, and fill in the methods below.

    Threading: transitions run in the executor's thread.

    Attributes:
        active: whether it is in the state *active*.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.active = False
        self._refusal: Exception | None = None
        self._before: set[Any] = set()
        service = self._service_change_state
        service.callback = self._refusing_transitions(service.callback)

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
        self.exit_code = self.exit_code or 0
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

    def _refusing_transitions(self, change_state: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """Return the service callback with transitions that the state does not allow answered by ``success: false``."""

        def changed(request: Any, response: Any) -> Any:
            try:
                return change_state(request, response)
            except RuntimeError as error:  # rclpy lets rcl's refusal out, which would end the process of whoever is asked
                self.get_logger().warning(f"transition refused: {' '.join(str(error).split())[:200]}")
                response.success = False
                return response

        return changed
