"""A mistake of the program while a room is rendered: told with seed and room, counted, and the next room is rendered, or the run ends."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rclpy.context import Context
from rclpy.parameter import Parameter
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, claim_domain, dds_context
from std_msgs.msg import String

from renderer import RenderError
from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.render import rendering, room
from scene_synth_ros.render.renderer_node import RendererNode
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, status_from_json

SETTINGS = {"camera.width": 32, "camera.height": 24, "render.samples_per_pixel": 1}
MISTAKE = "fault of the program while renderer_node rendered room 0 of seed 0: ValueError: operands could not be broadcast together"


class Sender(Peer):
    """Sends rooms to a renderer node in this process and hears its status."""

    def __init__(self, context: Context, **settings: object) -> None:
        super().__init__(context)
        self.status: NodeStatus | None = None
        self.scene = self.node.create_publisher(String, "scene", latched_qos(10))
        self.node.create_subscription(String, "status", self._on_status, latched_qos(9))
        parameters = [Parameter(name, value=value) for name, value in (SETTINGS | settings).items()]
        self.renderer = RendererNode(context=context, namespace="/synth", parameter_overrides=parameters)
        self.spin_too(self.renderer)

    def _on_status(self, message: String) -> None:
        self.status = status_from_json(message.data)

    def send(self, index: int) -> None:
        self.scene.publish(String(data=scene_to_json(replace(sample_scene(), index=index, seed=0))))


@pytest.fixture
def context(monkeypatch: pytest.MonkeyPatch) -> Iterator[Context]:
    right = room.flatten

    def mistaken(scene: SceneDescription, *words: Any) -> Any:
        if scene.index == 0:
            np.zeros(3) + np.zeros(4)
        return right(scene, *words)

    monkeypatch.setattr(room, "flatten", mistaken)
    with dds_context(claim_domain()) as context:
        yield context


def test_the_next_room_is_rendered(context: Context, capfd: pytest.CaptureFixture[str]) -> None:
    peer = Sender(context)
    peer.send(0)
    peer.spin_until(lambda: peer.status and peer.status.refused_scene == 0, 120, "the room that cannot be rendered")
    assert peer.status.reason.startswith(MISTAKE)
    peer.spin_until(lambda: peer.values.get("faults") == "1", 120, "the fault among the diagnostics")
    assert peer.status.state == "ready"
    peer.send(1)
    peer.spin_until(lambda: peer.status.done_scene == 1, 120, "the next room")
    peer.renderer.close()
    assert peer.renderer.exit_code is None
    log = capfd.readouterr().err
    assert log.count("Traceback") == 1 and "in mistaken" in log and MISTAKE in log


def test_a_run_that_shall_end_ends_with_the_reason(context: Context) -> None:
    peer = Sender(context, exit_when_done=True)
    peer.send(0)
    peer.spin_until(lambda: peer.renderer.exit_code is not None, 120, "the end")
    peer.spin_until(lambda: peer.status.state == "failed", 120, "the reason")
    peer.renderer.close()
    assert peer.renderer.exit_code == 70 and peer.status.reason.startswith(MISTAKE)


@pytest.mark.parametrize(("error", "code"), [(RenderError("Embree is missing"), 1), (ZeroDivisionError("a mistake"), 70)])
def test_a_thread_that_ends_is_noticed(context: Context, monkeypatch: pytest.MonkeyPatch, error: Exception, code: int) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(rendering, "warm_up", fail)
    peer = Sender(context)
    peer.spin_until(lambda: peer.renderer.exit_code is not None, 120, "the end")
    peer.spin_until(lambda: peer.status and peer.status.state == "failed", 120, "the reason")
    peer.renderer.close()
    assert peer.renderer.exit_code == code and str(error) in peer.status.reason
