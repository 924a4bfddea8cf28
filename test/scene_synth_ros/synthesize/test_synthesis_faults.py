"""A mistake of the program while a room is synthesised: told with seed and room, counted, and the run goes on, or ends with the reason."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rclpy.context import Context
from rclpy.parameter import Parameter
from scene_synth_ros_suite import Peer, claim_domain, dds_context
from std_msgs.msg import String

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, scene_from_json
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json
from scene_synth_ros.synthesize.grammar_node import GrammarNode

SETTINGS = {"seed": 3, "rooms": 3, "frames_per_room": 2, "rate_hz": 10.0, "lock_step": False}
MISTAKE = "fault of the program while room 1 of seed 3 was prepared: ValueError: operands could not be broadcast together"


@pytest.fixture
def context(monkeypatch: pytest.MonkeyPatch) -> Iterator[Context]:
    right = SceneSynthesizer.synthesize_with_cost

    def mistaken(self: SceneSynthesizer, request: Any, seed: int, index: int, times: Any) -> Any:
        if index == 1:
            np.zeros(3) + np.zeros(4)
        return right(self, request, seed, index, times)

    monkeypatch.setattr(SceneSynthesizer, "synthesize_with_cost", mistaken)
    with dds_context(claim_domain()) as context:
        yield context


class Listener(Peer):
    """Hears the rooms and the status of a grammar node in this process."""

    def __init__(self, context: Context, **settings: object) -> None:
        super().__init__(context)
        self.scenes: list[SceneDescription] = []
        self.statuses: list[NodeStatus] = []
        self.node.create_subscription(String, "scene", lambda message: self.scenes.append(scene_from_json(message.data)), latched_qos(10))
        self.node.create_subscription(
            String, "status", lambda message: self.statuses.append(status_from_json(message.data)), latched_qos(9)
        )
        parameters = [Parameter(name, value=value) for name, value in (SETTINGS | settings).items()]
        self.grammar = GrammarNode(context=context, namespace="/synth", parameter_overrides=parameters)
        self.spin_too(self.grammar)


def test_the_run_goes_on_without_the_room(context: Context, capfd: pytest.CaptureFixture[str]) -> None:
    peer = Listener(context)
    peer.spin_until(lambda: len(peer.scenes) == 2, 120, "the rooms before and after")
    peer.spin_until(lambda: peer.values.get("faults") == "1", 120, "the fault among the diagnostics")
    peer.grammar.close()
    assert [scene.index for scene in peer.scenes] == [0, 2]
    assert [scene.camera_path[0].stamp_ns for scene in peer.scenes] == [1_000_000_000, 1_400_000_000], "its time stays empty"
    assert peer.values["last_fault"].startswith(MISTAKE)
    log = capfd.readouterr().err
    assert log.count("Traceback") == 1 and "in mistaken" in log and MISTAKE in log


def test_a_run_that_shall_end_ends_with_the_reason(context: Context) -> None:
    peer = Listener(context, exit_when_done=True)
    peer.spin_until(lambda: peer.grammar.exit_code is not None, 120, "the end")
    peer.spin_until(lambda: peer.statuses[-1].state == "failed", 120, "the reason")
    peer.grammar.close()
    assert peer.grammar.exit_code == 70
    assert peer.statuses[-1].reason.startswith(MISTAKE)
