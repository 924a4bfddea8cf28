"""When small things come with growing clutter: counts, nesting, and how messy they lie."""

import itertools

import numpy as np
import pytest

from grammar.small_things.arrivals import arrival_levels, disorder, mean_arrivals


def levels(seed: int, count: float, there: float, begins: float, until: float) -> list[float]:
    return list(arrival_levels(np.random.default_rng(seed), count, there, begins, until))


def test_numbers_have_the_mean_of_the_counts_at_any_clutter() -> None:
    for count, there, begins, until, expected in (
        (4.0, 1.0, 0.0, 1.0, 3.0),  # what the grammar stands there is counted
        (4.0, 9.0, 0.0, 1.0, 1.0),  # but a quarter comes in any case
        (4.0, 1.0, 0.0, 0.5, 1.5),
        (4.0, 1.0, 0.0, 2.5, 9.0),
        (2.0, 0.0, 1.0, 3.0, 4.0),
        (2.0, 0.0, 1.0, 0.8, 0.0),
    ):
        assert mean_arrivals(count, there, begins, until) == pytest.approx(expected)
        drawn = np.array([len(levels(seed, count, there, begins, until)) for seed in range(600)])
        assert abs(drawn.mean() - expected) <= 4.0 * (expected / len(drawn)) ** 0.5 + 1e-12


def test_more_clutter_adds_to_what_is_there() -> None:
    several = [levels(5, 6.0, 2.0, 0.0, until) for until in (0.0, 0.4, 1.0, 1.5, 3.0)]
    assert several[0] == [] and len(several[-1]) > len(several[1])
    for few, more in itertools.pairwise(several):
        assert more[: len(few)] == few and sorted(more) == more


def test_disorder_grows_from_clutter_1_to_3() -> None:
    assert [disorder(level) for level in (0.0, 1.0, 2.0, 3.0, 9.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]
