"""Totals from samples: textbook numbers, coverage of the interval, rounds of shards."""

import math

import numpy as np
import pytest

from scene_synth_ros.estimate.estimate import CONFIDENCE, Interval, sample_indices, seconds_on, total_of


def test_the_interval_is_students() -> None:
    """Values 1, 2, 3 of ten rooms: total 20, error 10 * 1 * sqrt(1/3 - 1/10), t(0.975, 2) = 4.302653 of any table."""
    half = 10.0 * math.sqrt(1.0 / 3.0 - 1.0 / 10.0) * 4.302653
    assert total_of([1.0, 2.0, 3.0], 10) == pytest.approx((20.0, max(6.0, 20.0 - half), 20.0 + half), rel=1e-6)


def test_a_sample_of_all_has_no_error_and_one_room_no_upper_end() -> None:
    assert total_of([1.0, 2.0, 6.0], 3) == (9.0, 9.0, 9.0)
    assert total_of([2.0], 100) == (200.0, 2.0, math.inf)


def test_the_interval_holds_the_total_as_often_as_it_says() -> None:
    """2,000 samples of 8 of 200 rooms with normal costs: the share that holds the total is binomial about 0.95."""
    rng = np.random.default_rng(5)
    held, trials = 0, 2000
    for _ in range(trials):
        costs = rng.normal(10.0, 2.0, 200)
        estimate = total_of(rng.choice(costs, 8, replace=False), 200)
        held += estimate.low <= costs.sum() <= estimate.high
    assert abs(held / trials - CONFIDENCE) < 4.0 * math.sqrt(CONFIDENCE * (1.0 - CONFIDENCE) / trials)


@pytest.mark.parametrize(
    ("machines", "workers", "seconds"),
    [(1, 1, 1000.0), (1, 2, 500.0), (3, 1, 400.0), (10, 1, 100.0), (100, 4, 100.0)],
)
def test_workers_take_shards_in_rounds(machines: int, workers: int, seconds: float) -> None:
    """Ten shards of 100 s: three workers need four rounds, and more than ten are of no use."""
    assert seconds_on(Interval(1000.0, 1000.0, 1000.0), 10, machines, workers, 7.0).mean == pytest.approx(seconds + 7.0)


def test_rooms_of_a_sample_are_spread_and_each_type_has_as_many() -> None:
    assert sample_indices(100, 4, 1) == (12, 37, 62, 87)
    chosen = sample_indices(1000, 8, 3)
    assert len(chosen) == 9
    assert sorted(index % 3 for index in chosen) == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert sample_indices(3, 8, 1) == (0, 1, 2)
    assert sample_indices(4, 8, 3) == (0, 1, 2, 3)
