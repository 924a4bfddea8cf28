"""Layers of traced light against known answers: a small lamp above a floor with a wall on it, furnaces, mirrors, panes and the sun."""

import numpy as np
import pytest
from box_room import DARK, VIEW, box, furnished_room, pierced, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import pose_camera

LIGHT = ("radiance", "direct", "indirect", "shadow")
BLACK = (0.0, 0.0, 0.0)
CAMERA = CameraConfig(width=64, height=48, horizontal_fov_rad=1.0)


def render(flat, view, layers=(*LIGHT, "depth"), camera=CAMERA, **settings):
    config = RenderConfig(**{"samples_per_pixel": 16, "threads": 2, "max_depth": 6} | settings)
    with Renderer(flat, camera, config, 11) as renderer:
        return renderer.render(view, 0, layers).layers


def points_seen(view, depth):
    """World points (height, width, 3) of a pinhole's depth."""
    camera = pose_camera(CAMERA, view)
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width] + 0.5
    ways = np.stack([(u - 32) / camera.focal_px, (v - 24) / camera.focal_px, np.ones_like(u)], axis=-1)
    return (ways * depth[..., None]) @ camera.rotation.T.astype(float) + np.array(view.position_m)


def test_a_floor_under_a_small_lamp_has_the_light_and_the_shadow_of_geometry():
    """E = L A cos^2 / d^2; a wall 1 m high at y = 0.5 shades the floor up to y = 1 from a lamp at 2 m; what it turns away gets nothing."""
    floor = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), color=(0.6, 0.5, 0.4))
    wall = box((-1.0, 0.499, -0.1), (1.0, 0.5, 1.0), color=BLACK)
    lamp = quad((-0.01, -0.01, 2.0), (0, 0.02, 0), (0.02, 0, 0), color=BLACK, emission=(2e5, 1e5, 5e4))
    view = pose((0.0, 1.2, 1.9), (0.0, 1.201, 0.0))
    layers = render(scene(floor, wall, lamp), view)
    at = points_seen(view, layers["depth"])
    on_floor = (np.abs(at[..., 2]) < 1e-3) & (np.abs(at[..., 0]) < 0.8)
    lit, dark = on_floor & (at[..., 1] > 1.06), on_floor & (at[..., 1] > 0.6) & (at[..., 1] < 0.94)
    assert lit.sum() > 500 and dark.sum() > 200
    squared = (at[lit] ** 2).sum(axis=1) + 4.0 - at[lit][:, 2] ** 2
    expected = np.array([0.6, 0.5, 0.4]) / np.pi * np.array([2e5, 1e5, 5e4]) * (4e-4 * 4.0 / squared**2)[:, None]
    ratio = layers["direct"][lit] / expected
    assert np.quantile(np.abs(ratio - 1.0), 0.99) < 0.005 and ratio.mean() == pytest.approx(1.0, abs=2e-3)
    assert layers["direct"][dark].max() == 0.0 and layers["indirect"].max() == 0.0
    assert (layers["shadow"][lit] == 0.0).all() and (layers["shadow"][dark] == 1.0).all()
    turned_away = (at[..., 2] > 0.1) & (at[..., 2] < 0.9)
    assert turned_away.sum() > 50 and np.isnan(layers["shadow"][turned_away]).all()


def test_a_furnace_is_three_quarters_direct():
    """Walls of emission and reflectance 1/2: 1/2 is seen, 1/4 has been scattered once, the rest, of 1 altogether, more often."""
    room = box((0, 0, 0), (2, 3, 1.5), inside=True, emission=(0.5, 0.5, 0.5), color=(0.5, 0.5, 0.5))
    layers = render(scene(room), pose((0.4, 0.5, 0.6), (1.5, 2.5, 1.0)), max_depth=20, samples_per_pixel=64)
    assert layers["direct"].mean() == pytest.approx(0.75, abs=5e-3) and layers["indirect"].mean() == pytest.approx(0.25, abs=5e-3)
    assert np.nanmax(layers["shadow"]) == 0.0


