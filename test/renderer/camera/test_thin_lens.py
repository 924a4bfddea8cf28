"""Depth of field against the thin lens equation: blur circles of small lamps, autofocus, layers that stay sharp."""

import math

import numpy as np
import pytest
from box_room import VIEW as ROOM_VIEW
from box_room import box, furnished_room, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer

SIZE, FOV = 64, 0.2
AHEAD = pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def lamp(depth, half=0.002):
    """A small lamp straight ahead, half-width as seen from 1 m."""
    half = half * depth
    return quad((depth, -half, -half), (0, 0, 2 * half), (0, 2 * half, 0), emission=(1e5, 1e5, 1e5), color=(0, 0, 0))


def picture(flat, view=AHEAD, layers=("color",), samples=256, depth=1, **camera):
    config = RenderConfig(samples_per_pixel=samples, max_depth=depth, threads=1)
    with Renderer(flat, CameraConfig(width=SIZE, height=SIZE, horizontal_fov_rad=FOV, **camera), config, 3) as renderer:
        return renderer.render(view, 0, layers)


def spread_px(radiance):
    """Root mean square distance from the centroid, along both axes together."""
    weight = radiance[..., 0].astype(np.float64)
    v, u = np.mgrid[:SIZE, :SIZE]
    u, v = u - np.average(u, weights=weight), v - np.average(v, weights=weight)
    return math.sqrt(np.average(u**2 + v**2, weights=weight))


@pytest.mark.parametrize(("depth", "focus"), [(1.0, 2.0), (4.0, 1.5), (3.0, 1e4)])
def test_a_point_out_of_focus_is_a_disc_of_the_thin_lens_equation(depth, focus):
    camera = CameraConfig(width=SIZE, height=SIZE, horizontal_fov_rad=FOV, f_stop=0.5, sensor_width_mm=8.0)
    diameter = camera.focal_length_px * 2.0 * camera.lens_radius_m * abs(1.0 / focus - 1.0 / depth)
    assert camera.lens_radius_m == pytest.approx(0.5 * (0.5 * 8e-3 / math.tan(0.5 * FOV)) / 0.5)
    seen = picture(scene(lamp(depth)), f_stop=0.5, sensor_width_mm=8.0, focus_distance_m=focus, samples=1024)
    # A disc of radius r has the RMS r / sqrt 2; pixels and the lamp add those of squares.
    side = 0.004 * camera.focal_length_px
    assert diameter > 8.0
    assert spread_px(seen.radiance) == pytest.approx(
        math.hypot(0.5 * diameter / math.sqrt(2.0), math.hypot(1.0, side) / math.sqrt(6.0)), rel=0.03
    )


def test_in_focus_nothing_is_blurred_and_no_light_is_lost():
    sharp, focused = (picture(scene(lamp(2.0, 0.01)), **lens) for lens in ({}, {"f_stop": 1.4, "focus_distance_m": 2.0}))
    assert spread_px(focused.radiance) == pytest.approx(spread_px(sharp.radiance), rel=0.02)
    blurred = picture(scene(lamp(2.0, 0.01)), f_stop=1.4, focus_distance_m=1.0)
    assert blurred.radiance.sum() == pytest.approx(sharp.radiance.sum(), rel=0.02)


def test_autofocus_takes_the_middle():
    wall = box((2.5, -3, -3), (3, 3, 3))
    pieces = (wall, lamp(2.499, 0.002))
    auto, set_there = (picture(scene(*pieces), f_stop=1.4, focus_distance_m=focus) for focus in (0.0, 2.499))
    assert auto.radiance == pytest.approx(set_there.radiance, rel=0.02, abs=1.0)


def test_geometry_stays_sharp_and_threads_change_nothing():
    layers = ("color", "depth", "normals", "semantic", "instance")
    pinhole, open_wide = (picture(furnished_room(), ROOM_VIEW, layers, samples=4, depth=3, f_stop=stop) for stop in (0.0, 1.4))
    for name in layers[1:]:
        assert np.array_equal(pinhole.layers[name], open_wide.layers[name])
    assert not np.array_equal(pinhole.radiance, open_wide.radiance)


@pytest.mark.parametrize("model", ["kannala_brandt", "equirectangular"])
def test_lenses_that_see_aside_are_in_focus_on_a_sphere(model):
    """A lamp in focus at right angles to the axis keeps its size; nearer it spreads."""
    spot = quad((-0.01, 1.5, -0.01), (0.02, 0, 0), (0, 0, 0.02), emission=(1e4, 1e4, 1e4), color=(0, 0, 0))
    camera = CameraConfig(model=model, width=SIZE, height=SIZE, horizontal_fov_rad=3.6 if model == "kannala_brandt" else FOV)
    stop = camera.focal_length_px * 6.4e-3 / SIZE / 0.4  # an aperture of 0.4 m
    lit = []
    for focus in (1.5, 0.7):
        config = RenderConfig(samples_per_pixel=256, max_depth=1, threads=1)
        wide = CameraConfig(
            model=model, width=SIZE, height=SIZE, horizontal_fov_rad=camera.horizontal_fov_rad, f_stop=stop, focus_distance_m=focus
        )
        with Renderer(scene(spot), wide, config, 3) as renderer:
            lit.append(int((renderer.render(AHEAD, 0, ("color",)).radiance[..., 0] > 0).sum()))
    assert 0 < lit[0] <= 6 and lit[1] > 2 * lit[0]
