"""Points beside the middles of pixels that no neighbour sees."""

import numpy as np
from box_room import pose, quad, scene
from cached_rooms import look_up

from renderer import CameraConfig

CAMERA = CameraConfig(width=64, height=48, horizontal_fov_rad=0.5)
AHEAD = pose((0, 0, 0), (0, 1, 0))
PIXEL_M = 2 * np.tan(0.25) * 2.0 / 64


def wall(left_px, right_px, luminance, depth_m=2.0):
    """What glows from one place to another, in pixels from the middle of the picture."""
    return quad((left_px * PIXEL_M, depth_m, -2), ((right_px - left_px) * PIXEL_M, 0, 0), (0, 0, 4), glow_cd_m2=luminance, color=(1, 1, 1))


def test_a_bar_that_no_middle_of_a_pixel_sees_shines_by_a_quarter():
    """It stands where one of four points of an edge's pixel is; those right and left of the edge are lent."""
    flat = scene(wall(-60, 0.45, 20), wall(0.45, 60, 10), wall(0.56, 0.7, 1000, 1.99))
    row = look_up(flat, AHEAD, camera=CAMERA).radiance[24, :, 1]
    np.testing.assert_allclose(row[30:35], [20, 20, (10 + 20 + 1000 + 10) / 4, 10, 10], rtol=0.01)
