"""What stands before a window shades: sun patches and sky light behind a reveal, and what the camera sees through the pane."""

import math

import numpy as np
import pytest
from box_room import DARK, box, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer, Sky
from renderer.path.lights import build_lights

WIDTH, LOW, HIGH, WALL = 1.0, 0.5, 2.5, 2.0
"""The pane fills x from -WIDTH to WIDTH and z from LOW to HIGH at y = WALL; y beyond it is outside."""
FLOOR = quad((-3, -3, 0), (6, 0, 0), (0, 4.9, 0), color=(0.5, 0.5, 0.5))
PANE = quad((-WIDTH, WALL, LOW), (2 * WIDTH, 0, 0), (0, 0, HIGH - LOW), portal=True, transmission=0.9)
BRIGHT = Sky(*(np.full(3, 1000.0, np.float32) for _ in range(3)))
SUN = np.array((0.2, 1.0, 0.8)) / np.linalg.norm((0.2, 1.0, 0.8))
LUX, RADIUS_RAD = 80_000.0, 0.0046


def reveal(depth, **look):
    """The four sides of a hole in a wall of this depth, outside of the pane."""
    low, size = (-WIDTH, WALL, LOW), (2 * WIDTH, depth, HIGH - LOW)
    whole = box(low, tuple(np.add(low, size)), inside=True, **{"color": (0, 0, 0), **look})
    return whole._replace(faces=np.delete(whole.faces, [4, 5, 6, 7], axis=0))  # without the sides across the way


def sun(half_angle=RADIUS_RAD, sky=DARK):
    versine = 1.0 - math.cos(half_angle)
    return sky._replace(sun=np.array([*SUN, versine, *(3 * [LUX / (2.0 * math.pi * versine)])], np.float32))


def radiance(flat, view, depth=2, samples=64, fov=0.1, size=(8, 8)):
    camera = CameraConfig(width=size[0], height=size[1], horizontal_fov_rad=fov)
    with Renderer(flat, camera, RenderConfig(samples_per_pixel=samples, max_depth=depth, threads=1), 3) as renderer:
        return renderer.render(view, 0, ("radiance",)).radiance.astype(np.float64)


def sky_irradiance(points, depth):
    """Irradiance of floor points (n, 3) by an even sky of 1 through pane and reveal, by sums over the pane."""
    n = 400
    u = (np.arange(n) + 0.5) / n
    x, z = np.meshgrid(-WIDTH + 2 * WIDTH * u, LOW + (HIGH - LOW) * u)
    area = 2 * WIDTH * (HIGH - LOW) / n**2
    total = []
    for px, py, _ in points:
        way = np.stack([x - px, np.full_like(x, WALL - py), z], axis=-1)
        squared = (way**2).sum(axis=-1)
        further = depth / way[..., 1]
        end_x, end_z = x + further * way[..., 0], z + further * way[..., 2]
        seen = (np.abs(end_x) < WIDTH) & (end_z > LOW) & (end_z < HIGH)
        total.append((seen * way[..., 1] * way[..., 2] / squared**2).sum() * area)
    return np.array(total)


@pytest.mark.parametrize("depth", [0.0, 0.3])
def test_a_patch_of_sun_is_as_large_as_pane_and_reveal_leave_it(depth):
    """From above, 1.5 cm a pixel: the sun goes SUN_x and SUN_z sideways for each SUN_y of the reveal's depth."""
    things = [FLOOR, PANE] + ([reveal(depth)] if depth else [])
    edge, height = 200, 6.0
    down = pose((-0.2, 0.1 + 1e-3, height), (-0.2, 0.1, 0.0))
    lit = radiance(scene(*things, sky=sun()), down, fov=2.0 * math.atan(1.5 / height), size=(edge, edge), samples=16)[..., 0]
    sideways, up = depth * SUN[0] / SUN[1], depth * SUN[2] / SUN[1]
    expected = (2 * WIDTH - sideways) * (HIGH - LOW - up) * SUN[1] / SUN[2]
    level = 0.5 / math.pi * 0.9 * LUX * SUN[2]
    assert np.median(lit[lit > 0.5 * level]) == pytest.approx(level, rel=0.01)
    assert lit.sum() / level * (3.0 / edge) ** 2 == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("bounces", [2, 3])
