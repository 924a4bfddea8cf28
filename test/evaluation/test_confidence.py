"""Intervals of the bootstrap over rooms: those of its definition, seeded, open where there is nothing to draw."""

import numpy as np
import pytest

from evaluation.confidence import Interval, intervals, resampling_weights
from evaluation.tasks import TASKS

FLOW = TASKS["flow"]


def room(error, pixels=4):
    """Return the tally of a room whose flow is wrong by so many pixels everywhere."""
    flow = np.zeros((1, pixels, 2))
    return FLOW.measure({"flow": flow}, flow + np.array([error, 0.0])).whole


def test_the_interval_is_that_between_percentiles_of_draws():
    rng = np.random.default_rng(0)
    errors, sizes = rng.uniform(0.0, 2.0, 30), rng.integers(1, 9, 30)
    found = intervals(FLOW, [room(error, size) for error, size in zip(errors, sizes, strict=True)], seed=1, draws=4000)["epe"]
    drawn = rng.integers(0, 30, (4000, 30))
    means = (errors[drawn] * sizes[drawn]).sum(axis=1) / sizes[drawn].sum(axis=1)
    assert found.value == pytest.approx((errors * sizes).sum() / sizes.sum())
    assert (found.low, found.high) == pytest.approx(tuple(np.percentile(means, [2.5, 97.5])), abs=0.02)


def test_the_same_seed_gives_the_same_interval():
    rooms = [room(error) for error in (0.1, 0.5, 2.0, 0.3)]
    assert intervals(FLOW, rooms, seed=3) == intervals(FLOW, rooms, seed=3) != intervals(FLOW, rooms, seed=4)


def test_every_draw_has_as_many_rooms_as_there_are():
    weights = resampling_weights(7, 50, 0)
    assert weights.shape == (50, 7)
    assert (weights.sum(axis=1) == 7).all()


def test_one_room_tells_no_spread_and_no_valid_pixel_no_value():
    assert intervals(FLOW, [room(0.5)], seed=0)["epe"] == Interval(value=0.5)
    blind = FLOW.measure({"flow": np.zeros((1, 2, 2))}, np.full((1, 2, 2), np.nan)).whole
    found = intervals(FLOW, [blind, blind], seed=0)
    assert (found["epe"], found["coverage"]) == (Interval(value=None), Interval(value=0.0, low=0.0, high=0.0))
    assert intervals(FLOW, [blind, room(0.5)], seed=0)["epe"] == Interval(value=0.5, low=0.5, high=0.5)
