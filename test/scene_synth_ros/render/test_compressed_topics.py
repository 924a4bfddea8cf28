"""Compressed images beside the raw ones, live, as readers see them that know the published formats only."""

import io
import json
import struct
from collections.abc import Iterator

import numpy as np
import pytest
from PIL import Image as Picture
from rclpy.context import Context
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from scene_description import scene_to_json
from scene_synth_ros.suite.qos import latched_qos, stream_qos

SETTINGS = {
    "camera.width": 64,
    "camera.height": 48,
    "render.samples_per_pixel": 16,
    "render.tone_curve": "filmic",
    "compressed.depth_max_m": 20.0,
}
FRAMES = len(sample_scene().camera_path)
COLOR = "camera/color/image_raw/compressed"
TRANSPORTS = {"color": "compressed", "depth": "compressedDepth", "semantic": "compressed", "instance": "compressed"}


class Viewer(Peer):
    """Sends rooms, hears images by topic, and what the renderer says it has published."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.heard: dict[str, list[Image | CompressedImage]] = {}
        self.counts: dict[str, int] = {}
        self._scene = self.node.create_publisher(String, "scene", latched_qos())
        self.node.create_subscription(String, "status", self._take_status, latched_qos(100))

    def _take_status(self, message: String) -> None:
        status = json.loads(message.data)
        if status["role"] == "renderer":
            self.counts = status["counts"]

    def listen(self, kind: type, topic: str) -> None:
        self.heard[topic] = []
        self.node.create_subscription(kind, topic, self.heard[topic].append, stream_qos(100))

    def see_a_room(self) -> None:
        self.meet("renderer_node")
        for images in self.heard.values():
            images.clear()
        self._scene.publish(String(data=scene_to_json(sample_scene())))
        self.spin_until(lambda: all(len(images) == FRAMES for images in self.heard.values()), 120, "all images of the path")


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    with node_process("renderer_node", SETTINGS) as context:
        viewer = Viewer(context)
        viewer.listen(CompressedImage, COLOR)
        yield viewer


@pytest.fixture(scope="module")
def pairs(viewer: Viewer) -> dict[str, list[tuple[Image, CompressedImage]]]:
    """Raw and compressed images of the same frames, by layer."""
    for layer, transport in TRANSPORTS.items():
        viewer.listen(Image, f"camera/{layer}/image_raw")
        if layer != "color":
            viewer.listen(CompressedImage, f"camera/{layer}/image_raw/{transport}")
    viewer.see_a_room()
    found = {
        layer: list(zip(viewer.heard[f"camera/{layer}/image_raw"], viewer.heard[f"camera/{layer}/image_raw/{transport}"], strict=True))
        for layer, transport in TRANSPORTS.items()
    }
    assert all(raw.header == compressed.header for of_layer in found.values() for raw, compressed in of_layer)
    return found


def pixels(image: Image) -> np.ndarray:
    kind = {"rgb8": np.uint8, "mono8": np.uint8, "16UC1": np.uint16, "32FC1": np.float32}[image.encoding]
    flat = np.frombuffer(bytes(image.data), kind)
    return flat.reshape(image.height, image.width, 3) if image.encoding == "rgb8" else flat.reshape(image.height, image.width)


def decoded(data: bytes, form: str) -> np.ndarray:
    with Picture.open(io.BytesIO(data)) as picture:
        assert picture.format == form
        return np.asarray(picture)


def test_compressed_colour_alone_is_rendered_and_no_raw_image_published(viewer: Viewer) -> None:
    viewer.see_a_room()
    assert {message.format for message in viewer.heard[COLOR]} == {"rgb8; jpeg compressed bgr8"}
    viewer.spin_until(lambda: viewer.counts.get(f"/synth/{COLOR}", 0) >= FRAMES, 120, "a status with the frames")
    published = {topic for topic, count in viewer.counts.items() if count and "/image" in topic}
    assert published == {f"/synth/{COLOR}"}


def test_colour_is_jpeg_near_the_raw_image(pairs: dict[str, list[tuple[Image, CompressedImage]]]) -> None:
    for raw, compressed in pairs["color"]:
        error = decoded(bytes(compressed.data), "JPEG").astype(float) - pixels(raw)
        assert 10.0 * np.log10(255.0**2 / np.mean(error**2)) > 30.0


@pytest.mark.parametrize(("layer", "encoding"), [("semantic", "mono8"), ("instance", "16UC1")])
def test_ids_are_png_and_lossless(pairs: dict[str, list[tuple[Image, CompressedImage]]], layer: str, encoding: str) -> None:
    for raw, compressed in pairs[layer]:
        assert compressed.format.startswith(f"{encoding}; png compressed ")
        np.testing.assert_array_equal(decoded(bytes(compressed.data), "PNG"), pixels(raw))
    assert len(np.unique(pixels(pairs[layer][0][0]))) > 1


def test_depth_is_within_the_step_of_its_inverse_depth(pairs: dict[str, list[tuple[Image, CompressedImage]]]) -> None:
    for raw, compressed in pairs["depth"]:
        assert compressed.format == "32FC1; compressedDepth png"
        data, depth = bytes(compressed.data), pixels(raw)
        form, a, b = struct.unpack("<iff", data[:12])  # ConfigHeader of compressed_depth_image_transport
        assert (form, a, b) == (0, 100.0 * 101.0, 1.0 - 100.0 * 101.0 / 20.0)
        codes = decoded(data[12:], "PNG").astype(float)
        known = np.isfinite(depth)
        assert known.any() and (codes[known] > 0).all() and (codes[~known] == 0).all()
        assert (np.abs(a / (codes[known] - b) - depth[known]) <= 0.51 * depth[known] ** 2 / a + 1e-6).all()


def test_the_form_of_colour_changes_while_the_node_runs(viewer: Viewer, pairs: dict[str, list[tuple[Image, CompressedImage]]]) -> None:
    assert viewer.set_parameter("renderer_node", "compressed.color", "png")[0]
    viewer.see_a_room()
    for raw, compressed in zip(viewer.heard["camera/color/image_raw"], viewer.heard[COLOR], strict=True):
        assert compressed.format == "rgb8; png compressed bgr8"
        np.testing.assert_array_equal(decoded(bytes(compressed.data), "PNG"), pixels(raw))
