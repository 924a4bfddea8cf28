"""Mixtures against numbers that the data was drawn with."""

import math

import numpy as np
import pytest

from grammar.learning.mixtures import FLUSH_M, Component, gap_mixture, place_mixture


def test_two_gaps_come_back_with_their_shares_and_scales() -> None:
    rng = np.random.default_rng(1)
    near, far = rng.laplace(0.3, 0.02, 600), rng.laplace(1.0, 0.05, 300)
    first, second = sorted(gap_mixture([*near, *far], 0.004), key=lambda part: part.middle)
    # four standard errors: of the share 0.06, of a median about b / sqrt(n), of a scale b / sqrt(n)
    assert (first.share, first.middle[0], first.scale) == (pytest.approx(2 / 3, abs=0.06), pytest.approx(0.3, abs=0.004),
                                                           pytest.approx(0.02, abs=0.0035))  # fmt: skip
    assert (second.middle[0], second.scale) == (pytest.approx(1.0, abs=0.012), pytest.approx(0.05, abs=0.012))


def test_a_scale_at_the_wall_is_that_of_the_cut_density() -> None:
    # exponential gaps: middle at the wall, scale their mean; an uncut fit would put the median and half the scale there
    gaps = np.random.default_rng(2).exponential(0.05, 2000)
    (part,) = gap_mixture(list(gaps), 0.001)
    assert part.middle[0] < 0.01
    assert part.scale == pytest.approx(0.05, rel=0.1)


def test_places_in_a_plane() -> None:
    rng = np.random.default_rng(3)

    def cloud(x: float, y: float, scale: float, count: int) -> list[tuple[float, float]]:
        radius, angle = rng.gamma(2.0, scale, count), rng.uniform(0, 2 * np.pi, count)
        return list(zip((x + radius * np.cos(angle)).tolist(), (y + radius * np.sin(angle)).tolist(), strict=True))

    parts = sorted(place_mixture(cloud(0.0, 0.0, 0.02, 400) + cloud(0.1, 0.8, 0.04, 200), 0.004), key=lambda part: part.middle[1])
    assert len(parts) == 2
    assert parts[0].share == pytest.approx(2 / 3, abs=0.05)
    assert parts[0].middle == pytest.approx((0.0, 0.0), abs=0.01)
    assert parts[1].middle == pytest.approx((0.1, 0.8), abs=0.02)
    assert [part.scale for part in parts] == pytest.approx([0.02, 0.04], rel=0.2)


@pytest.mark.parametrize("values", [[0.1], [0.1, 0.1], [0.2] * 50, [0.0] * 9])
def test_few_or_equal_gaps_are_one_component(values: list[float]) -> None:
    (part,) = gap_mixture(values, 0.004)
    assert (part.share, part.middle[0]) == (pytest.approx(1.0), pytest.approx(values[0]))
    # What is flush is as narrow as records tell, all else at least as wide as asked.
    assert (FLUSH_M if values[0] == 0.0 else 0.004) <= part.scale < 0.01


def test_flush_and_spread_gaps_come_back_as_they_were_drawn() -> None:
    # Three tenths touch the wall, recorded as 0; the others fall off from 3 cm with a length of 1 cm.
    rng, count = np.random.default_rng(5), 600
    spread = np.abs(0.03 + rng.laplace(0.0, 0.01, int(0.7 * count)))
    flush, wide = sorted(gap_mixture([*([0.0] * int(0.3 * count)), *spread.tolist()], 0.004), key=lambda part: part.middle[0])[:2]
    assert flush.share == pytest.approx(0.3, abs=4.0 * math.sqrt(0.3 * 0.7 / count))
    assert (flush.middle[0], flush.scale) == (0.0, FLUSH_M)
    assert wide.middle[0] == pytest.approx(0.03, abs=0.003)
    assert wide.scale == pytest.approx(0.01, rel=4.0 / math.sqrt(0.7 * count) + 0.05)


def test_one_gap_far_beyond_all_others_does_not_widen_these() -> None:
    near, far = gap_mixture([0.003, 0.006, 0.01, 0.014, 0.7], 0.004)
    assert near.share == pytest.approx(0.8) and near.scale < 0.01
    assert far == Component(pytest.approx(0.2), (0.0,), pytest.approx(0.7))
