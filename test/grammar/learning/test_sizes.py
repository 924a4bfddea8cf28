"""Sizes of rooms and kernels from numbers made by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import read_room_type
from grammar.derivation.densities import draw_truncated_normal, draw_with_log_density
from grammar.learning import ObservedRoom
from grammar.learning.sizes import fitted_normal, learn_room, learn_size, quartile_normal

BASE = read_room_type("bedroom", CATEGORIES)


def room(width_m: float, depth_m: float) -> ObservedRoom:
    polygon = ((0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m))
    return ObservedRoom(id="r", house="r", room_type="bedroom", polygon_m=polygon, height_m=2.5, objects=())


def test_room() -> None:
    # Sides 3, 4, 3, 4: mean 3.5, standard deviation 0.5; less than a fifth of the floor is covered, so the area does not follow from that.
    learned = learn_room(BASE.room, [room(3.0, 4.0), room(4.0, 3.0)], [1.2, 2.4], 0.0)
    assert (learned.width_m.mean, learned.width_m.sd) == (pytest.approx(3.5), pytest.approx(0.5))
    assert learned.depth_m == learned.width_m
    assert (learned.floor_share_max, learned.floor_share, learned.shapes.rectangle) == (BASE.room.floor_share_max, None, 1.0)


def test_area_follows_from_the_furniture_where_that_covers_much() -> None:
    # Shares 3/12 and 6/12, proportion 4/3 throughout; the niche of a door, 0.1 m deep and 0.8 m wide, is none of the outline.
    niche = ((0.0, 0.0), (1.0, 0.0), (1.0, -0.1), (1.8, -0.1), (1.8, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
    learned = learn_room(BASE.room, [replace(room(3.0, 4.0), polygon_m=niche), room(4.0, 3.0)], [3.0, 6.0], 2.0)
    assert learned.floor_share is not None
    assert learned.proportion is not None
    assert (learned.floor_share.mean, learned.floor_share.low, learned.floor_share.high) == pytest.approx((0.375, 0.25, 0.5))
    assert learned.proportion.mean == pytest.approx(4.0 / 3.0)
    assert learned.floor_share_max == pytest.approx(0.5)
    # Two rectangles and two pseudo-counts of the base.
    assert learned.shapes.rectangle == pytest.approx((2.0 + 2.0 * BASE.room.shapes.rectangle) / 4.0, abs=1e-4)


def test_a_normal_that_gathers_at_its_bound() -> None:
    values = np.array([draw_truncated_normal(np.random.default_rng(k), 1.3, 0.2, 0.7, 1.25) for k in range(400)])
    fitted = fitted_normal(values)
    drawn = [draw_truncated_normal(np.random.default_rng(1000 + k), fitted.mean, fitted.sd, fitted.low, fitted.high) for k in range(400)]
    # The means of both samples differ by no more than four standard errors.
    assert float(np.mean(drawn)) == pytest.approx(float(values.mean()), abs=4.0 * float(values.std()) * math.sqrt(2.0 / 400.0))


def test_other_room_types_count_as_pseudo_observations() -> None:
    # Six own observations and a pool of 2: the own kernels share 6/8, the pooled ones 2/8, those of equal sizes 1/8 each.
    rule = BASE.objects["nightstand"]
    modes = learn_size(rule, [(0.4, 0.5, 0.5)] * 6, 2.0, [(0.5, 0.6, 0.5), (0.5, 0.7, 0.5)], 2.0).sizes
    assert [mode.probability for mode in modes] == pytest.approx([6 / 8, 1 / 8, 1 / 8])
    assert [mode.mean_m[1] for mode in modes] == pytest.approx([0.5, 0.6, 0.7])


def test_a_side_that_recurs_exactly_is_kept() -> None:
    seen = [(0.32, 0.9 + 0.01 * k, 0.5) for k in range(6)]
    modes = learn_size(BASE.objects["dresser"], seen, 0.0).sizes
    assert all(mode.sd_m[0] < 0.001 and mode.sd_m[2] < 0.001 < mode.sd_m[1] for mode in modes)


def test_equal_sizes_share_a_kernel_and_the_base_keeps_alpha() -> None:
    rule = BASE.objects["nightstand"]
    (old,) = rule.sizes
    kept, often, once = learn_size(rule, [(0.4, 0.5, 0.5)] * 5 + [(0.5, 0.7, 0.5)], 2.0).sizes
    assert (kept.mean_m, kept.probability) == (old.mean_m, pytest.approx(2 / 8))
    assert (often.mean_m, often.probability) == (pytest.approx((0.4, 0.5, 0.5)), pytest.approx(5 / 8))
    assert (once.mean_m, once.probability) == (pytest.approx((0.5, 0.7, 0.5)), pytest.approx(1 / 8))
    assert learn_size(rule, [(0.4, 0.5, 0.5), (0.5, 0.7, 0.5)], 2.0).high_m[1] == pytest.approx(0.7)


def test_many_sizes_are_merged_with_their_moments() -> None:
    seen = [(0.4 + 0.001 * k, 0.5, 0.5) for k in range(60)]
    modes = learn_size(BASE.objects["nightstand"], seen, 0.0).sizes
    assert len(modes) == 24
    assert sum(mode.probability for mode in modes) == pytest.approx(1.0)
    assert sum(mode.probability * mode.mean_m[0] for mode in modes) == pytest.approx(0.4295)


def test_the_quartiles_of_rooms_that_are_not_made_for_furniture_are_kept() -> None:
    # a long tail: the median of what is learned is that of the rooms, higher or lower by little
    seen = np.array([1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 2.0, 2.2, 2.5, 3.0, 7.0, 8.0, 9.0])
    learned = quartile_normal(seen)
    assert (learned.low, learned.high) == (1.1, 9.0)
    rng = np.random.default_rng(0)
    drawn = [draw_with_log_density(rng, learned)[0] for _ in range(4000)]
    assert float(np.median(drawn)) == pytest.approx(1.8, abs=0.2)