@pytest.mark.parametrize("depth", [0.0, 0.5])
def test_sky_light_is_what_pane_and_reveal_leave_of_it(depth, bounces):
    """By sampled light alone (2 segments), and shared with the rays that find it (3): the same."""
    flat = scene(FLOOR, PANE, *([reveal(depth)] if depth else []), sky=BRIGHT)
    spot = (0.3, -0.6, 0.0)
    seen = radiance(flat, pose((0.3, -0.61, 2.0), spot), bounces, samples=4096, fov=0.02).mean()
    assert seen == pytest.approx(0.5 / math.pi * 900.0 * sky_irradiance([spot], depth)[0], rel=0.01)


def test_a_wide_sun_is_found_alike_by_sampling_it_and_by_chance():
    floor = quad((-3, -3, 0), (6, 0, 0), (0, 4.9, 0), color=(0.6, 0.6, 0.6), metallic=1.0, roughness=0.5)
    half_shaded = np.array([0.0, WALL, 1.6]) - SUN * (1.6 / SUN[2])
    eye = half_shaded + 2.0 * np.array([-SUN[0], -SUN[1], SUN[2]])
    flat = scene(floor, PANE, reveal(0.9), sky=sun(0.15))
    matt = scene(floor._replace(metallic=0.0, roughness=1.0), PANE, reveal(0.9), sky=sun(0.15))
    for item in (flat, matt):
        short, long = (radiance(item, pose(tuple(eye), tuple(half_shaded)), depth, samples=2048, fov=0.05).mean() for depth in (2, 3))
        assert long == pytest.approx(short, rel=0.01) and short > 0.0


def test_the_camera_sees_the_reveal_in_the_sun_and_the_sky_beyond_it():
    """Sun on the reveal's side x = -1: albedo / pi times its illuminance, through the pane once; past it the sky."""
    flat = scene(PANE, reveal(0.6, color=(0.5, 0.5, 0.5)), sky=sun(sky=BRIGHT))
    spot = (-WIDTH, WALL + 0.55, 1.2)
    eye = (0.6, 0.5, 1.2)
    side = radiance(flat, pose(eye, spot), 3, samples=512, fov=0.01).mean()
    lit_by_sun = 0.9 * 0.5 / math.pi * LUX * SUN[0]
    dark = radiance(flat._replace(sky=BRIGHT), pose(eye, spot), 3, samples=512, fov=0.01).mean()
    assert side - dark == pytest.approx(lit_by_sun, rel=0.02)
    assert 0.9 * 0.5 * 0.3 * 1000 < dark < 0.9 * 0.5 * 0.8 * 1000  # the sky fills about half of what the side sees
    assert radiance(flat, pose(eye, (0.6, 3.0, 1.2)), 3, fov=0.01) == pytest.approx(900.0, rel=1e-3)


def test_ground_outside_is_lit_by_all_of_the_sky():
    board = quad((-50, 40, 0), (100, 0, 0), (0, 50, 0), color=(0.5, 0.5, 0.5))
    seen = radiance(scene(PANE, board, sky=BRIGHT), pose((0.0, 0.0, 1.6), (0.0, 60.0, 0.0)), 3, samples=256, fov=0.01).mean()
    assert seen == pytest.approx(0.9 * 0.5 * 1000.0, rel=0.01)


def test_a_pane_walled_up_brings_no_light():
    board = quad((-2, WALL + 0.1, 0), (4, 0, 0), (0, 0, 3), color=(0, 0, 0))
    flat = scene(FLOOR, PANE, reveal(0.1), board, sky=sun(sky=BRIGHT))
    assert len(build_lights(flat).part) == 2
    assert radiance(flat, pose((0.0, -1.0, 1.5), (0.0, 0.5, 0.0)), 4, fov=0.5).max() == 0.0
