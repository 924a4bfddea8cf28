"""Points beside the middles of pixels that no neighbour sees."""

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from cached_rooms import look_up

from renderer import CameraConfig
from renderer.cached_frames.edges import FEW, MANY, OFFSETS
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
    """It lies where two of the seven points of a pixel see its one side, and five the other."""
    edge, far = (3 if shown_by == "mirror" else 2) * 0.45 * PIXEL_M, 4.0
    if shown_by == "mirror":
        before = quad((-2, 2, -2), (4, 0, 0), (0, 0, 4), metallic=1.0, roughness=0.0, color=(0.9, 0.9, 0.9))
        sides = [((0, 0, 18), (edge + 9, 0, 0), (-9, -2, -9), 20), ((0, 0, 18), (9 - edge, 0, 0), (edge, -2, -9), 10)]
    else:
        before = box((-2, 2, -2), (2, 2.01, 2), transmission=1.0, ior=1.5, roughness=0.0, color=(1, 1, 1))
        sides = [((edge + 9, 0, 0), (0, 0, 18), (-9, far, -9), 20), ((9 - edge, 0, 0), (0, 0, 18), (edge, far, -9), 10)]
    walls = [quad(corner, u, v, glow_cd_m2=glow, color=(1, 1, 1), name=f"{glow}/wall") for u, v, corner, glow in sides]
    row = look_up(scene(before, *walls), AHEAD, camera=CAMERA).radiance[10, :, 1]
    np.testing.assert_allclose(row[30:35] / row[30], [1, 1, (3 * 1 + 4 * 0.5) / 7, 0.5, 0.5], rtol=0.02)


def test_a_strip_of_rough_metal_that_no_middle_of_a_pixel_sees_is_an_even_line():
    """Its lobe shows a wall behind the camera that is bright on one side only: each ray sees all or nothing, by three of seven points."""
    strip = quad((0.55 * PIXEL_M, 1.99, -2), (0.5 * PIXEL_M, 0, 0), (0, 0, 4), metallic=1.0, roughness=0.4, color=(1, 1, 1))
    bright = quad((0, -3, -9), (0, 0, 18), (9, 0, 0), glow_cd_m2=100, color=(1, 1, 1))
    black = quad((-9, 2.5, -9), (18, 0, 0), (0, 0, 18), color=(0, 0, 0))
    column = look_up(scene(strip, bright, black), AHEAD, camera=CAMERA).radiance[4:44, 32, 1]
    assert column.mean() == pytest.approx(100 * 3 / 7 / 2, rel=0.05)
    assert column.std() < 0.2 * column.mean()


def places_of(points):
    """Return where a pixel of so many more points is sampled, (points + 1, 2), from its middle, in pixels."""
    return np.concatenate([np.zeros((1, 2)), OFFSETS[:points, [0, LANES]]]).astype(float)


@pytest.mark.parametrize(("points", "off"), [(FEW, 0.092), (MANY, 0.056)])
def test_points_of_a_pixel_tell_what_edges_cover(points, off):
    """Of edges across a pixel in every direction, as much on one side as on the other in the mean; ``off``: the root mean square error."""
    turns, at = np.meshgrid(np.linspace(0, 2 * np.pi, 360, endpoint=False), np.linspace(-0.75, 0.75, 301))
    way = np.stack([np.cos(turns.ravel()), np.sin(turns.ravel())])
    middles = (np.arange(40) + 0.5) / 40 - 0.5
    pixel = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    errors = []
    for w, beyond in zip(np.array_split(way, 60, axis=1), np.array_split(at.ravel(), 60), strict=True):
        errors.append((places_of(points) @ w > beyond).mean(axis=0) - (pixel @ w > beyond).mean(axis=0))
    error = np.concatenate(errors)
    assert abs(error.mean()) < 1e-3 and np.sqrt((error**2).mean()) < off


@pytest.mark.parametrize(("points", "gap"), [(FEW, 0.43), (MANY, 0.19)])
def test_points_of_pixels_beside_each_other_leave_no_wide_gaps_along_rows_and_columns(points, gap):
    """So slats, which run along rows or columns, hide no more of what is between them than that."""
    for along in np.sort(places_of(points), axis=0).T:
        assert np.diff(along, append=along[0] + 1.0).max() < gap


def test_what_covers_the_middle_of_a_pixel_and_little_else_leaves_no_dark_pixel():
    """A black plate of 0.2 x 0.9 pixels, before two of a pixel's seven points."""
    low, size = (0.35 * PIXEL_M, 1.99, 0.05 * PIXEL_M), (0.2 * PIXEL_M, 0.9 * PIXEL_M)
    plate = quad(low, (size[0], 0, 0), (0, 0, size[1]), color=(0, 0, 0), roughness=1.0)
    image = look_up(scene(wall(-60, 60, 10), plate), AHEAD, camera=CAMERA).radiance[..., 1]
    assert image.min() == pytest.approx(10 * 5 / 7, rel=0.02) and np.median(image) == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize("slats_cd_m2", [0.0, 10.0])
def test_slats_as_far_apart_as_pixels_let_through_as_much_light_as_shows_between_them(slats_cd_m2):
    """A blind of one part, all of whose slats look alike: no middle of a pixel tells that bright sky shows between two of them."""
    rise_px, pitch_px, count = 0.8, 1.12, 60
    pieces = [
        quad((-0.6, 2.0 - 0.4 * PIXEL_M, z * pitch_px * PIXEL_M), (1.2, 0, 0), (0, 0.4 * PIXEL_M, rise_px * PIXEL_M))
        for z in range(-count // 2, count // 2)
    ]
    vertices, faces = np.concatenate([piece.vertices for piece in pieces]), np.concatenate([pieces[0].faces + 4 * i for i in range(count)])
    blind = pieces[0]._replace(vertices=vertices, faces=faces, color=(0, 0, 0), roughness=1.0, glow_cd_m2=slats_cd_m2)
    image = look_up(scene(wall(-60, 60, 1000, 2.2), blind), AHEAD, camera=CAMERA).radiance[4:-4, 4:-4, 1]
    share = 1 - rise_px / pitch_px
    assert image.mean() == pytest.approx(1000 * share + slats_cd_m2 * (1 - share), rel=0.04)


def test_between_posts_a_wall_has_the_light_of_its_own_places_where_that_falls_off_within_a_few_pixels():
    """A strip of light hangs 6 cm before the wall; places a pixel apart, 16 mm, lend each other none."""
    lamp = quad((0.03, 1.94, -0.4), (-0.06, 0, 0), (0, 0, 0.8), emission=(1000.0,) * 3, color=(0, 0, 0))
    back = quad((-2, 2, -2), (4, 0, 0), (0, 0, 4), color=(0.8, 0.8, 0.8), roughness=1.0)
    # As seen: posts of 1.3 pixels, 3.1 apart.
    places = 0.5 * PIXEL_M * np.arange(-60, 60, 3.1)
    posts = [quad((x, 1.0, -2), (0.65 * PIXEL_M, 0, 0), (0, 0, 4), color=(0, 0, 0), roughness=1.0) for x in places]
    cached, traced = (
        look_up(scene(back, lamp, *posts), AHEAD, camera=CAMERA, **settings).radiance[14:-14, :, 1].mean(axis=0)
        for settings in ({"cache_spacing_m": 0.02}, {"integrator": "path", "samples_per_pixel": 256, "threads": 2})
    )
    assert np.abs(cached - traced).mean() < 0.1 * traced.mean()
