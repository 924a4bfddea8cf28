"""Descriptions have 12 digits, whatever the last ones of a machine are."""

import math

from sample_scene import sample_scene

from scene_description import scene_to_json
from scene_description.rounding import rounded


def test_last_digits_cancelled_terms_and_signs_of_zero_go() -> None:
    assert rounded((0.1 + 0.2, 1e5 / 3.0, math.cos(math.pi / 2), -0.0, {"a": 2.0 / 3.0}, 7, "x")) == (
        0.3,
        33333.3333333,
        0.0,
        0.0,
        {"a": 0.666666666667},
        7,
        "x",
    )
    assert math.copysign(1.0, rounded(-0.0)) == 1.0


def test_a_rounded_scene_stays_as_it_is() -> None:
    once = rounded(sample_scene())
    assert scene_to_json(rounded(once)) == scene_to_json(once)
