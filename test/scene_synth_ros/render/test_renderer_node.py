"""A renderer node in its own process: refuses what is no scene, goes on, renders what is one, and changes while it runs."""

import json
from collections.abc import Iterator
from dataclasses import replace

import pytest
from rclpy.context import Context
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from scene_description import scene_to_json
from scene_synth_ros.suite.qos import latched_qos, stream_qos

SETTINGS = {"camera.width": 64, "camera.height": 48, "render.samples_per_pixel": 1}


class GrammarPeer(Peer):
    """Sends scenes and hears images."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.images: list[Image] = []
        self._scene = self.node.create_publisher(String, "scene", latched_qos())

    def listen(self) -> None:
        self.node.create_subscription(Image, "camera/color/image_raw", self.images.append, stream_qos())

    def send(self, text: str) -> None:
        self._scene.publish(String(data=text))


@pytest.fixture(scope="module")
def peer() -> Iterator[GrammarPeer]:
    with node_process("renderer_node", SETTINGS) as context:
        peer = GrammarPeer(context)
        peer.listen()
        peer.meet("renderer_node")
        peer.send(scene_to_json(sample_scene()))
        peer.spin_until(lambda: len(peer.images) == len(sample_scene().camera_path), 120, "the images of the first room")
        yield peer


def test_camera_info_and_labels_come_to_who_subscribes_to_nothing_else(peer: GrammarPeer) -> None:
    heard: dict[str, list[object]] = {"depth/camera_info": [], "semantic/labels": []}
    for topic, kind in (("depth/camera_info", CameraInfo), ("semantic/labels", String)):
        peer.node.create_subscription(kind, f"camera/{topic}", heard[topic].append, stream_qos(100))
    peer.meet("renderer_node")
    peer.images.clear()
    peer.send(scene_to_json(sample_scene()))
    frames = len(sample_scene().camera_path)
    peer.spin_until(lambda: heard["semantic/labels"], 120, "labels")
    peer.spin_until(lambda: len(peer.images) == frames, 120, "the images of the path")
    peer.spin_until(lambda: len(heard["depth/camera_info"]) == frames, 120, "as many camera infos, which come on a topic of their own")
    peer.spin_until(lambda: peer.values.get("layers") == "color", 120, "a report that no pixel of the others is rendered")


def test_a_rate_that_cannot_be_held_is_told_with_the_setting_that_would(peer: GrammarPeer) -> None:
    pose = sample_scene().camera_path[0]
    path = tuple(replace(pose, stamp_ns=10**12 + k * 1_000_000) for k in range(3000))
    assert peer.set_parameter("renderer_node", "realtime", True)[0]
    peer.send(scene_to_json(replace(sample_scene(), index=77, camera_path=path)))
    peer.spin_until(lambda: any("1000 Hz asked for" in line for line in peer.warnings), 120, "a warning")
    line = next(line for line in peer.warnings if "asked for" in line)
    assert "color" in line and "grammar_node rate_hz" in line
    assert peer.values["rate_wanted_hz"] == "1000" and 0.0 < float(peer.values["rate_held_hz"]) < 1000.0
    assert peer.set_parameter("renderer_node", "realtime", False)[0]


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
def test_what_is_no_scene_is_refused_with_a_diagnostic_and_the_node_goes_on(peer: GrammarPeer, name: str) -> None:
    text, reason = bad_scenes()[name]
    peer.send(text)
    peer.spin_until(lambda: any(reason in error for error in peer.errors), 120, f"a diagnostic that says {reason}")
    peer.images.clear()
    peer.send(scene_to_json(replace(sample_scene(), id=f"after-{name.replace(' ', '-')}")))
    peer.spin_until(lambda: peer.images, 120, "an image after the bad scene")


def test_exposure_changes_while_it_runs(peer: GrammarPeer) -> None:
    def mean_after(ev100: float, second: int) -> float:
        """Set the exposure, send a scene of one view at a time of its own, and return the mean of that view's image."""
        assert peer.set_parameter("renderer_node", "render.exposure_ev100", ev100) == (True, "")
        scene = sample_scene()
        peer.send(scene_to_json(replace(scene, camera_path=(replace(scene.camera_path[0], stamp_ns=second * 10**9),))))
        peer.spin_until(lambda: any(image.header.stamp.sec == second for image in peer.images), 120, "its image")
        (image,) = (image for image in peer.images if image.header.stamp.sec == second)
        return sum(image.data) / len(image.data)

    dark, bright = mean_after(9.0, 1000), mean_after(5.0, 2000)
    assert bright > dark + 10.0


def test_what_cannot_change_says_why(peer: GrammarPeer) -> None:
    successful, reason = peer.set_parameter("renderer_node", "camera.width", 128)
    assert not successful
    assert "camera.width cannot change in a running node: image size decides buffers" in reason
