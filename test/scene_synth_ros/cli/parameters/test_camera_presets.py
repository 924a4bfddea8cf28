"""The cameras that come with the program."""

from pathlib import Path

import numpy as np
import pytest

from renderer.camera.cameras import bearing_table, intrinsics
from renderer.camera.config import CameraConfig
from scene_description import from_mapping
from scene_description.share import config_path
from scene_synth_ros.cli.parameters.run_profile import load_profile

PRESETS = sorted(config_path("cameras").glob("*.yaml"))


@pytest.mark.parametrize("path", PRESETS, ids=lambda path: path.stem)
def test_a_preset_is_a_camera_and_nothing_else(path: Path) -> None:
    parameters = load_profile(path)
    assert not parameters["grammar_node"] and not parameters["recorder_node"]
    fields = {name.removeprefix("camera."): value for name, value in parameters["renderer_node"].items()}
    camera = from_mapping(CameraConfig, fields)
    table = bearing_table(camera)
    assert np.isfinite(table[table.shape[0] // 2, table.shape[1] // 2]).all()


def test_the_kinect_has_its_nominal_focal_length() -> None:
    fields = load_profile(config_path("cameras/kinect_v1.yaml"))["renderer_node"]
    camera = from_mapping(CameraConfig, {name.removeprefix("camera."): value for name, value in fields.items()})
    assert intrinsics(camera) == pytest.approx((525.0, 525.0, 319.5, 239.5))
