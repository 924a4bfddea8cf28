"""Local tone mapping: what is broad is compressed as told, what is fine keeps its contrast."""

import numpy as np
import pytest

from renderer.film.local_tone import MIDDLE_GREY, compress_base
from renderer.film.tone import Exposure, to_display


@pytest.mark.parametrize("stops", [-6.0, -1.0, 0.0, 2.0, 8.0])
def test_even_light_is_all_base(stops):
    light = np.full((60, 80, 3), MIDDLE_GREY * 2.0**stops, np.float32) * np.array([1.0, 1.0, 1.0], np.float32)
    shown = np.log2(compress_base(light, 2.4) / MIDDLE_GREY)
    assert shown == pytest.approx(np.full(light.shape, stops / (1.0 + abs(stops) / 1.2)), abs=1e-4)


def test_a_bright_window_comes_near_and_stripes_in_it_keep_their_contrast():
    light = np.full((120, 160, 3), 0.09, np.float32)
    light[:, 80:] = 12.0
    light[:, 80::2] *= np.float32(1.05)
    shown = compress_base(light, 2.3)
    assert shown[:, 110:150].mean() / shown[:, 10:50].mean() < 5.0 < light[:, 110:].mean() / light[:, :50].mean()
    stripes = shown[60, 110:150, 1]
    assert stripes[::2] / stripes[1::2] == pytest.approx(np.full(20, 1.05), abs=0.01)
    assert np.ptp(shown[..., 0] / shown[..., 2]) < 1e-5, "hues stay"


def test_it_is_a_choice_of_the_picture():
    light = np.random.default_rng(1).uniform(0.0, 9.0, (40, 50, 3)).astype(np.float32)
    exposure = Exposure(1.0, black=0.01)
    assert np.array_equal(to_display(light, exposure, "camera"), to_display(light, exposure, "camera", 0.0))
    assert not np.array_equal(to_display(light, exposure, "camera"), to_display(light, exposure, "camera", 2.3))
