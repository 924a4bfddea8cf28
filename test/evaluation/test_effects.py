"""Effects against hand-computed cases: pairing, intervals, missing rooms, standardised coefficients."""

from dataclasses import astuple

import numpy as np
import pytest

from evaluation.confidence import Interval
from evaluation.effects import contrast, differences, room_means, standardised_regression

NAN = np.nan


def test_means_are_over_the_rooms_that_have_a_value() -> None:
    means = room_means(np.array([[1.0, 10.0, NAN], [3.0, NAN, NAN]]), "signed")
    assert means[0] is not None and means[0].low is not None and means[0].high is not None
    assert (means[0].value, means[0].low, means[0].high) == pytest.approx((2.0, 2.0 - 12.7062, 2.0 + 12.7062), abs=1e-3)
    assert means[1] == Interval(value=10.0), "one room has no interval"
    assert means[2] is None


def test_the_interval_of_a_mean_is_as_wide_as_theory_says() -> None:
    values = np.random.default_rng(5).normal(7.0, 2.0, (400, 1))
    (mean,) = room_means(values, "signed")
    assert mean is not None and mean.low is not None and mean.high is not None
    half = 1.96 * values.std() / 20.0
    assert mean.low == pytest.approx(mean.value - half, abs=0.05) and mean.high == pytest.approx(mean.value + half, abs=0.05)
    assert room_means(values, "signed") == [mean], "the same seed draws the same rooms"


def test_rooms_are_compared_with_themselves() -> None:
    """Rooms differ by tens, the factor adds exactly 1 and 3 in each: pairing leaves no spread at all."""
    rooms = np.array([10.0, 40.0, 90.0, 20.0])[:, None]
    found = contrast(rooms + np.array([0.0, 1.0, 3.0]), base=0)
    assert found is not None and (found.least, found.most) == (0, 2)
    assert np.allclose(astuple(found.range), 3.0)
    found = contrast(rooms + np.array([2.0, 0.0, 1.0]), base=None)
    assert found is not None and (found.least, found.most) == (1, 0) and np.allclose(astuple(found.range), 2.0)


def test_an_effect_that_only_some_rooms_have_is_not_sure() -> None:
    changes = np.array([1.0, -1.0, 2.0, -2.0, 0.5, -0.3])
    found = contrast(np.column_stack([np.zeros(6), changes]), base=0)
    assert found is not None and found.range.value == pytest.approx(changes.mean())
    assert found.range.low is not None and found.range.high is not None and found.range.low < 0.0 < found.range.high


def test_missing_rooms_do_not_bias_a_contrast() -> None:
    """The expensive room lacks one value: plain means would differ by 50."""
    values = np.array([[0.0, 1.0], [100.0, NAN], [0.0, 1.0]])
    found = contrast(values, base=0)
    assert found is not None and found.range.value == 1.0
    assert contrast(np.array([[NAN, 1.0], [2.0, NAN]]), base=0) is None
    assert contrast(np.array([[1.0, 2.0]]), base=0) == (Interval(value=1.0), 0, 1)


def test_differences_without_a_base_are_to_the_mean_of_the_room() -> None:
    np.testing.assert_allclose(differences(np.array([[1.0, 2.0, 6.0], [4.0, NAN, 6.0]]), None), [[-2, -1, 3], [-1, NAN, 1]])


def test_standardised_coefficients_of_a_known_line() -> None:
    """Y = 3 a - 4 b with independent columns of equal spread: coefficients 0.6 and -0.8, all variance explained, rooms do not matter."""
    a, b = (column.ravel() for column in np.meshgrid([-1.0, 1.0], [-1.0, 1.0]))
    a, b, rooms = np.tile(a, 5), np.tile(b, 5), np.repeat(np.arange(5), 4)
    response = 3.0 * a - 4.0 * b + 100.0 * rooms
    fit = standardised_regression(response, [a[:, None], 7.0 * b[:, None]], rooms)
    assert fit is not None and fit.r_squared == pytest.approx(1.0)
    np.testing.assert_allclose([astuple(part) for part in fit.coefficients], [[0.6] * 3, [-0.8] * 3])


def test_a_factor_of_names_has_a_coefficient_without_sign() -> None:
    names = np.tile([0, 1, 2], 4)
    response = np.array([1.0, 5.0, 3.0])[names]
    columns = np.stack([names == 1, names == 2], axis=1).astype(float)
    noise = np.tile([0.0], 12)[:, None]
    fit = standardised_regression(response, [columns, noise], np.repeat(np.arange(4), 3))
    assert fit is not None and [part.value for part in fit.coefficients] == [pytest.approx(1.0), pytest.approx(0.0)]


def test_regression_agrees_with_numpy_where_each_room_has_one_sample() -> None:
    rng = np.random.default_rng(3)
    x = rng.normal(size=(60, 2)) @ [[1.0, 0.4], [0.0, 1.0]]
    response = x @ [2.0, -1.0] + rng.normal(size=60)
    slopes = np.linalg.lstsq(x - x.mean(axis=0), response - response.mean(), rcond=None)[0]
    fit = standardised_regression(response, [x[:, [0]], x[:, [1]]], np.arange(60))
    assert fit is not None
    np.testing.assert_allclose([part.value for part in fit.coefficients], slopes * x.std(axis=0) / response.std())
    for part, sign in zip(fit.coefficients, (1, -1), strict=True):
        assert part.low is not None and part.high is not None and part.low < part.value < part.high and sign * part.low > 0
    assert standardised_regression(np.ones(60), [x], np.arange(60)) is None
