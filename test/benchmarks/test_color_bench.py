"""Noise at equal time, of pictures whose noise is known."""

import numpy as np
import pytest

from benchmarks.color_bench import Noise, noise, noise_rows


def picture(luminance: float, variance: float) -> np.ndarray:
    return np.stack([np.full((4, 5), luminance), np.full((4, 5), variance)])


def test_even_noise_is_its_variance_over_the_luminance_squared() -> None:
    """With 5 % of the mean in the denominator."""
    found = noise(picture(10.0, 50.0), picture(10.0, 70.0), 0.5)
    assert found == pytest.approx(Noise(60.0 / 10.5**2, 0.6, 0.5))


def test_a_rare_stroke_counts_in_full() -> None:
    """One pixel's stroke of 1,000 times the light among 16 samples: beside its own luminance it would count 16 or so."""
    first, second = picture(1.0, 0.0), picture(1.0, 0.0)
    first[0, 2, 3], first[1, 2, 3] = 1000.0 / 16.0, 1000.0**2 / 16.0
    mean = 0.5 * (first[0].mean() + 1.0)
    expected = 0.5 * 1000.0**2 / 16.0 / 20.0 / (1.0 + 0.05 * mean) ** 2
    assert noise(first, second, 1.0).relative == pytest.approx(expected, rel=1e-9)


def test_rooms_are_set_beside_those_of_before() -> None:
    """Half the variance in twice the time is nothing gained; a quarter in the same time is one."""
    before = {"bathroom 0": Noise(4.0, 9.0, 1.0), "study 0": Noise(2.0, 9.0, 1.0)}
    rows = {row.name: row for row in noise_rows({"bathroom 0": Noise(2.0, 1.0, 2.0), "study 0": Noise(0.5, 1.0, 1.0)}, before)}
    assert rows["bathroom 0, variance at equal time"].value == pytest.approx(1.0)
    assert rows["study 0, variance at equal time"].value == pytest.approx(0.25)
    worst = rows["variance at equal time over that of before, worst"]
    assert (worst.value, worst.met) == (pytest.approx(1.0), False)
    assert len(noise_rows(before, {})) == 4
