"""White balance against Bradford's published adaptation and its own definition."""

import numpy as np
import pytest

from renderer.film.tone import Exposure, to_display, white_luminance
from renderer.film.white_balance import adaptation, chromaticity, metered_white, partly_adapted, white_of_kelvin
from scene_description.color_temperature import D65_XY, color_of_temperature, xyz_from_rgb

A_XY = (0.44757, 0.40745)


def test_adaptation_from_a_to_d65_is_lindblooms_matrix():
    """B. Lindbloom, "Chromatic Adaptation": Bradford, A to D65."""
    published = [[0.8446965, -0.1179225, 0.3948108], [-0.1366303, 1.1041226, 0.1291718], [0.0798489, -0.1348999, 3.1924009]]
    to_xyz = xyz_from_rgb()
    assert to_xyz @ adaptation(A_XY) @ np.linalg.inv(to_xyz) == pytest.approx(np.array(published), abs=2e-3)


def test_the_light_becomes_white_and_nothing_is_done_to_white():
    lamp = np.array(color_of_temperature(2700.0))
    shown = adaptation(chromaticity(lamp)) @ lamp
    assert shown == pytest.approx(np.full(3, shown[0]), rel=1e-9)
    assert adaptation(D65_XY) == pytest.approx(np.eye(3), abs=1e-12)
    assert adaptation(A_XY, 0.0) == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize("degree", [0.0, 0.3, 0.8, 1.0])
def test_a_part_of_the_tint_is_taken_by_a_lesser_white(degree):
    ratio = adaptation(partly_adapted(A_XY, degree)) @ np.linalg.inv(adaptation(A_XY, degree))
    assert ratio == pytest.approx(ratio[0, 0] * np.eye(3), abs=1e-9)


def test_grey_cards_tell_the_light_and_lamps_glass_and_black_do_not():
    rng = np.random.default_rng(3)
    light = np.array(color_of_temperature(3100.0)) * 50.0
    albedo = rng.uniform(0.1, 0.8, (500, 3))
    radiance = albedo * light
    radiance[:150], albedo[:150] = 900.0, 1.0
    radiance[150:200], albedo[150:200] = 5.0, 0.0
    assert metered_white(radiance.astype(np.float32), albedo.astype(np.float32)) == pytest.approx(white_of_kelvin(3100.0), abs=0.006)
    assert metered_white(np.zeros((4, 3), np.float32), np.full((4, 3), 0.5, np.float32)) == D65_XY


def test_display_shows_a_lit_grey_card_as_grey():
    lamp = np.array(color_of_temperature(3000.0))
    image = np.full((2, 2, 3), 0.4 * white_luminance(5.0), np.float32) * lamp.astype(np.float32)
    shown = to_display(image, Exposure(5.0, chromaticity(lamp)))
    assert int(shown.max()) - int(shown.min()) <= 1 and to_display(image, Exposure(5.0)).std() > 20
