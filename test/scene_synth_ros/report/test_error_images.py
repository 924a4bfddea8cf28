"""Errors of images against hand-made pixels, and their scales."""

import numpy as np
import pytest

from scene_synth_ros.report.error_images import (
    DIVERGING,
    ERROR_IMAGES,
    RIGHT_WRONG,
    UNKNOWN,
    angle_deg,
    confusions,
    error_picture,
    legend,
    matched_objects,
    median_scaled,
    metres,
    same_size,
    scale_end,
)

NAN = np.nan


def test_depth_is_compared_in_metres_where_both_have_it() -> None:
    row = ERROR_IMAGES["depth"]
    truth, guess = np.array([[1.0, 2.0, np.inf, 1.0]], np.float32), np.array([[1500, 1000, 700, 0]], np.uint16)
    np.testing.assert_allclose(row.of(row.read(truth), row.read(guess)), [[0.5, -1.0, NAN, NAN]], atol=1e-6)
    np.testing.assert_allclose(median_scaled(metres(truth), metres(truth) * 4.0), metres(truth))


def test_angles_flows_and_ids() -> None:
    up, right, none = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    np.testing.assert_allclose(angle_deg(np.array([[up, up, none]]), np.array([[right, up, up]])), [[90.0, 0.0, NAN]], atol=1e-5)
    flow = ERROR_IMAGES["flow"].of(np.array([[(0.0, 0.0), (NAN, 0.0)]]), np.array([[(3.0, 4.0), (1.0, 1.0)]]))
    np.testing.assert_allclose(flow, [[5.0, NAN]])
    np.testing.assert_array_equal(ERROR_IMAGES["semantic"].of(np.array([[1, 2, 0]]), np.array([[1, 3, 3]])), [[0.0, 1.0, NAN]])


def test_objects_have_the_id_of_the_true_object_that_they_cover_most() -> None:
    """Estimate 7 covers most of object 1 and 9 of object 2; 8 has the rest of 1, which is taken, so it gets an id of its own."""
    truth, guess = np.array([[1, 1, 1, 2, 2, 0]]), np.array([[7, 7, 8, 9, 9, 0]])
    np.testing.assert_array_equal(matched_objects(truth, guess), [[1, 1, 3, 2, 2, 0]])
    np.testing.assert_array_equal(ERROR_IMAGES["instance"].of(truth, matched_objects(truth, guess)), [[0, 0, 1, 0, 0, NAN]])


def test_confusions_are_told_with_their_share() -> None:
    truth, guess = np.array([[1, 1, 1, 2, 2, 2, 2, 2, 0, 0]]), np.array([[1, 3, 3, 0, 2, 2, 2, 2, 5, 5]])
    assert confusions(truth, guess, {1: "wall", 3: "bed", 2: "floor"}) == "wall taken for bed 25 %, floor taken for none 12 %"
    assert confusions(truth, truth, {}) == ""


def test_estimates_of_another_size_are_brought_to_that_of_the_truth() -> None:
    np.testing.assert_array_equal(same_size(np.zeros((2, 4)), np.array([[5, 6]])), [[5, 5, 6, 6]] * 2)


@pytest.mark.parametrize(("largest", "end"), [(0.1, 0.1), (0.11, 0.2), (3.0, 5.0), (70.0, 100.0), (0.0, 1.0)])
def test_scales_end_at_round_numbers(largest: float, end: float) -> None:
    assert scale_end([np.full((4, 4), -largest, np.float32), np.array([[NAN]], np.float32)]) == pytest.approx(end)
    assert scale_end([]) == 1.0


def test_colours_are_those_of_the_legend() -> None:
    row = ERROR_IMAGES["depth"]
    picture = error_picture(np.array([[-0.2, 0.0, 9.0, NAN]], np.float32), row, 0.2)
    expected = [DIVERGING[0], DIVERGING[2], DIVERGING[4], UNKNOWN]
    np.testing.assert_array_equal(picture[0], np.rint(np.array(expected) * 255.0))
    told = legend(row, 0.2)
    assert told["ticks"] == ["≤ -0.2 m", "0 m", "≥ 0.2 m"] and told["colors"][0] == picture[0, 0].tolist()
    assert legend(ERROR_IMAGES["semantic"], 1.0)["names"] == ["right", "wrong", "no truth"]
    picture = error_picture(np.array([[0.0, 1.0]], np.float32), ERROR_IMAGES["semantic"], 1.0)
    np.testing.assert_array_equal(picture[0], np.rint(np.array(RIGHT_WRONG) * 255.0))
