"""Lenses of recorded cameras are those of the renderer."""

import dataclasses

import numpy as np
import pytest
from convert_bag import BROWN_K3, FISHEYE, PANORAMA, PINHOLE, RATIONAL

from renderer.camera.cameras import bearings, project
from scene_description import CameraPose
from scene_synth_ros.convert.errors import ConvertError
from scene_synth_ros.convert.lens import lens_of
from scene_synth_ros.dataset.camera import Camera, read_camera
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.messages.conversions import camera_info_to_msg

HERE = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0))


def recorded(config) -> Camera:
    return read_camera("camera", canonical_cdr(camera_info_to_msg(config, 5, "eye")))


@pytest.mark.parametrize("config", [PINHOLE, BROWN_K3, RATIONAL, FISHEYE, PANORAMA])
def test_points_and_directions_are_those_of_the_renderer(config):
    lens = lens_of(recorded(config))
    points = np.random.default_rng(2).uniform((-0.6, -0.5, 1.0), (0.6, 0.5, 3.0), (50, 3))
    assert lens.model == config.model
    np.testing.assert_allclose(lens.project(points) + 0.5, project(config, HERE, points)[:, :2], atol=1e-9)
    pixels = np.random.default_rng(3).uniform((10, 10), (config.width - 10, config.height - 10), (50, 2))
    np.testing.assert_allclose(lens.directions(pixels), bearings(config, pixels + 0.5), atol=1e-12)


def test_a_lens_of_others_is_refused():
    camera = dataclasses.replace(recorded(PINHOLE), model="double_sphere")
    with pytest.raises(ConvertError, match=r"^camera camera: expected a distortion model of plumb_bob, .*, got 'double_sphere'$"):
        lens_of(camera)
