"""Exposure and sRGB against their definitions."""

import numpy as np
import pytest

from renderer.film.tone import (
    CAMERA_WHITE,
    FILMIC_KNEE,
    FILMIC_WHITE,
    TONE_CURVES,
    Exposure,
    camera_curve,
    encode_srgb,
    filmic,
    from_display,
    to_display,
    white_luminance,
)
from renderer.film.white_balance import adaptation


def test_srgb_is_the_standards_curve_rounded():
    linear = np.linspace(0, 1, 20001)
    exact = 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    codes = encode_srgb(linear.astype(np.float32))
    between = np.abs(exact - np.floor(exact) - 0.5) > 1e-3
    assert np.array_equal(codes[between], np.rint(exact[between]))
    assert codes.dtype == np.uint8 and len(np.unique(codes)) == 256


def test_every_code_survives_decoding():
    codes = np.arange(256)
    decoded = np.where(codes <= 10, codes / 255 / 12.92, ((codes / 255 + 0.055) / 1.055) ** 2.4)
    assert np.array_equal(encode_srgb(decoded.astype(np.float32)), codes)


def test_out_of_range_is_clipped():
    assert encode_srgb(np.array([-1, 0, 1, 7, np.inf], np.float32)).tolist() == [0, 0, 255, 255, 255]


@pytest.mark.parametrize(("ev", "white"), [(0, 1.2), (6, 76.8), (-1, 0.6), (15, 39321.6)])
def test_white_is_the_saturation_luminance(ev, white):
    assert white_luminance(ev) == pytest.approx(white)
    image = np.full((2, 3, 3), white * 0.18, np.float32)
    assert (to_display(image, Exposure(ev)) == 118).all()
    assert (to_display(image / 0.18 * 1.001, Exposure(ev)) == 255).all()


def test_the_filmic_curve_is_plain_below_its_knee_smooth_and_white_at_its_end():
    below = np.linspace(0.0, FILMIC_KNEE, 50)
    assert np.array_equal(filmic(below), below)
    assert filmic(np.array([FILMIC_WHITE]))[0] == pytest.approx(1.0, abs=1e-9)
    values = np.geomspace(0.01, FILMIC_WHITE, 20_000)
    slopes = np.diff(filmic(values)) / np.diff(values)
    assert (slopes > 0.0).all() and (np.diff(slopes) < 1e-9).all()
    assert np.abs(np.diff(slopes)).max() < 0.005


def test_codes_follow_the_filmic_curve():
    linear = np.geomspace(0.001, 120.0, 4001).astype(np.float32)
    shown = np.minimum(filmic(linear), 1.0)
    exact = 255 * np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)
    between = np.abs(exact - np.floor(exact) - 0.5) > 1e-2
    assert np.array_equal(encode_srgb(linear, "filmic")[between], np.rint(exact[between]))


def test_the_camera_keeps_middle_grey_is_white_at_six_times_white_and_black_at_its_black():
    assert camera_curve(np.array([0.0, 0.18, CAMERA_WHITE])) == pytest.approx([0.0, 0.18, 1.0], abs=1e-12)
    assert camera_curve(np.array([0.0, 0.01, 0.012]))[2] > 0.0 == camera_curve(np.array([0.012]), 0.012)[0]
    light = np.geomspace(1e-3, CAMERA_WHITE, 10_000)
    shown = camera_curve(light)
    assert (np.diff(shown) > 0.0).all()
    slope = np.diff(np.log(shown)) / np.diff(np.log(light))
    assert slope[0] == pytest.approx(1.6, abs=0.01) and (np.diff(slope) < 1e-9).all(), "steep in the dark, ever flatter towards white"


@pytest.mark.parametrize("curve", TONE_CURVES)
@pytest.mark.parametrize("black", [0.0, 0.004, 0.016])
def test_what_is_shown_can_be_turned_back_into_light(curve, black):
    exposure = Exposure(5.0, (0.40, 0.38), black)
    codes = np.stack([np.arange(1, 255)] * 3, axis=-1)[None].astype(np.uint8)
    light = from_display(codes, exposure, curve)
    assert np.array_equal(to_display(light, exposure, curve), codes)
    assert (np.diff(light[0, :, 1]) > 0.0).all()


@pytest.mark.parametrize("curve", TONE_CURVES)
def test_codes_count_the_thresholds_that_values_reach(curve):
    steps = np.diff(encode_srgb(np.geomspace(1e-5, 200.0, 4_000_000).astype(np.float32), curve).astype(int))
    assert (steps >= 0).all() and np.count_nonzero(steps) == steps.sum() == 255, "each code once, in order"
    rng = np.random.default_rng(3)
    values = np.stack([rng.integers(0, 0x7F800000, 300_000, np.int32).view(np.float32), rng.uniform(-1.0, 2.0, 300_000).astype(np.float32)])
    values = values.T[:, ::-1]
    curves = {"srgb": lambda light: light, "filmic": filmic, "camera": camera_curve}
    shown = curves[curve](np.clip(values.astype(np.float64), 0.0, 2 * FILMIC_WHITE))
    shown = np.clip(shown.astype(np.float64), 0.0, 1.0)
    exact = 255 * np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)
    between = np.abs(exact - np.floor(exact) - 0.5) > 1e-3
    assert np.array_equal(encode_srgb(values, curve)[between], np.rint(exact[between]))


def test_balance_is_the_matrix_of_the_white():
    radiance = np.random.default_rng(5).uniform(0.0, 100.0, (7, 5, 3)).astype(np.float32)
    exposure = Exposure(5.0, (0.40, 0.38))
    balanced = radiance.astype(np.float64) @ adaptation(exposure.white_xy).T / white_luminance(exposure.ev100)
    difference = to_display(radiance, exposure).astype(int) - encode_srgb(balanced.astype(np.float32))
    assert np.abs(difference).max() <= 1 and (difference != 0).mean() < 0.01


def test_skies_of_a_few_times_white_stay_apart():
    codes = encode_srgb(np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 101.0], np.float32), "filmic").astype(int)
    assert (np.diff(codes) >= 5).all() and codes[-1] == 255
