"""Monotone interpolation beside scipy's, and at a step."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from grammar.camera.directions import interpolate_monotonically


@pytest.mark.parametrize("count", [2, 3, 4, 9, 40])
def test_bits_are_those_of_scipy(count: int) -> None:
    rng = np.random.default_rng(count)
    for even in (True, False):
        for _ in range(50):
            keys = np.linspace(0.0, rng.uniform(0.2, 9.0), count) if even else np.sort(rng.uniform(0.0, 9.0, count))
            values = rng.normal(0.0, 2.0, count)
            values[rng.uniform(size=count) < 0.3] = 0.5  # level pieces
            at = np.concatenate([rng.uniform(keys[0], keys[-1], 60), keys])
            np.testing.assert_array_equal(interpolate_monotonically(keys, values, at), PchipInterpolator(keys, values)(at))


def test_a_step_is_not_overshot() -> None:
    curve = interpolate_monotonically(np.arange(4.0), np.array([0.0, 0.0, 1.0, 1.0]), np.linspace(0.0, 3.0, 31))
    assert curve.min() == 0.0 and curve.max() == 1.0 and curve[15] == pytest.approx(0.5)
