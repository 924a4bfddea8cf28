"""The stages of a colour sensor together: an ideal one, a mosaic under lamplight, a response, JPEG."""

import math

import numpy as np
import pytest
from box_room import VIEW

from renderer import CameraConfig, SensorConfig
from renderer.camera.bayer import demosaic, mosaic
from renderer.camera.cameras import pose_camera
from renderer.camera.saturation import saturate
from renderer.camera.sharpening import sharpen
from renderer.color_sensor import read_color
from renderer.film.tone import Exposure, to_display, white_luminance
from renderer.film.white_balance import adaptation, white_of_kelvin
from scene_description.strict import FieldError

CAMERA = pose_camera(CameraConfig(width=96, height=64), VIEW)
WARM = Exposure(6.0, white_of_kelvin(2700.0))
WHITE = white_luminance(6.0)


def read(light, exposure=WARM, **settings):
    return read_color(light, CAMERA, SensorConfig(**settings), exposure, "filmic", np.uint32(9))


def soft_scene():
    """Blobs of several colours, smooth over some pixels."""
    y, x = np.mgrid[:64, :96] / 64.0
    waves = [0.5 + 0.4 * np.sin(6 * x + phase) * np.cos(5 * y - phase) for phase in (0.0, 1.0, 2.0)]
    return (np.stack(waves, axis=-1) * 0.6 * WHITE).astype(np.float32)


def psnr(a, b):
    return 10.0 * math.log10(255.0**2 / ((a.astype(float) - b.astype(float)) ** 2).mean())


def test_an_ideal_sensor_shows_the_ideal_picture():
    light = np.random.default_rng(1).uniform(0.0, 2 * WHITE, (64, 96, 3)).astype(np.float32)
    assert np.array_equal(read(light), to_display(light, WARM, "filmic"))


@pytest.mark.parametrize("kelvin", [1700.0, 2700.0, 6500.0, 20000.0])
def test_a_mosaic_keeps_even_light_and_nearly_what_is_smooth(kelvin):
    exposure = Exposure(6.0, white_of_kelvin(kelvin))
    even = np.broadcast_to(np.array([90.0, 40.0, 12.0], np.float32), (64, 96, 3))
    apart = read(even, exposure, bayer="grbg").astype(int) - to_display(even, exposure, "filmic")
    assert np.abs(apart).max() <= 1
    assert psnr(read(soft_scene(), exposure, bayer="grbg"), to_display(soft_scene(), exposure, "filmic")) > 40.0


def test_edges_of_grey_under_lamplight_are_interpolated_with_channels_balanced():
    y, x = np.mgrid[:64, :96]
    card = np.where((x - 46.7) ** 2 + (y - 31.2) ** 2 < 500, 0.5, 0.2)[..., None]
    light = (card * np.linalg.solve(adaptation(WARM.white_xy), np.ones(3)) * WHITE).astype(np.float32)
    ideal = to_display(light, WARM, "filmic")
    unbalanced = to_display(demosaic(mosaic(light, "rggb"), "rggb", "malvar"), WARM, "filmic")
    assert psnr(read(light, bayer="rggb"), ideal) > psnr(unbalanced, ideal) + 4.0


def test_a_response_replaces_the_tone_curve():
    light = soft_scene()
    neutral = Exposure(6.0)
    assert np.array_equal(read(light, neutral, response="srgb"), to_display(light, neutral, "srgb"))
    straight = read(light, neutral, response="table", response_points=(0.0, 1.0))
    assert np.abs(straight - 255.0 * light / WHITE).max() <= 0.51
    assert np.array_equal(read(light, neutral, response="gamma", response_gamma=1.0), straight)


def test_sharpening_steepens_edges_and_leaves_what_is_even_or_weak():
    """By hand, on a grey edge from 60 to 160: the detail is 100 times 5/16 beside the edge and 1/16 one further, and cored."""
    even = np.full((16, 16, 3), 90, np.uint8)
    assert np.array_equal(sharpen(even, 2.0), even)
    edge = np.where(np.arange(16) < 8, 60, 160).astype(np.uint8)[None, :, None].repeat(16, axis=0).repeat(3, axis=2)
    sharp = sharpen(edge, 0.8)[8, :, 0].astype(int)
    over = [round(0.8 * detail**3 / (detail**2 + 1.5**2)) for detail in (31.25, 6.25)]
    assert sharp.tolist() == [60] * 6 + [60 - over[1], 60 - over[0], 160 + over[0], 160 + over[1]] + [160] * 6
    noise = np.random.default_rng(3).normal(120.0, 0.6, (64, 64)).round().astype(np.uint8)[..., None].repeat(3, axis=2)
    assert sharpen(noise, 1.0).std() < 1.4 * noise.std() < sharpen(noise, 1.0).std() * 1.4


def test_colour_keeps_its_differences_where_luma_is_sharpened():
    light = soft_scene()
    plain, sharp = (read(light, sharpening=amount).astype(int) for amount in (0.0, 3.0))
    kept = (sharp.min(axis=2) > 0) & (sharp.max(axis=2) < 255)
    assert kept.mean() > 0.5 and not np.array_equal(sharp[kept], plain[kept])
    assert np.abs((sharp[..., 0] - sharp[..., 2]) - (plain[..., 0] - plain[..., 2]))[kept].max() <= 1


def test_saturation_leaves_greys_and_luma_and_moves_colours_apart():
    grey = np.arange(256, dtype=np.uint8)[None, :, None].repeat(3, axis=2)
    assert np.array_equal(saturate(grey, 1.7), grey)
    assert saturate(np.array([[[100, 150, 200]]], np.uint8), 1.2).tolist() == [[[92, 152, 212]]]  # luma is 140.75
    assert saturate(np.array([[[250, 20, 20]]], np.uint8), 3.0).tolist() == [[[255, 0, 0]]]
    light = soft_scene()
    assert np.array_equal(read(light, color_saturation=1.3), saturate(read(light), 1.3))


def test_jpeg_leaves_what_its_quality_says():
    """A smooth picture loses next to nothing at 95; less quality is less likeness."""
    ideal, pictures = read(soft_scene()), [read(soft_scene(), jpeg_quality=quality) for quality in (95, 50, 10)]
    likeness = [psnr(picture, ideal) for picture in pictures]
    assert likeness[0] > 40.0 and likeness[0] > likeness[1] > likeness[2] > 20.0
    assert all(picture.shape == ideal.shape and picture.dtype == np.uint8 for picture in pictures)


def test_tables_without_points_or_with_falling_ones_are_refused():
    with pytest.raises(FieldError, match=r"response_points: expected at least 2 numbers for response 'table', got 0"):
        SensorConfig(response="table")
    with pytest.raises(FieldError, match=r"response_points: expected numbers of which none is below the one before"):
        SensorConfig(response_points=(0.0, 0.5, 0.4))
