"""Sizes of rooms and kernels from numbers made by hand."""

import pytest
from small_grammar import CATEGORIES

from grammar import read_room_type
from grammar.learning import ObservedRoom
from grammar.learning.sizes import learn_room, learn_size

BASE = read_room_type("bedroom", CATEGORIES)


def room(width_m: float, depth_m: float) -> ObservedRoom:
    polygon = ((0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m))
    return ObservedRoom(id="r", house="r", room_type="bedroom", polygon_m=polygon, height_m=2.5, objects=())


def test_room() -> None:
    # Sides 3, 4, 3, 4: mean 3.5, standard deviation 0.5; floor shares 3/12, 6/12: the upper quartile between them is 0.4375.
    learned = learn_room(BASE.room, [room(3.0, 4.0), room(4.0, 3.0)], [3.0, 6.0])
    assert (learned.width_m.mean, learned.width_m.sd) == (pytest.approx(3.5), pytest.approx(0.5))
    assert learned.depth_m == learned.width_m
    assert learned.floor_share_max == pytest.approx(0.4375)
    assert learn_room(BASE.room, [room(3.0, 4.0)], [1.0]).floor_share_max == BASE.room.floor_share_max


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
