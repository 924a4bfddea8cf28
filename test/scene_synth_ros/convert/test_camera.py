"""Lenses project as the renderer does, and rolling shutters are told."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from convert_bag import BROWN_K3, FISHEYE, PANORAMA, PINHOLE, RATIONAL

from renderer.camera.cameras import bearings, project
from scene_description import CameraPose
from scene_synth_ros.convert.camera import lens_of, refuse_rolling_shutter, row_time_s, shutter_notes
from scene_synth_ros.convert.writer import ConvertError
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


ROLLING = SimpleNamespace(settings={"camera": {"row_time_s": 2e-5}})
GLOBAL = (SimpleNamespace(settings={"camera": {"row_time_s": 0.0}}), SimpleNamespace(settings=None), SimpleNamespace(settings={}))


def test_a_rolling_shutter_is_told_from_the_settings():
    assert row_time_s(ROLLING) == 2e-5 and [row_time_s(frame) for frame in GLOBAL] == [0.0, 0.0, 0.0]
    with pytest.raises(
        ConvertError, match=r"^bop: camera left: expected a global shutter, .* got 2e-05 s a row; record with camera.row_time_s 0"
    ):
        refuse_rolling_shutter(ROLLING, "left", "bop")
    assert list(shutter_notes(ROLLING, "left", "tum")) == [
        "tum: camera left: the shutter takes 2e-05 s a row, which the format does not tell; poses are the first row's"
    ]
    for frame in GLOBAL:
        refuse_rolling_shutter(frame, "left", "bop")
        assert not shutter_notes(frame, "left", "tum")


@pytest.mark.parametrize("beyond", [(1e-4,), (0.0, 0.0, 0.0, 1e-4), (0.0, 0.0, 0.0, 0.0, 0.02, 0.0)])
def test_a_rational_lens_with_a_thin_prism_or_a_tilt_is_refused_and_zeros_are_none(beyond):
    camera = recorded(RATIONAL)
    told = dataclasses.replace(camera, D=np.array([*camera.D, *beyond]))
    with pytest.raises(
        ConvertError, match=r"^camera camera: expected at most 8 coefficients of rational_polynomial, got .* more that are not 0"
    ):
        lens_of(told)
    assert lens_of(dataclasses.replace(camera, D=np.array([*camera.D, *(0.0 for _ in beyond)]))) == lens_of(camera)


@pytest.mark.parametrize(("config", "count"), [(BROWN_K3, 5), (FISHEYE, 4)])
def test_coefficients_that_a_model_has_no_place_for_are_refused(config, count):
    camera = recorded(config)
    with pytest.raises(ConvertError, match=rf"expected at most {count} coefficients of .*, got 1 more that are not 0"):
        lens_of(dataclasses.replace(camera, D=np.array([*camera.D, 1.0])))


@pytest.mark.parametrize(("width", "height"), [(100_000, 100_000), (0, 48), (64, 0), (2**32 - 1, 2**32 - 1)])
def test_a_camera_of_a_size_that_no_picture_has_is_refused_before_it_takes_memory(width, height):
    with pytest.raises(ConvertError, match=rf"^camera camera: expected an image of 1 to 67108864 pixels, got {width}x{height}$"):
        lens_of(dataclasses.replace(recorded(PINHOLE), width=width, height=height))


@pytest.mark.parametrize("value", [0.0, -70.0, float("nan"), float("inf")])
def test_a_camera_that_is_not_calibrated_is_refused(value):
    camera = recorded(PINHOLE)
    k = camera.K.copy()
    k[0, 0] = value
    with pytest.raises(
        ConvertError, match=r"^camera camera: expected finite numbers in K and D and focal lengths above 0, got fx .*; calibrate"
    ):
        lens_of(dataclasses.replace(camera, K=k))
