"""When small things come with growing clutter: counts, nesting, and how messy they lie."""

import itertools

import numpy as np
import pytest

from grammar.small_things.fill import arrival_levels, disorder, early_rate, mean_arrivals


def levels(seed: int, early: float, late: float, until: float) -> list[float]:
    return list(arrival_levels(np.random.default_rng(seed), early, late, until))


def test_what_the_grammar_stands_there_is_counted_but_a_quarter_comes_in_any_case() -> None:
    assert early_rate(4.0, 1.0) == 3.0 and early_rate(4.0, 9.0) == 1.0


def test_numbers_have_the_mean_of_the_counts_at_any_clutter() -> None:
    for early, late, until, expected in (
        (3.0, 4.0, 1.0, 3.0),
        (3.0, 4.0, 0.5, 1.5),
        (3.0, 4.0, 2.5, 9.0),
        (0.0, 2.0, 3.0, 4.0),
        (0.0, 2.0, 0.8, 0.0),
    ):
        assert mean_arrivals(early, late, until) == pytest.approx(expected)
        drawn = np.array([len(levels(seed, early, late, until)) for seed in range(600)])
        assert abs(drawn.mean() - expected) <= 4.0 * (expected / len(drawn)) ** 0.5 + 1e-12
    assert levels(0, 0.0, 0.0, 9.0) == [] and max(levels(1, 5.0, 0.0, 9.0)) < 1.0


def test_more_clutter_adds_to_what_is_there() -> None:
    several = [levels(5, 4.0, 6.0, until) for until in (0.0, 0.4, 1.0, 1.5, 3.0)]
    assert several[0] == [] and len(several[-1]) > len(several[1])
    for few, more in itertools.pairwise(several):
        assert more[: len(few)] == few and sorted(more) == more


def test_disorder_grows_from_clutter_1_to_3() -> None:
    assert [disorder(level) for level in (0.0, 1.0, 2.0, 3.0, 9.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]
