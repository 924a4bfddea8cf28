"""Metered exposure against ISO 2720, on scenes of known luminance."""

import math

import pytest
from box_room import box, pose, scene

from renderer import CameraConfig, RenderConfig
from renderer.exposure import METER_CONSTANT, meter_ev100

VIEW = pose((0.0, 0.0, 1.0), (1.0, 0.2, 1.0))
CAMERA = CameraConfig(width=320, height=240)


def metered(luminance: float, views: int = 1) -> float:
    shining = box((-2, -2, 0), (2, 2, 2), inside=True, color=(0.0, 0.0, 0.0), emission=(luminance,) * 3)
    return meter_ev100(scene(shining), CAMERA, RenderConfig(threads=1), 5, [VIEW] * views)


@pytest.mark.parametrize("ev100", [-1.0, 3.0, 6.5, 12.0])
@pytest.mark.parametrize("views", [1, 2, 9])
def test_an_even_room_is_metered_as_the_standard_says(ev100: float, views: int) -> None:
    assert metered(METER_CONSTANT / 100.0 * 2.0**ev100, views) == ev100


def test_steps_are_eighths_and_the_next_one_begins_half_way() -> None:
    base = METER_CONSTANT / 100.0 * 2.0**5
    assert metered(base * 2.0**0.05) == 5.0
    assert metered(base * 2.0**0.07) == 5.125


def test_a_dark_room_has_an_exposure_too() -> None:
    assert math.isfinite(metered(0.0))