def test_both_parts_are_all_light_and_colour_keeps_its_bytes():
    layers = render(furnished_room(), VIEW)
    np.testing.assert_allclose(layers["direct"] + layers["indirect"], layers["radiance"], rtol=2e-6)
    assert layers["direct"].mean() > 0 and layers["indirect"].mean() > 0
    assert np.array_equal(layers["radiance"], render(furnished_room(), VIEW, ("radiance",))["radiance"])
    assert np.array_equal(layers["shadow"], render(furnished_room(), VIEW, ("shadow",))["shadow"], equal_nan=True)


def test_direct_light_is_that_of_paths_of_two_segments():
    one, two = (render(furnished_room(), VIEW, max_depth=depth, samples_per_pixel=64) for depth in (2, 6))
    assert one["indirect"].max() == 0.0
    np.testing.assert_allclose(one["direct"].mean(axis=(0, 1)), two["direct"].mean(axis=(0, 1)), rtol=0.01)


def test_a_lamp_in_a_mirror_is_direct_light_and_a_wall_in_it_indirect():
    mirror = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9, 0.8, 0.7), metallic=1.0, roughness=0.0)
    lamp = quad((3, -3, -3), (-3, 0, 0), (0, 0, 6), emission=(40, 40, 40), color=BLACK)
    wall = quad((0, -3, -3), (-3, 0, 0), (0, 0, 6), color=(1.0, 1.0, 1.0))
    aside = quad((-2, 1.5, -1), (0, 0, 2), (-2, 0, 0), emission=(100, 100, 100), color=BLACK)  # lights the wall, turned from the mirror
    layers = render(
        scene(mirror, lamp, wall, aside), pose((0, 0, 0), (0, 1, 0)), camera=CameraConfig(width=24, height=24, horizontal_fov_rad=0.5)
    )
    np.testing.assert_allclose(layers["direct"][:, 13:].mean(axis=(0, 1)), 40 * np.array([0.9, 0.8, 0.7]), rtol=0.02)
    assert layers["indirect"][:, :11].mean() > 2.0 and layers["direct"][:, :11].mean() < 0.01 * layers["indirect"][:, :11].mean()


def test_what_walls_keep_out_is_not_missed():
    """An empty room with sky and sun in its window: no floor has a shadow, in the sun's patch or beside it."""
    way = np.array([0.1, 1.0, 1.0]) / np.sqrt(2.01)
    sky = DARK._replace(zenith=np.full(3, 3000, np.float32), sun=np.array([*way, 1e-5, 1e9, 1e9, 1e9], np.float32))
    pane = quad((-1, 2.0, 0.5), (2, 0, 0), (0, 0, 1.5), portal=True, transmission=0.9)
    room = pierced(box((-2, -2, 0), (2, 2, 2.5), inside=True, color=(0.5, 0.5, 0.5)), (-1.001, 0.499), (1.001, 2.001))
    view = pose((0.0, -1.9, 2.2), (0.0, 0.3, 0.0))
    empty = render(scene(room, pane, sky=sky), view)
    at = points_seen(view, empty["depth"])
    floor = np.abs(at[..., 2]) < 1e-3
    assert floor.sum() > 500 and (empty["shadow"][floor] == 0.0).all()
    patch = empty["direct"][floor].mean(axis=1)
    assert patch.max() > 20 * np.median(patch), "the sun draws the window on the floor"
    thing = box((-0.3, 0.2, 0.0), (0.3, 0.4, 0.6), color=BLACK)
    shaded = render(scene(room, pane, thing, sky=sky), view)
    at = points_seen(view, shaded["depth"])
    sunny = (np.abs(at[..., 2]) < 1e-3) & (at[..., 1] > 0.5)
    assert sunny.sum() > 100 and (shaded["shadow"][sunny] == 0.0).all() and np.nanmax(shaded["shadow"]) > 0.9


def test_one_segment_tells_of_no_shadow():
    assert np.isnan(render(furnished_room(), VIEW, ("shadow",), max_depth=1)["shadow"]).all()
