"""Edges of what is thinner than a pixel, beside the share of the pixels that it covers."""

import numpy as np
import pytest
from box_room import pose, quad, scene
from cached_rooms import look_up

from renderer import CameraConfig

CAMERA = CameraConfig(width=64, height=48, horizontal_fov_rad=0.5)
AHEAD = pose((0, 0, 0), (0, 1, 0))
PIXEL_M = 2 * np.tan(0.25) * 2.0 / 64


def stripes(width_px: float, count: int = 40):
    """Upright stripes that glow 2 m ahead, 2.37 pixels apart, before a wall that is dark."""
    lefts = (np.arange(count) - count / 2) * 2.37 * PIXEL_M
    bars = [quad((x, 2, -1), (width_px * PIXEL_M, 0, 0), (0, 0, 2), glow_cd_m2=100.0, color=(1, 1, 1)) for x in lefts]
    return scene(*bars, quad((-2, 2.2, -2), (4, 0, 0), (0, 0, 4), color=(0, 0, 0), glow_cd_m2=1.0))


@pytest.mark.parametrize("width_px", [0.3, 0.7])
def test_bars_thinner_than_a_pixel_are_as_bright_as_what_they_cover(width_px):
    image = look_up(stripes(width_px), AHEAD, camera=CAMERA).radiance[..., 1].astype(float)
    assert image.mean() == pytest.approx(100 * width_px / 2.37, rel=0.12)


def test_a_sample_that_no_neighbour_sees_has_its_own_light():
    """A bar between the middles of two columns of pixels: one sample of four meets it beside an edge that is one anyway."""
    bar = quad((0.3 * PIXEL_M, 1.99, -1), (0.12 * PIXEL_M, 0, 0), (0, 0, 2), glow_cd_m2=1000.0, color=(1, 1, 1))
    right = quad((0.45 * PIXEL_M, 2, -2), (2, 0, 0), (0, 0, 4), glow_cd_m2=10.0, color=(1, 1, 1))
    left = quad((-2 + 0.45 * PIXEL_M, 2, -2), (2, 0, 0), (0, 0, 4), glow_cd_m2=20.0, color=(1, 1, 1))
    column = look_up(scene(bar, right, left), AHEAD, camera=CAMERA).radiance[24, :, 1]
    assert column.max() > 200.0
