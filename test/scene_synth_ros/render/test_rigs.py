"""Overlays of rigs: they fit, CameraInfo tells the baseline of the stereo pair, and the drone moves as EuRoC's did."""

from pathlib import Path

import numpy as np
import pytest

from grammar.camera.camera_path import CameraSpace, CameraTimes
from grammar.camera.motion_config import MotionConfig
from grammar.camera.motions import sample_motion
from grammar.camera.path_config import read_camera_path_config
from renderer.body.config import BodyConfig, ImuConfig, WheelsConfig
from renderer.camera.config import CameraConfig, SensorConfig
from renderer.lidar.config import ScanConfig
from renderer.lidar.sweep_config import LidarConfig
from renderer.path.config import RenderConfig
from renderer.sensors.devices import DepthSensorConfig
from scene_description import from_mapping
from scene_description.kinematics import kinematics
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


@pytest.mark.parametrize("seed", range(4))
def test_the_drone_turns_and_accelerates_as_those_of_euroc(seed: int) -> None:
    values = with_inheritance(load_profile(config_path("rigs/euroc_stereo.yaml")))["grammar_node"]
    config = from_mapping(MotionConfig, {key.removeprefix("motion."): value for key, value in values.items() if key.startswith("motion.")})
    space = CameraSpace(((0.0, 0.0), (4.2, 0.0), (4.2, 3.6), (0.0, 3.6)), 2.6, np.zeros((0, 8)))
    walk, times = read_camera_path_config(config_path("camera.yaml")), CameraTimes(frames=401, start_ns=0, rate_hz=20.0)
    _, motion = sample_motion(np.random.default_rng(seed), config, walk, space, times)
    assert motion is not None
    moved = kinematics(motion, np.arange(5.0, 20.0, 0.005))
    rate, acceleration = (np.linalg.norm(values, axis=1) for values in (moved.rate_rad_s, moved.acceleration_m_s2))
    assert 0.2 < rate.mean() < 0.66  # rad/s; 0.22 of MH_01_easy, 0.66 of V2_03_difficult, the paper's table
    assert np.median(acceleration) > 0.5
