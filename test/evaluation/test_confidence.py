"""Intervals over rooms: those of textbooks, seeded, open where nothing tells the spread, and holding the truth as often as they say."""

import numpy as np
import pytest

from evaluation.confidence import Interval, intervals, mean_interval, pseudo_values, resampling_weights
from evaluation.tasks import TASKS

FLOW, DEPTH = TASKS["flow"], TASKS["depth"]


def room(error, pixels=4):
    """Return the tally of a room whose flow is wrong by so many pixels everywhere."""
    flow = np.zeros((1, pixels, 2))
    return FLOW.measure({"flow": flow}, flow + np.array([error, 0.0])).whole


def test_two_rooms_have_the_interval_of_student():
    """t(1) is 12.706: 2 +- 12.706 * 1; an error is not below zero."""
    found = mean_interval(2.0, np.array([1.0, 3.0]), "signed")
    assert (found.low, found.high) == pytest.approx((2.0 - 12.7062, 2.0 + 12.7062), abs=1e-3)
    assert intervals(FLOW, [room(1.0), room(3.0)], seed=0)["epe"].low == 0.0


def test_differences_have_the_interval_of_student():
    """Those that are all positive by chance, too: on the logarithm their interval would never hold 0."""
    found = mean_interval(1.0, np.array([0.1, 0.4, 2.5]), "signed")
    assert found.low < 0.0
    numbers = np.array([-1.0, 2.0, 0.5, 3.0, -0.5])
    found = mean_interval(0.8, numbers, "signed")
    half = 2.7764 * numbers.std(ddof=1) / np.sqrt(5)
    assert (found.low, found.high) == pytest.approx((0.8 - half, 0.8 + half), abs=1e-4)


def test_positive_numbers_have_it_on_the_logarithm():
    numbers = np.array([1.0, 1.1, 1.2, 1.3])
    found = mean_interval(1.15, numbers, "error")
    factor = np.exp(3.1824 * numbers.std(ddof=1) / 2.0 / 1.15)
    assert (found.low, found.high) == pytest.approx((1.15 / factor, 1.15 * factor), abs=1e-4)


def test_shares_have_it_of_what_is_missing_of_one():
    """Halves of pixels known mirror halves unknown: the interval of a share of 0.9 is that of 0.1, turned round, and ends at 1."""
    depth = np.full((1, 40), 2.0)
    rooms = []
    for unknown in (2, 4, 6):
        estimate = depth.copy()
        estimate[0, :unknown] = np.nan
        rooms.append(DEPTH.measure({"depth": depth}, estimate).whole)
    found = intervals(DEPTH, rooms, seed=0)["coverage"]
    missing = mean_interval(0.1, np.array([0.05, 0.1, 0.15]), "error")
    assert (found.value, found.low, found.high) == pytest.approx((0.9, max(1.0 - missing.high, 0.0), 1.0 - missing.low))


def test_the_same_seed_gives_the_same_intervals():
    samples = np.random.default_rng(2).exponential(1.0, (20, 6))
    first, again, other = ([mean_interval(sample.mean(), sample, "error", seed=seed) for sample in samples] for seed in (3, 3, 4))
    assert first == again != other


def test_every_draw_has_as_many_rooms_as_there_are():
    weights = resampling_weights(7, 50, 0)
    assert weights.shape == (50, 7)
    assert (weights.sum(axis=1) == 7).all()


def test_pseudo_values_of_a_mean_are_its_numbers_however_many_rooms():
    numbers = np.random.default_rng(0).uniform(0.0, 1.0, 600)
    found = pseudo_values(lambda weights: (weights @ numbers / weights.sum(axis=1))[:, None], np.ones((600, 1), bool))
    np.testing.assert_allclose(found[:, 0], numbers, atol=1e-9)


def test_a_ratio_has_the_error_of_the_delta_method():
    """Rooms of several sizes: the standard error of a ratio of sums by its linear approximation."""
    rng = np.random.default_rng(0)
    errors, sizes = rng.uniform(1.0, 1.5, 60), rng.integers(1, 9, 60)
    found = intervals(FLOW, [room(error, size) for error, size in zip(errors, sizes, strict=True)], seed=1)["epe"]
    ratio = (errors * sizes).sum() / sizes.sum()
    deviation = np.sqrt(((errors - ratio) ** 2 * sizes**2).sum() * 60 / 59) / sizes.sum()
    assert found.value == pytest.approx(ratio)
    assert found.high - found.low == pytest.approx(2.0 * 2.001 * deviation, rel=0.03)


def test_one_room_tells_no_spread_and_no_valid_pixel_no_value():
    assert intervals(FLOW, [room(0.5)], seed=0)["epe"] == Interval(value=0.5)
    blind = FLOW.measure({"flow": np.zeros((1, 2, 2))}, np.full((1, 2, 2), np.nan)).whole
    found = intervals(FLOW, [blind, blind], seed=0)
    assert (found["epe"], found["coverage"]) == (Interval(value=None), Interval(value=0.0, low=0.0, high=0.0))
    assert intervals(FLOW, [blind, room(0.5)], seed=0)["epe"] == Interval(value=0.5), "one room with a value tells no spread"
    assert intervals(FLOW, [blind, room(0.5), room(0.5)], seed=0)["epe"] == Interval(value=0.5, low=0.5, high=0.5)


SAMPLES = {
    "normal": (lambda rng, rooms: rng.normal(3.0, 1.0, rooms), 3.0),
    "lognormal 0.5": (lambda rng, rooms: rng.lognormal(0.0, 0.5, rooms), np.exp(0.125)),
    "lognormal 1": (lambda rng, rooms: rng.lognormal(0.0, 1.0, rooms), np.exp(0.5)),
    "exponential": (lambda rng, rooms: rng.exponential(1.0, rooms), 1.0),
    "uniform": (lambda rng, rooms: rng.uniform(0.0, 1.0, rooms), 0.5),
}


@pytest.mark.parametrize("rooms", [5, 8, 16])
@pytest.mark.parametrize("kind", SAMPLES)
def test_intervals_hold_the_truth_as_often_as_they_say(kind, rooms):
    draw, truth = SAMPLES[kind]
    rng = np.random.default_rng(rooms)
    hits = 0
    for _ in range(3000):
        sample = draw(rng, rooms)
        found = mean_interval(sample.mean(), sample, "error", draws=500)
        hits += found.low <= truth <= found.high
    assert 0.93 <= hits / 3000 <= 0.97
