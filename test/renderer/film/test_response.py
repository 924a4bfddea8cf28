"""Response curves against their formulas and tables."""

import numpy as np
import pytest

from renderer.core.color import srgb_from_linear
from renderer.film.tone import encode, thresholds

LIGHT = np.linspace(0.0, 1.2, 100_003).astype(np.float32)
STEPS = np.arange(1024) / 1023.0


def rec709(light):
    return np.where(light < 0.018, 4.5 * light, 1.099 * np.maximum(light, 1e-9) ** 0.45 - 0.099)


@pytest.mark.parametrize(
    ("response", "curve"),
    [
        ("srgb", srgb_from_linear),
        ("rec709", rec709),
        ("gamma", lambda light: light ** (1 / 1.8)),
        ("table", lambda light: np.interp(light, STEPS, np.tanh(2 * STEPS) / np.tanh(2))),
    ],
)
def test_codes_are_the_curve_in_whole_steps_and_clipped(response, curve):
    codes = encode(LIGHT, thresholds(response, 1.8, tuple(np.tanh(2 * STEPS) / np.tanh(2))))
    exact = 255.0 * np.clip(curve(LIGHT.astype(np.float64)), 0.0, 1.0)
    assert codes.dtype == np.uint8 and np.abs(codes - exact).max() < 0.5 + 1e-3
    assert codes[0] == 0 and codes[-1] == 255


def test_tables_may_be_flat_and_need_not_reach_black_or_white():
    codes = encode(np.array([0.0, 0.25, 0.5, 0.75, 1.0, 2.0], np.float32), thresholds("table", 1.0, (0.2, 0.2, 0.6, 0.6)))
    assert codes.tolist() == [51, 51, 102, 153, 153, 153]
