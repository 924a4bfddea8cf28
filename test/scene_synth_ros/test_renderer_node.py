"""A renderer node in its own process: refuses what is no scene, goes on, renders what is one, and changes while it runs."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sample_scene import sample_scene
from scene_synth_ros_suite import environment, stop
from sensor_msgs.msg import Image
from std_msgs.msg import String

from scene_description import scene_to_json
from scene_synth_ros.qos import latched_qos, stream_qos


class Peer:
    """The test's own node: sends scenes, hears images and diagnostics."""

    def __init__(self, context: Context) -> None:
        self.node = Node("test_peer", namespace="/synth", context=context)
        self.images: list[Image] = []
        self.errors: list[str] = []
        self._scene = self.node.create_publisher(String, "scene", latched_qos())
        self.node.create_subscription(Image, "camera/color/image_raw", self.images.append, stream_qos())
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self._set = self.node.create_client(SetParameters, "renderer_node/set_parameters")
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.errors += [status.message for status in message.status if status.level == DiagnosticStatus.ERROR]

    def send(self, text: str) -> None:
        self._scene.publish(String(data=text))

    def spin_until(self, condition: Callable[[], object], timeout_s: float, what: str) -> None:
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, f"waited {timeout_s} s for {what}"
            self._executor.spin_once(timeout_sec=0.05)

    def set_parameter(self, name: str, value: object) -> tuple[bool, str]:
        self.spin_until(self._set.service_is_ready, 10, "the parameter service")
        future = self._set.call_async(SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()]))
        self.spin_until(future.done, 10, "the answer")
        (result,) = future.result().results
        return result.successful, result.reason


@pytest.fixture(scope="module")
def peer() -> Iterator[Peer]:
    env = environment()
    words = [sys.executable, "-m", "scene_synth_ros.renderer_node", "--ros-args", "-r", "__ns:=/synth"]
    settings = {"camera.width": 64, "camera.height": 48, "render.samples_per_pixel": 1}
    words += [word for name, value in settings.items() for word in ("-p", f"{name}:={value}")]
    process = subprocess.Popen(words, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    context = Context()
    before = os.environ.get("ROS_DOMAIN_ID")
    os.environ["ROS_DOMAIN_ID"] = env["ROS_DOMAIN_ID"]
    try:
        rclpy.init(context=context)
        peer = Peer(context)
        peer.send(scene_to_json(sample_scene()))
        peer.spin_until(lambda: peer.images, 90, "the first image")
        yield peer
        assert process.poll() is None, "the renderer must have survived everything"
    finally:
        stop(process)
        rclpy.try_shutdown(context=context)
        os.environ.pop("ROS_DOMAIN_ID")
        if before is not None:
            os.environ["ROS_DOMAIN_ID"] = before


def bad_scenes() -> dict[str, tuple[str, str]]:
    scene = json.loads(scene_to_json(sample_scene()))
    first = scene["objects"][0]
    return {
        "no JSON": ("{]", "expected JSON"),
        "truncated": (json.dumps(scene)[:-200], "expected JSON"),
        "another version": (json.dumps({**scene, "schema": "scene_synth/9"}), "schema: expected 'scene_synth/1', got 'scene_synth/9'"),
        "a million objects": (
            json.dumps({**scene, "objects": []}).replace('"objects": []', '"objects": [' + ",".join(["0"] * 1_000_000) + "]"),
            "objects: expected at most 1000 items, got 1000000",
        ),
        "NaN": (json.dumps(scene).replace(str(first["position_m"][0]), "NaN", 1), "expected finite numbers, got NaN"),
        "outside the catalogue": (
            json.dumps({**scene, "objects": [{**first, "model": {"file": "../../etc/passwd"}}]}),
            "objects[0].model.file: expected a relative path inside the catalogue",
        ),
    }


@pytest.mark.parametrize("name", bad_scenes())
def test_what_is_no_scene_is_refused_with_a_diagnostic_and_the_node_goes_on(peer: Peer, name: str) -> None:
    text, reason = bad_scenes()[name]
    peer.send(text)
    peer.spin_until(lambda: any(reason in error for error in peer.errors), 10, f"a diagnostic that says {reason}")
    peer.images.clear()
    peer.send(scene_to_json(replace(sample_scene(), id=f"after-{name.replace(' ', '-')}")))
    peer.spin_until(lambda: peer.images, 20, "an image after the bad scene")


def test_exposure_changes_while_it_runs(peer: Peer) -> None:
    def mean_after(ev100: float) -> float:
        assert peer.set_parameter("render.exposure_ev100", ev100) == (True, "")
        peer.images.clear()
        peer.send(scene_to_json(sample_scene()))
        peer.spin_until(lambda: peer.images, 20, "an image")
        return sum(peer.images[0].data) / len(peer.images[0].data)

    dark, bright = mean_after(9.0), mean_after(5.0)
    assert bright > dark + 10.0


def test_what_cannot_change_says_why(peer: Peer) -> None:
    successful, reason = peer.set_parameter("camera.width", 128)
    assert not successful
    assert "camera.width cannot change in a running node: image size decides buffers" in reason
