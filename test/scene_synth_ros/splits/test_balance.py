"""Weights of classes and frames against numbers worked out by hand."""

import math

from scene_synth_ros.splits.balance import ClassBalance, class_balance, frame_weights

FRAMES = [{"wall": 90, "bed": 10}] * 9 + [{"wall": 50, "bed": 25, "plant": 25}]


def test_frames_with_rare_classes_are_drawn_more_often() -> None:
    assert frame_weights(FRAMES, 0.1) == [1.0] * 10
    weights = frame_weights(FRAMES, 0.4)
    assert weights == [1.0] * 9 + [2.0], "sqrt(0.4 / 0.1)"
    assert frame_weights([{}, {"bed": 3}], 0.1) == [1.0, 1.0]


def test_classes_weigh_the_median_frequency_over_their_own() -> None:
    found = class_balance(FRAMES, frame_weights(FRAMES, 0.4))
    assert list(found) == ["bed", "plant", "wall"]
    assert found["plant"] == ClassBalance(frames=1, pixels=0.025, weight=1.0, drawn=round(2.0 / 11.0, 6)), "of median frequency: 25 / 100"
    assert found["bed"].weight == round(0.25 / (115 / 1000), 6) and found["wall"].weight == round(0.25 / (860 / 1000), 6)
    assert math.isclose(sum(one.pixels for one in found.values()), 1.0) and found["wall"].drawn == 1.0


def test_no_frames_have_no_classes() -> None:
    assert frame_weights([], 0.1) == [] and class_balance([], []) == {}
