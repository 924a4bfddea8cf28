"""The JSON topic of a steered run: every text is answered with one line, whatever it is; what waits is answered later."""

from __future__ import annotations

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from scene_synth_ros.simulation.services import MOST_WAITING, SimulationServices


class Node:
    """Takes what is made, without ROS."""

    def __init__(self) -> None:
        self.said: list[dict[str, Any]] = []
        self.ask: Callable[[Any], None] = lambda _: None

    def create_publisher(self, *_: Any) -> Any:
        return SimpleNamespace(publish=lambda message: self.said.append(json.loads(message.data)))

    def create_subscription(self, _kind: Any, _topic: str, callback: Callable[[Any], None], _qos: Any) -> None:
        self.ask = callback

    def create_service(self, *_: Any) -> Any:
        return SimpleNamespace()

    def answers(self, text: str) -> list[dict[str, Any]]:
        """Ask; return what is said at once."""
        self.said.clear()
        self.ask(SimpleNamespace(data=text))
        return self.said


class Run:
    """A paused run whose frames are shown when the test says so."""

    phase, shown = "paused", False

    def can_hold(self) -> str:
        return ""

    def let_out(self, frames: int) -> Callable[[], bool]:
        return lambda: self.shown


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "3",
        '{"service": 3}',
        '{"service": "get_entities", "request": []}',
        "[" * 100_000,
        '{"service": "step_simulation"',
        '"\\ud800"',
    ],
)
def test_what_is_no_request_is_told(text: str) -> None:
    node = Node()
    SimulationServices(node, Run())  # type: ignore[arg-type]
    (answer,) = node.answers(text)
    result = answer["response"]["result"]
    assert result["result"] == 4 and result["error_message"].startswith("simulation/request") and "\n" not in result["error_message"]


def test_an_answer_that_waits_comes_when_it_is_there_and_too_many_are_refused() -> None:
    node, run = Node(), Run()
    services = SimulationServices(node, run)  # type: ignore[arg-type]
    for number in range(MOST_WAITING):
        assert node.answers(json.dumps({"service": "step_simulation", "id": number, "request": {"steps": 2}})) == []
    (refused,) = node.answers('{"service": "step_simulation", "id": "x", "request": {}}')
    assert refused["id"] == "x" and "wait" in refused["response"]["result"]["error_message"]
    node.said.clear()
    services.look()
    assert node.said == []
    run.shown = True
    services.look()
    assert [answer["id"] for answer in node.said] == list(range(MOST_WAITING))
    assert all(answer["response"]["result"]["result"] == 1 for answer in node.said)
