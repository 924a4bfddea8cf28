"""Sizes of rooms and kernels from numbers made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import read_room_type
from grammar.learning import ObservedRoom
from grammar.learning.sizes import height_modes, is_norm, learn_room, learn_size
from grammar.spec.object_rules import ObjectRule, SizeMode

BASE = read_room_type("bedroom", CATEGORIES)


def room(width_m: float, depth_m: float) -> ObservedRoom:
    polygon = ((0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m))
    return ObservedRoom(id="r", house="r", room_type="bedroom", polygon_m=polygon, height_m=2.5, objects=())


def test_room() -> None:
    # Sides 3, 4, 3, 4: mean 3.5, standard deviation 0.5; less than a fifth of the floor is covered, so the area does not follow from that.
    learned = learn_room(BASE.room, [room(3.0, 4.0), room(4.0, 3.0)], [1.2, 2.4], 0.0)
    assert (learned.width_m.mean, learned.width_m.sd) == (pytest.approx(3.5), pytest.approx(0.5))
    assert learned.depth_m == learned.width_m
    assert (learned.floor_share_max, learned.shapes.rectangle) == (BASE.room.floor_share_max, 1.0)
    # Both rooms are a kernel, of one size whichever way they lie.
    assert [(mode.probability, mode.mean_m, mode.floor_share) for mode in learned.sizes] == [(0.5, (4.0, 3.0), None)] * 2


def test_sizes_are_learned_with_the_share_that_furniture_covers() -> None:
    # Shares 3/12 and 6/12; the niche of a door, 0.1 m deep and 0.8 m wide, is none of the outline.
    niche = ((0.0, 0.0), (1.0, 0.0), (1.0, -0.1), (1.8, -0.1), (1.8, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
    learned = learn_room(BASE.room, [replace(room(3.0, 4.0), polygon_m=niche), room(4.0, 3.0)], [3.0, 6.0], 2.0)
    assert [mode.floor_share for mode in learned.sizes] == pytest.approx([0.25, 0.5])
    assert learned.floor_share_max == pytest.approx(0.5)
    # Two rectangles and two pseudo-counts of the base.
    assert learned.shapes.rectangle == pytest.approx((2.0 + 2.0 * BASE.room.shapes.rectangle) / 4.0, abs=1e-4)


def test_notches_of_an_l_are_learned_as_shares_of_its_sides() -> None:
    # 1 of 5 m and 2 of 4 m, either way round.
    bent = ((0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (4.0, 2.0), (4.0, 4.0), (0.0, 4.0))
    turned = tuple((-y, x) for x, y in bent)
    rooms = [replace(room(1.0, 1.0), polygon_m=polygon) for polygon in (bent, turned, bent)]
    shapes = learn_room(BASE.room, [*rooms, room(4.0, 3.0)], [6.0] * 4, 0.0).shapes
    assert np.allclose(shapes.notches, [(0.2, 0.5)] * 3) and shapes.notch_sd == pytest.approx(0.02)
    assert (shapes.l_shape, shapes.rectangle) == (0.75, 0.25)
    # Two of them teach no more than how many there are.
    assert learn_room(BASE.room, rooms[:2], [6.0] * 2, 0.0).shapes.notches == ()
    # A grammar holds 64 at most, of many those of every so many-th room.
    many = learn_room(BASE.room, [*rooms, *rooms[:1]] * 25, [6.0] * 100, 0.0).shapes.notches
    assert len(many) == 64 and np.allclose(many, [(0.2, 0.5)] * 64)


def test_halls_keep_the_width_of_their_arms_and_stay_bare() -> None:
    # An L of arms 1 m wide in 5 by 3 m: 7 m2; half of the halls are bare, the others hold a tenth.
    bent = ((0.0, 0.0), (5.0, 0.0), (5.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))
    rooms = [room(4.0, 1.0), room(4.1, 1.0), replace(room(1.0, 1.0), polygon_m=bent), replace(room(1.0, 1.0), polygon_m=bent)]
    modes = learn_room(BASE.room, rooms, [0.0, 0.41, 0.0, 0.7], 0.0).sizes
    assert [mode.mean_m for mode in modes] == [pytest.approx(sides) for sides in ((4.0, 1.0), (4.1, 1.0), (5.0, 3.0), (5.0, 3.0))]
    assert [mode.arm_m for mode in modes] == [None, None, pytest.approx(1.0), pytest.approx(1.0)]
    assert [mode.floor_share for mode in modes] == pytest.approx([0.01, 0.1, 0.01, 0.1])
    assert [mode.share_sd < 0.011 for mode in modes] == [True, False, True, False]


def test_a_side_of_rooms_that_recurs_exactly_is_kept() -> None:
    rooms = [room(2.8, 3.0 + 0.1 * k) for k in range(6)]
    modes = learn_room(BASE.room, rooms, [1.0] * 6, 0.0).sizes
    assert all(mode.sd_m[1] < 0.001 < mode.sd_m[0] for mode in modes)


def test_heights_that_recur_are_kept_and_others_are_smoothed() -> None:
    once, often = height_modes(np.array([1.2, 1.5, 1.5, 1.5]))
    assert (once.mean_m, once.probability) == (pytest.approx(1.2), 0.25)
    assert (often.mean_m, often.probability) == (pytest.approx(1.5), 0.75)
    assert often.sd_m < 0.001 < once.sd_m


def test_other_room_types_count_as_pseudo_observations() -> None:
    # Two own sizes that do not tell each other and a pool of 2: each share a half, those of equal sizes a quarter each.
    rule = BASE.objects["nightstand"]
    modes = learn_size(rule, [(0.4, 0.4, 0.5), (0.5, 0.7, 0.6)], 2.0, [(0.4, 0.4, 0.5), (0.5, 0.7, 0.6)], 2.0).sizes
    assert [mode.probability for mode in modes] == pytest.approx([1 / 4] * 4, abs=0.02)
    # A model of the room type's own, which others do not have: six observations against the one that may come.
    modes = learn_size(rule, [(0.4, 0.5, 0.5)] * 6, 2.0, [(0.5, 0.6, 0.5), (0.5, 0.7, 0.5)], 2.0).sizes
    assert [mode.probability for mode in modes] == pytest.approx([6 / 7, 1 / 14, 1 / 14])
    assert [mode.mean_m[1] for mode in modes] == pytest.approx([0.5, 0.6, 0.7])


def test_a_side_that_the_base_holds_close_is_a_norm_and_stays_where_no_model_recurs() -> None:
    mode = SizeMode(mean_m=(0.62, 0.8, 0.9), sd_m=(0.0001, 0.1, 0.0003))
    rule = ObjectRule(category="kitchen_counter", sizes=(mode,), low_m=(0.6199, 0.3, 0.899), high_m=(0.6201, 1.2, 0.901))
    learned = learn_size(rule, [(0.5, 0.7, 0.87), (0.6, 1.4, 0.86)], 1.0, [(0.4, 0.5, 0.7)], 2.0)
    assert {(mode.mean_m[0], mode.mean_m[2], mode.sd_m[0]) for mode in learned.sizes} == {(0.62, 0.9, 0.0001)}
    assert (learned.low_m, learned.high_m) == ((0.6199, 0.3, 0.899), (0.6201, 1.4, 0.901))
    assert sorted(mode.mean_m[1] for mode in learned.sizes) == pytest.approx([0.5, 0.7, 1.4])
    assert is_norm(1.818, 1.822) and not is_norm(1.7, 2.0)


def test_a_norm_becomes_that_of_the_data_where_models_recur() -> None:
    mode = SizeMode(mean_m=(0.62, 0.8, 0.9), sd_m=(0.0001, 0.1, 0.0003))
    rule = ObjectRule(category="kitchen_counter", sizes=(mode,), low_m=(0.6199, 0.3, 0.899), high_m=(0.6201, 1.2, 0.901))
    # heights that do not recur, or are far from the most common one, are taken for the nearest that is; depths are kept
    seen = [(0.627, 0.5, 0.871)] * 4 + [(0.6, 0.7, 0.86), (0.58, 0.6, 1.26), (0.58, 0.6, 1.26), (0.58, 0.6, 1.26)]
    learned = learn_size(rule, seen, 1.0)
    assert {mode.mean_m[2] for mode in learned.sizes} == {0.871}
    assert sorted({mode.mean_m[0] for mode in learned.sizes}) == [0.58, 0.6, 0.627]
    assert learned.sizes[0].mean_m[0] == 0.627  # the base's own component
    assert max(mode.sd_m[0] for mode in learned.sizes) < 0.001
    assert (learned.low_m[2], learned.high_m[2]) == pytest.approx((0.8705, 0.8715))


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


@pytest.mark.parametrize(
    ("heights", "mean", "high"),
    [
        ([2.5] * 19 + [7.9], 2.5, 2.51),
        ([2.4, 2.5, 2.6] * 6 + [7.9], 2.5, 2.6),
        ([2.5] * 19 + [1.5], 2.5, 2.51),
        ([2.5] * 3 + [3.0] * 17, 2.925, 3.0),
        ([2.5, 3.0, 3.5, 4.0, 4.5, 5.0], 3.75, 5.0),
    ],
)
def test_a_ceiling_far_from_all_others_is_taken_for_measured_wrongly(heights: list[float], mean: float, high: float) -> None:
    rooms = [replace(room(3.0, 4.0), height_m=height) for height in heights]
    learned = learn_room(BASE.room, rooms, [1.0] * len(rooms), 0.0).height_m
    assert (learned.mean, learned.high) == (pytest.approx(mean), pytest.approx(high))


def test_furniture_that_overlaps_covers_the_whole_floor_at_most() -> None:
    sizes = learn_room(BASE.room, [room(3.0, 4.0)] * 9, [6.0] * 8 + [60.0], 0.0).sizes
    assert sorted(size.floor_share for size in sizes) == [0.5] * 8 + [1.0]
    assert max(size.share_sd for size in sizes) < 0.2
