"""Local tone mapping: exposures are merged so that bright and dark parts are readable, and what is fine keeps its contrast."""

import numpy as np
import pytest

from renderer.film.local_tone import KEPT_LIGHT, merge_exposures
from renderer.film.tone import Exposure, to_display


@pytest.mark.parametrize("stops", [1.0, 4.0, 7.0])
def test_even_light_of_the_middle_stays(stops):
    assert merge_exposures(np.full((60, 80, 3), KEPT_LIGHT, np.float32), stops) == pytest.approx(KEPT_LIGHT, rel=1e-5)


def test_of_a_single_exposure_nothing_changes():
    light = np.random.default_rng(1).uniform(0.01, 9.0, (40, 50, 3)).astype(np.float32)
    assert merge_exposures(light, 0.0) == pytest.approx(light, rel=1e-5)


def test_more_light_is_never_shown_darker():
    even = [float(merge_exposures(np.full((16, 16, 3), light, np.float32), 5.0)[0, 0, 0]) for light in np.geomspace(0.01, 60.0, 40)]
    assert np.all(np.diff(even) > 0.0)


def test_a_bright_window_comes_near_and_stripes_in_it_keep_their_contrast():
    light = np.full((120, 160, 3), 0.09, np.float32) * np.array([1.0, 0.9, 0.8], np.float32)
    light[:, 80:] *= 130.0
    light[:, 80::8] *= np.float32(1.2)
    shown = merge_exposures(light, 4.0)
    assert shown[:, 90:150].max() < 3.0 < light[:, 90:150].min()
    assert shown[:, 110:150].mean() > 3.0 * shown[:, 10:50].mean()
    stripes = shown[60, 112:144, 1]
    assert stripes[::8].mean() / stripes[4::8].mean() > 1.1
    assert shown[..., 0] / shown[..., 2] == pytest.approx(light[..., 0] / light[..., 2], rel=1e-5), "hues stay"


def test_what_lies_in_shadow_comes_nearer_and_keeps_its_contrast():
    light = np.full((120, 160, 3), 0.35, np.float32)
    light[:, 80:] = 0.01
    light[:, 80::8] *= np.float32(1.2)
    shown = merge_exposures(light, 8.0)
    assert shown[:, 110:150].mean() > 2.0 * light[:, 110:150].mean(), "exposures longer than the picture's own show it"
    assert shown[:, 110:150].mean() < 0.3 * shown[:, 10:50].mean(), "it stays dark"
    stripes = shown[60, 112:144, 1]
    assert stripes[::8].mean() / stripes[4::8].mean() > 1.1


def test_it_is_a_choice_of_the_picture():
    light = np.random.default_rng(1).uniform(0.0, 9.0, (40, 50, 3)).astype(np.float32)
    exposure = Exposure(1.0, black=0.01)
    assert np.array_equal(to_display(light, exposure, "camera"), to_display(light, exposure, "camera", 0.0))
    assert not np.array_equal(to_display(light, exposure, "camera"), to_display(light, exposure, "camera", 2.3))
