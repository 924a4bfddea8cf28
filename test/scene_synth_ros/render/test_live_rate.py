"""A live camera that cannot hold its rate says so within seconds, with the setting that would, over DDS."""

from dataclasses import replace

from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process
from sensor_msgs.msg import Image
from std_msgs.msg import String

from scene_description import scene_to_json
from scene_synth_ros.suite.qos import latched_qos, stream_qos

SETTINGS = {"realtime": True, "camera.width": 192, "camera.height": 144, "render.samples_per_pixel": 16, "render.auto_exposure": False}


def test_a_rate_that_cannot_be_held_is_told_with_the_setting_that_would() -> None:
    scene = sample_scene()
    first = scene.camera_path[0]
    fast = replace(scene, camera_path=tuple(replace(first, stamp_ns=first.stamp_ns + index * 1_000_000) for index in range(4000)))
    with node_process("renderer_node", SETTINGS) as context:
        peer, frames = Peer(context), []
        peer.node.create_subscription(Image, "camera/color/image_raw", frames.append, stream_qos())
        peer.node.create_publisher(String, "scene", latched_qos()).publish(String(data=scene_to_json(fast)))
        peer.spin_until(lambda: frames, 120, "the first frame")
        peer.spin_until(lambda: any("1000 Hz asked for" in line for line in peer.warnings), 10, "the warning that the rate is not held")
        (line,) = {line for line in peer.warnings if "asked for" in line}
        assert line.startswith("color: ") and "grammar_node rate_hz" in line
        assert peer.values["rate_wanted_hz"] == "1000" and 0.0 < float(peer.values["rate_held_hz"]) < 1000.0
        assert not peer.errors
