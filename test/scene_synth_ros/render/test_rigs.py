"""Overlays of rigs: they fit, and CameraInfo tells the baseline of the stereo pair."""

from pathlib import Path

import pytest

from grammar.camera.motion_config import MotionConfig
from renderer.body.config import BodyConfig, ImuConfig, WheelsConfig
from renderer.camera.config import CameraConfig, SensorConfig
from renderer.lidar.config import ScanConfig
from renderer.lidar.sweep_config import LidarConfig
from renderer.path.config import RenderConfig
from renderer.sensors.devices import DepthSensorConfig
from scene_description import from_mapping
from scene_description.share import config_path
from scene_synth_ros.cli.parameters.run_profile import load_profile, with_inheritance
from scene_synth_ros.messages.conversions import camera_info_to_msg
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.render.teleop import DriveConfig


def cameras() -> dict[str, CameraConfig]:
    """Node name -> camera of the overlay."""
    nodes = with_inheritance(load_profile(config_path("rigs/stereo.yaml")))
    return {
        name: from_mapping(CameraConfig, {key.removeprefix("camera."): value for key, value in values.items() if key.startswith("camera.")})
        for name, values in nodes.items()
        if name.startswith("renderer_node")
    }


def test_the_right_camera_tells_the_baseline_and_the_left_none() -> None:
    pair = cameras()
    left, right = (camera_info_to_msg(pair[name], 5, "f") for name in ("renderer_node", "renderer_node_right"))
    assert left.p[3] == left.p[7] == right.p[7] == 0.0
    assert -right.p[3] / right.p[0] == pytest.approx(0.12)
    assert list(left.k) == list(right.k) and list(left.d) == list(right.d)


def test_both_have_names_of_their_own_and_one_clock() -> None:
    nodes = with_inheritance(load_profile(config_path("rigs/stereo.yaml")))
    assert nodes["renderer_node"]["streams.camera"] == "left" and nodes["renderer_node_right"]["streams.camera"] == "right"
    assert nodes["renderer_node_right"]["streams.publish_clock"] is False and "streams.publish_clock" not in nodes["renderer_node"]


GROUPS = {
    "renderer_node": {
        **{"camera": CameraConfig, "sensor": SensorConfig, "depth_sensor": DepthSensorConfig, "streams": StreamConfig, "scan": ScanConfig},
        **{"body": BodyConfig, "imu": ImuConfig, "wheels": WheelsConfig, "lidar": LidarConfig, "drive": DriveConfig},
        "render": RenderConfig,  # how a camera exposes and maps tones
    },
    "grammar_node": {"motion": MotionConfig},
}
"""Node -> group of parameters that an overlay of a rig may hold -> its dataclass."""


OVERLAYS = [path for folder in ("rigs", "imus", "lidars", "scanners") for path in sorted(config_path(folder).glob("*.yaml"))]


@pytest.mark.parametrize("path", OVERLAYS, ids=lambda path: path.stem)
def test_overlays_of_rigs_hold_parameters_of_cameras_sensors_streams_and_bodies(path: Path) -> None:
    for name, values in with_inheritance(load_profile(path)).items():
        known = next((groups for node, groups in GROUPS.items() if name.startswith(node)), {})
        ungrouped = {key: value for key, value in values.items() if "." not in key}
        assert ungrouped.keys() <= {"rate_hz"} and (not ungrouped or name == "grammar_node")
        grouped = {key: value for key, value in values.items() if "." in key}
        assert {key.partition(".")[0] for key in grouped} <= known.keys()
        for group, cls in known.items():
            from_mapping(cls, {key.partition(".")[2]: value for key, value in grouped.items() if key.startswith(f"{group}.")})
