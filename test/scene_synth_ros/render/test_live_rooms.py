"""A live camera by the cached integrator over DDS: the next room is made ahead, and frames are those of ``scene_synth render``."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rclpy.context import Context
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process
from sensor_msgs.msg import Image
from std_msgs.msg import String

from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.parameters.render_settings import preset_settings
from scene_synth_ros.messages.conversions import msg_to_image
from scene_synth_ros.suite.qos import latched_qos, stream_qos

LAYERS = ("color", "depth", "normals", "semantic", "instance")
FRAMES, RATE_HZ, SIZE = 6, 15.0, (48, 36)


def room(index: int) -> SceneDescription:
    scene = sample_scene()
    first = scene.camera_path[0]
    x, y, z = first.position_m
    path = tuple(
        replace(first, stamp_ns=10**9 + round((index * FRAMES + frame) * 1e9 / RATE_HZ), position_m=(x + 0.01 * frame, y, z))
        for frame in range(FRAMES)
    )
    return replace(scene, id=f"room-{index}", index=index, camera_path=path)


class Viewer(Peer):
    """Sends rooms and sees every layer."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.images: dict[int, dict[str, Image]] = {}
        self.scene = self.node.create_publisher(String, "scene", latched_qos())
        self.next = self.node.create_publisher(String, "scene/next", latched_qos())
        for layer in LAYERS:
            self.node.create_subscription(Image, f"camera/{layer}/image_raw", lambda m, layer=layer: self.take(layer, m), stream_qos(100))

    def take(self, layer: str, image: Image) -> None:
        self.images.setdefault(image.header.stamp.sec * 10**9 + image.header.stamp.nanosec, {})[layer] = image

    def has_seen(self, scene: SceneDescription, frame: int) -> bool:
        return len(self.images.get(scene.camera_path[frame].stamp_ns, ())) == len(LAYERS)


@pytest.mark.slow
def test_rooms_made_ahead_come_in_order_with_the_pixels_of_the_command(tmp_path: Path) -> None:
    rooms = [room(0), room(1)]
    settings = {"camera.width": SIZE[0], "camera.height": SIZE[1], "realtime": True, "render.auto_exposure": True}
    settings |= {f"render.{name}": value for name, value in preset_settings("realtime").items()}
    with node_process("renderer_node", settings) as context:
        viewer = Viewer(context)
        viewer.meet("renderer_node")
        viewer.scene.publish(String(data=scene_to_json(rooms[0])))
        viewer.spin_until(lambda: viewer.images, 180, "a frame of the first room")
        viewer.next.publish(String(data=scene_to_json(rooms[1])))
        viewer.spin_until(lambda: viewer.has_seen(rooms[0], -1), 120, "the last frame of the first room")
        viewer.scene.publish(String(data=scene_to_json(rooms[1])))
        viewer.spin_until(lambda: viewer.has_seen(rooms[1], -1), 120, "the last frame of the second room")
        viewer.spin_until(lambda: "rooms_made_ahead" in viewer.values, 120, "a report")
    seen = list(viewer.images)
    assert seen == sorted(seen)
    for scene in rooms:
        source, out = tmp_path / f"{scene.id}.json", tmp_path / scene.id
        source.write_text(scene_to_json(scene))
        with pytest.raises(SystemExit) as end:
            main(["render", str(source), "--out", str(out), "--preset", "realtime", "--size", f"{SIZE[0]}x{SIZE[1]}", "--exr", "no"])
        assert not end.value.code
        for index, pose in enumerate(scene.camera_path):
            if pose.stamp_ns in viewer.images:
                with np.load(out / f"frame_{index:04d}.npz") as offline:
                    for layer in LAYERS:
                        np.testing.assert_array_equal(msg_to_image(viewer.images[pose.stamp_ns][layer]), offline[layer], layer)
