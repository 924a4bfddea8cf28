"""The services of simulation_interfaces, where that package is, and the same as JSON on topics and as std_srvs/Trigger everywhere."""

import importlib
import json
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.service import Service
from std_msgs.msg import String
from std_srvs.srv import Trigger

from scene_description.strict import shorten
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.simulation.run import DONE, FAILED, PAUSED, PLAYING, STOPPED, Answer, Later, Run, result
from scene_synth_ros.simulation.simulation import SERVICES, again, serve
from scene_synth_ros.suite.qos import stream_qos
from scene_synth_ros.suite.rclpy_internals import LateAnswer

PACKAGE = "simulation_interfaces"
REQUEST, RESPONSE = "simulation/request", "simulation/response"
"""Topics of JSON: ``{"service", "id", "request"}``, answered by ``{"service", "id", "response"}``."""
MOST_TEXT, MOST_WAITING, DEPTH = 21_000_000, 100, 10
TRIGGERS: dict[str, tuple[str, Mapping[str, Any]]] = {
    "play": ("set_simulation_state", {"state": {"state": PLAYING}}),
    "hold": ("set_simulation_state", {"state": {"state": PAUSED}}),
    "stop": ("set_simulation_state", {"state": {"state": STOPPED}}),
    "step": ("step_simulation", {"steps": 1}),
}
"""Name of a std_srvs/Trigger below the node -> service, and its request."""


class _Waiting(NamedTuple):
    later: Later
    is_due: Callable[[], bool]
    send: Callable[[Answer], None]


class SimulationServices:
    """Makes the services of a node that steers a run; call :meth:`look` often, so that answers that had to wait go out.

    Threading: the executor's thread.
    """

    def __init__(self, node: Node, run: Run) -> None:
        self._run = run
        self._waiting: list[_Waiting] = []
        self._responses = node.create_publisher(String, RESPONSE, stream_qos(DEPTH))
        node.create_subscription(String, REQUEST, lambda message: self._on_text(message.data), stream_qos(DEPTH))
        for name, (service, request) in TRIGGERS.items():
            self._add(node, Trigger, f"~/{name}", service, partial(_fixed, request), _fill_trigger)
        for name in SERVICES:
            kind = service_class(name)
            if kind is not None:
                self._add(node, kind, name, name, to_plain, fill)

    def look(self) -> None:
        """Send the answers that are there now."""
        waiting, self._waiting = self._waiting, []
        for one in waiting:
            answer = again(one.later) if one.is_due() else None
            if answer is None:
                self._waiting.append(one)
            else:
                one.send(answer)

    def _add(
        self,
        node: Node,
        kind: Any,
        topic: str,
        name: str,
        read: Callable[[Any], Mapping[str, Any]],
        write: Callable[[Any, Answer], None],
    ) -> None:
        made: list[Service] = []

        def answer(request: Any, response: Any) -> Any:
            write(response, result(FAILED, "a fault of the program, which the node's log tells"))  # stays, if that comes up
            found = self._answer(name, read(request))
            if not isinstance(found, Later):
                write(response, found)
                return response
            late = LateAnswer(made[0])

            def send(values: Answer) -> None:
                write(response, values)
                late.send(response)

            self._waiting.append(_Waiting(found, lambda: late.is_due, send))
            return late

        made.append(node.create_service(kind, topic, answer))

    def _answer(self, name: str, request: Mapping[str, Any]) -> Answer | Later:
        """Return what a service answers, at once if it is there."""
        if len(self._waiting) >= MOST_WAITING:
            return result(FAILED, f"{MOST_WAITING} requests wait for their answers; ask again")
        found = serve(self._run, name, request)
        return (again(found) or found) if isinstance(found, Later) else found

    def _on_text(self, text: str) -> None:
        """Answer a request in JSON; a text that is none is answered without a service."""
        service, identifier = "", None  # type: str, int | str | None
        try:
            if len(text) > MOST_TEXT:
                raise ValueError(f"expected at most {MOST_TEXT} characters, got {len(text)}")
            asked = json.loads(text)
            if not isinstance(asked, dict) or not isinstance(asked.get("request", {}), dict):
                raise ValueError(f'expected {{"service", "id", "request"}}, got {shorten(asked)}')
            service, told = str(asked.get("service"))[:100], asked.get("id")
            identifier = told if isinstance(told, int) else str(told)[:100] if told is not None else None
            if service not in SERVICES:
                raise ValueError(f"service: expected one of {', '.join(SERVICES)}, got '{service}'")
            found = self._answer(service, asked.get("request", {}))
        except (ValueError, RecursionError) as error:
            found = result(FAILED, f"{REQUEST}: {' '.join(str(error).split())[:500]}")

        def send(response: Answer) -> None:
            self._responses.publish(String(data=json.dumps({"service": service, "id": identifier, "response": response})))

        if isinstance(found, Later):
            self._waiting.append(_Waiting(found, lambda: True, send))
        else:
            send(found)


def service_class(name: str) -> Any:
    """Return the class of a service by its name in snake case; None where the package, or its version, lacks it."""
    try:
        package = importlib.import_module(f"{PACKAGE}.srv")
    except ImportError:
        return None
    return getattr(package, "".join(word.capitalize() for word in name.split("_")), None)


def _fixed(request: Mapping[str, Any], _message: object) -> Mapping[str, Any]:
    return request


def to_plain(message: Any) -> Any:
    """Return a message as mappings, tuples and plain values."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: to_plain(getattr(message, name)) for name in message.get_fields_and_field_types()}
    if isinstance(message, (str, bytes, int, float)):
        return message
    return tuple(to_plain(one) for one in message)


def fill(message: Any, values: Mapping[str, Any]) -> None:
    """Set the fields of a message that a mapping has; what the message lacks in this version of its package is left out."""
    for name, type_name in message.get_fields_and_field_types().items():
        if name not in values:
            continue
        value = values[name]
        if isinstance(value, Mapping):
            fill(getattr(message, name), value)
        elif type_name.startswith("sequence<") and "/" in type_name:
            package, _, kind = type_name.removeprefix("sequence<").removesuffix(">").partition("/")
            setattr(message, name, [_filled(message_class(f"{package}/msg/{kind}")(), one) for one in value])
        else:
            setattr(message, name, value)


def _filled(message: Any, values: Mapping[str, Any]) -> Any:
    fill(message, values)
    return message


def _fill_trigger(response: Any, values: Answer) -> None:
    response.success, response.message = values["result"]["result"] == DONE, values["result"]["error_message"]
