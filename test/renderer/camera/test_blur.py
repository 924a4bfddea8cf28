"""Blur and glare: a point spreads as a Gaussian over pixels of some width, light is kept, edges alone soften, glare lifts shadows."""

import math

import numpy as np
import pytest
from box_room import VIEW

from renderer import CameraConfig, SensorConfig
from renderer.camera.blur import blur, gaussian_weights
from renderer.camera.cameras import pose_camera
from renderer.camera.sensor import veil
from renderer.color_sensor import read_color
from renderer.film.tone import Exposure, white_luminance


@pytest.mark.parametrize("deviation", [0.6, 1.0, 2.5])
def test_a_point_spreads_by_the_variance_of_lens_and_pixel(deviation):
    point = np.zeros((31, 31, 3), np.float32)
    point[15, 15] = (1.0, 2.0, 4.0)
    spread = blur(point, gaussian_weights(deviation))
    assert spread.sum(axis=(0, 1)) == pytest.approx([1.0, 2.0, 4.0], rel=1e-5)
    assert np.array_equal(spread, spread.swapaxes(0, 1)) and np.array_equal(spread, spread[::-1])
    away = np.arange(31) - 15.0
    variance = float((spread[..., 0].sum(axis=0) * away**2).sum())
    assert variance == pytest.approx(deviation**2 + 1.0 / 12.0, rel=0.04), "a pixel's width has variance 1/12; three deviations are kept"
    middle, beside = math.erf(0.5 / (math.sqrt(2.0) * deviation)), spread[15, 16, 0] / spread[15, 15, 0]
    assert beside == pytest.approx(0.5 * (math.erf(1.5 / (math.sqrt(2.0) * deviation)) - middle) / middle, rel=1e-4)


def test_a_sensor_that_blurs_softens_edges_and_leaves_what_is_even():
    camera, exposure = pose_camera(CameraConfig(width=96, height=64), VIEW), Exposure(6.0)
    light = np.full((64, 96, 3), 0.1 * white_luminance(6.0), np.float32)
    light[:, 48:] *= 4.0
    pictures = (read_color(light, camera, SensorConfig(blur_px=px), exposure, "srgb", np.uint32(1)) for px in (0.0, 0.6))
    sharp, soft = (picture[32, :, 1].astype(int) for picture in pictures)
    assert (np.diff(sharp) != 0).sum() == 1
    assert (np.diff(soft) >= 0).all() and (np.diff(soft) != 0).sum() == 5, "two pixels on both sides"
    assert soft[:46].tolist() == sharp[:46].tolist() and soft[50:].tolist() == sharp[50:].tolist()


def test_glare_moves_a_share_of_all_light_to_every_pixel():
    light = np.zeros((8, 16, 3), np.float32)
    light[:, :4] = (100.0, 50.0, 10.0)
    veiled = veil(light, 0.02)
    assert veiled[3, 9] == pytest.approx([0.5, 0.25, 0.05]), "2 % of a mean of a quarter"
    assert veiled[3, 2] == pytest.approx([98.5, 49.25, 9.85])
    assert veiled.sum() == pytest.approx(light.sum(), rel=1e-6)
