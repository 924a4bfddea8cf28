"""Points beside the middles of pixels that no neighbour sees."""

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from cached_rooms import look_up

from renderer import CameraConfig
from renderer.cached_frames.edges import FEW, MANY, OFFSETS, _is_lone, lift_lone
from renderer.core.kernel import from_python
from renderer.core.ray_packet import LANES

CAMERA = CameraConfig(width=64, height=48, horizontal_fov_rad=0.5)
AHEAD = pose((0, 0, 0), (0, 1, 0))
PIXEL_M = 2 * np.tan(0.25) * 2.0 / 64


def wall(left_px, right_px, luminance, depth_m=2.0):
    """What glows from one place to another, in pixels from the middle of the picture."""
    return quad((left_px * PIXEL_M, depth_m, -2), ((right_px - left_px) * PIXEL_M, 0, 0), (0, 0, 4), glow_cd_m2=luminance, color=(1, 1, 1))


def test_a_bar_that_no_middle_of_a_pixel_sees_shines_by_a_seventh():
    """It stands where one of seven points of an edge's pixel is; those right and left of the edge are lent."""
    flat = scene(wall(-60, 0.45, 20), wall(0.45, 60, 10), wall(0.8, 0.92, 1000, 1.99))
    row = look_up(flat, AHEAD, camera=CAMERA).radiance[24, :, 1]
    np.testing.assert_allclose(row[30:35], [20, 20, (3 * 20 + 3 * 10 + 1000) / 7, 10, 10], rtol=0.01)


def test_a_wire_between_the_middles_of_pixels_shines_by_what_it_covers():
    """It is half a pixel wide and stands before two of seven points of the pixels on both sides; only their corners tell of it."""
    wire = wall(-0.25, 0.25, 1000, 1.99)
    row = look_up(scene(wall(-60, 60, 10), wire), AHEAD, camera=CAMERA).radiance[10, :, 1]
    np.testing.assert_allclose(row[30:34], [10, (5 * 10 + 2 * 1000) / 7, (5 * 10 + 2 * 1000) / 7, 10], rtol=0.01)


@pytest.mark.parametrize("shown_by", ["mirror", "glass"])
def test_an_edge_in_a_mirror_or_behind_glass_is_as_smooth_as_others(shown_by):
    """It lies where two of the four points of a pixel see its one side, and two the other."""
    edge, far = (3 if shown_by == "mirror" else 2) * 0.45 * PIXEL_M, 4.0
    if shown_by == "mirror":
        before = quad((-2, 2, -2), (4, 0, 0), (0, 0, 4), metallic=1.0, roughness=0.0, color=(0.9, 0.9, 0.9))
        sides = [((0, 0, 18), (edge + 9, 0, 0), (-9, -2, -9), 20), ((0, 0, 18), (9 - edge, 0, 0), (edge, -2, -9), 10)]
    else:
        before = box((-2, 2, -2), (2, 2.01, 2), transmission=1.0, ior=1.5, roughness=0.0, color=(1, 1, 1))
        sides = [((edge + 9, 0, 0), (0, 0, 18), (-9, far, -9), 20), ((9 - edge, 0, 0), (0, 0, 18), (edge, far, -9), 10)]
    walls = [quad(corner, u, v, glow_cd_m2=glow, color=(1, 1, 1), name=f"{glow}/wall") for u, v, corner, glow in sides]
    row = look_up(scene(before, *walls), AHEAD, camera=CAMERA).radiance[10, :, 1]
    np.testing.assert_allclose(row[30:35] / row[30], [1, 1, 0.75, 0.5, 0.5], rtol=0.02)


@pytest.mark.parametrize("turn", [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8)])
@pytest.mark.parametrize("points", [FEW, MANY])
def test_points_of_a_pixel_lie_about_its_middle(turn, points):
    """An edge that moves across the pixels shines in the mean as much as it covers, whichever way it runs."""
    places = np.concatenate([np.zeros((1, 2)), OFFSETS[:points, [0, LANES]]]).astype(float)
    assert np.abs(places @ turn).sum() > 0.5 and abs((places @ turn).mean()) < 1e-6
    assert np.diff(np.unique((places @ turn).round(3))).max() < (0.4 if points == FEW else 0.27)


def test_what_covers_the_middle_of_a_pixel_and_little_else_leaves_no_dark_pixel():
    """A black plate of 0.2 x 0.9 pixels, before two of a pixel's seven points."""
    low, size = (0.35 * PIXEL_M, 1.99, 0.05 * PIXEL_M), (0.2 * PIXEL_M, 0.9 * PIXEL_M)
    plate = quad(low, (size[0], 0, 0), (0, 0, size[1]), color=(0, 0, 0), roughness=1.0)
    image = look_up(scene(wall(-60, 60, 10), plate), AHEAD, camera=CAMERA).radiance[..., 1]
    assert image.min() == pytest.approx(10 * 5 / 7, rel=0.02) and np.median(image) == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize(("dark", "found"), [(1, True), (2, True), (3, False)])
def test_dark_pixels_are_lone_with_one_other_beside_them(dark, found):
    image = np.full((3, 6, 3), 10, np.float32)
    image[1, 1 : 1 + dark] = 3
    assert bool(from_python(_is_lone)(image, 1 if dark < 3 else 2, 1)) == found


def test_a_dark_pixel_among_lighter_ones_is_lifted_and_a_dark_line_is_not():
    image = np.full((8, 9, 3), (12, 10, 8), np.float32)
    image[2, 3], image[2, 2], image[5:7, 6] = 0, (5, 4, 3), 0
    expected = image.copy()
    expected[2, 3] = 0.6 * image[2, 2]
    for first in (1, 0):
        lift_lone(image, first, 2)
    np.testing.assert_allclose(image, expected, rtol=1e-6)
