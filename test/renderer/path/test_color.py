"""Colour against closed forms: form factors, furnaces, portals; mean over many pixels, noise well below the tolerance."""

import numpy as np
import pytest
from box_room import DARK, box, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import unproject
from renderer.scene.flat_scene import Sky

ALL = (1.0, 1.0, 1.0)


def radiance(flat, view, *, bounces, samples=64, width=32, height=24, fov=0.3):
    camera = CameraConfig(width=width, height=height, horizontal_fov_rad=fov)
    config = RenderConfig(samples_per_pixel=samples, max_depth=bounces + 2, threads=2)
    with Renderer(flat, camera, config, 11) as renderer:
        frame = renderer.render(view, 0, ("color", "depth"))
    assert np.isfinite(frame.radiance).all()
    v, u = np.mgrid[:height, :width] + 0.5
    depth = np.nan_to_num(frame.layers["depth"].ravel(), posinf=1.0)
    points = unproject(camera, view, np.column_stack([u.ravel(), v.ravel(), depth]))
    return frame.radiance.astype(np.float64), points


def form_factor(points, normal, corners):
    """Irradiance of a polygon of unit luminance over pi, by Lambert's formula; the polygon lies wholly above the horizon."""
    ways = corners[None] - points[:, None]
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    following = np.roll(ways, -1, axis=1)
    angle = np.arccos(np.clip((ways * following).sum(2), -1, 1))
    turn = np.cross(ways, following)
    turn /= np.linalg.norm(turn, axis=2, keepdims=True)
    return np.abs((angle * (turn @ normal)).sum(axis=1)) / (2 * np.pi)


FLOOR = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), color=(0.8, 0.4, 0.2))
DOWN = pose((1.5, -0.3, 2.0), (0.2, 0.1, 0.0))
UP = np.array([0.0, 0.0, 1.0])


def lamp(x, y, z, size, luminance):
    """A square lamp that looks down."""
    return quad((x, y, z), (0, size, 0), (size, 0, 0), emission=luminance, color=(0, 0, 0))


@pytest.mark.parametrize("bounces", [0, 1])
def test_a_plane_under_an_area_light(bounces):
    light = lamp(-0.4, -0.4, 1.5, 0.8, (100, 50, 10))
    measured, points = radiance(scene(FLOOR, light), DOWN, bounces=bounces)
    expected = form_factor(points, UP, light.vertices)[:, None] * np.array([0.8 * 100, 0.4 * 50, 0.2 * 10])
    np.testing.assert_allclose(measured.mean(axis=(0, 1)), expected.mean(axis=0), rtol=5e-3)
    blocks = (measured.reshape(6, 4, 8, 4, 3).mean(axis=(1, 3)), expected.reshape(6, 4, 8, 4, 3).mean(axis=(1, 3)))
    np.testing.assert_allclose(*blocks, rtol=0.06)


@pytest.mark.parametrize("bounces", [0, 1])
def test_lights_of_very_different_power(bounces):
    lights = [lamp(-0.4, -0.4, 1.5, 0.05, (20000, 0, 0)), lamp(0.5, 0.1, 1.8, 0.5, (0, 3, 0)), lamp(-20, -20, 30.0, 3.0, (0, 0, 500))]
    measured, points = radiance(scene(FLOOR, *lights), DOWN, bounces=bounces, samples=512)
    luminance = np.array([0.8 * 20000, 0.4 * 3, 0.2 * 500])
    expected = np.column_stack([form_factor(points, UP, light.vertices) for light in lights]) * luminance
    np.testing.assert_allclose(measured.mean(axis=(0, 1)), expected.mean(axis=0), rtol=5e-3)


def test_half_a_light_behind_a_blocker():
    light = lamp(-0.5, -0.5, 2.0, 1.0, (60, 60, 60))
    blocker = quad((-2, 0, 1.999), (2.5, 0, 0), (0, 2, 0), color=(0, 0, 0))
    visible = np.array([(-0.5, -0.5, 2.0), (0.5, -0.5, 2.0), (0.5, 0.0, 2.0), (-0.5, 0.0, 2.0)])
    covered = quad((-2, -1e-3, 1.998), (4, 0, 0), (0, 2, 0), color=(0, 0, 0))
    view = pose((0.6, -0.9, 1.2), (0.1, -0.2, 0.0))
    measured, points = radiance(scene(FLOOR, light, blocker, covered), view, bounces=0)
    expected = form_factor(points, UP, visible) * 0.8 * 60
    assert measured[..., 0].mean() == pytest.approx(expected.mean(), rel=0.01)


@pytest.mark.parametrize(("bounces", "expected"), [(0, 0.5 + 0.25), (1, 0.5 + 0.25 + 0.125)])
def test_furnace(bounces, expected):
    """All of a closed box shines with 0.5 and reflects 0.5: the Neumann series, cut after bounces + 1 reflections."""
    room = box((0, 0, 0), (2, 3, 1.5), inside=True, emission=(0.5, 0.5, 0.5), color=(0.5, 0.5, 0.5))
    measured, _ = radiance(scene(room), pose((0.4, 0.5, 0.6), (1.5, 2.5, 1.0)), bounces=bounces, fov=1.5)
    assert measured.mean() == pytest.approx(expected, rel=2e-3)
    np.testing.assert_allclose(measured.reshape(6, 4, 8, 4, 3).mean(axis=(1, 3, 4)), expected, rtol=0.01)


def test_furnace_of_many_parts():
    """The same with the emission on separate panels that hide parts of each other."""
    shell = box((0, 0, 0), (2, 3, 1.5), inside=True, emission=(0.5, 0.5, 0.5), color=(0.5, 0.5, 0.5))
    blocks = [box((x, 1.4, 0.3), (x + 0.3, 1.8, 1.1), emission=(0.5, 0.5, 0.5), color=(0.5, 0.5, 0.5)) for x in (0.5, 1.2)]
    measured, _ = radiance(scene(shell, *blocks), pose((0.4, 0.5, 0.6), (1.5, 2.5, 1.0)), bounces=1, fov=1.5, samples=64)
    assert measured.mean() == pytest.approx(0.875, rel=2e-3)


def test_one_bounce_off_a_plane():
    """A lit floor lights a black-backed ceiling patch: two form factors, the second integrated over the floor."""
    size = 1.0
    bright = quad((-size / 2, -size / 2, 0), (size, 0, 0), (0, size, 0), color=(0.5, 0.5, 0.5))
    side = quad((2.0, -0.25, 0.8), (0, 0.5, 0), (0, 0, 0.5), emission=(400, 400, 400), color=(0, 0, 0))
    side = side._replace(faces=side.faces[:, ::-1])  # looks towards -x
    screen = quad((-0.2, -0.2, 1.5), (0, 0.4, 0), (0.4, 0, 0), color=(1, 1, 1))  # looks down, edge-on to no light above its plane
    view = pose((0.5, 0.4, 0.7), (0.0, 0.0, 1.5))
    flat = scene(bright, side, screen)
    direct, points = radiance(flat, view, bounces=0, fov=0.12, samples=64)
    both, _ = radiance(flat, view, bounces=1, fov=0.12, samples=256)
    cells = 40
    x, y = (item.ravel() for item in np.meshgrid(*2 * [(np.arange(cells) + 0.5) / cells * size - size / 2]))
    floor_points = np.column_stack([x, y, np.zeros_like(x)])
    lit = 0.5 * 400 * form_factor(floor_points, UP, side.vertices)
    expected = []
    for point in points:
        way = floor_points - point
        squared = (way**2).sum(1)
        expected.append((lit * way[:, 2] ** 2 / squared**2).sum() * (size / cells) ** 2 / np.pi)
    assert (both - direct).mean() == pytest.approx(np.mean(expected), rel=0.01)


UNIFORM = Sky(*(np.full(3, 900, np.float32) for _ in range(3)))


@pytest.mark.parametrize("bounces", [0, 1])
def test_a_window_under_a_uniform_sky(bounces):
    pane = quad((-0.6, 2.0, 0.8), (1.2, 0, 0), (0, 0, 1.4), portal=True, transmission=0.7)
    measured, points = radiance(scene(FLOOR, pane, sky=UNIFORM), DOWN, bounces=bounces)
    expected = form_factor(points, UP, pane.vertices) * 0.8 * 0.7 * 900
    assert measured[..., 0].mean() == pytest.approx(expected.mean(), rel=5e-3)


@pytest.mark.parametrize("bounces", [0, 1])
def test_a_window_under_a_varying_sky(bounces):
    sky = Sky(*(np.full(3, level, np.float32) for level in (8000, 1000, 300)))
    pane = quad((-0.6, 2.0, -0.4), (1.2, 0, 0), (0, 0, 2.6), portal=True, transmission=0.5)
    table = quad((-5, -5, 0.5), (10, 0, 0), (0, 10, 0), color=(0.8, 0.4, 0.2))
    measured, points = radiance(scene(table, pane, sky=sky), pose((1.5, -0.3, 2.0), (0.2, 0.1, 0.5)), bounces=bounces)
    cells = 60
    middles = (np.arange(cells) + 0.5) / cells
    x, z = (item.ravel() for item in np.meshgrid(middles * 1.2 - 0.6, middles * 1.7 + 0.5))
    spots = np.column_stack([x, np.full_like(x, 2.0), z])
    expected = []
    for point in points:
        way = spots - point
        distance = np.linalg.norm(way, axis=1)
        sine = way[:, 2] / distance
        arriving = 0.5 * (1000 + 7000 * sine) * sine * way[:, 1] / distance / distance**2
        expected.append(arriving.sum() * (1.2 * 1.7 / cells**2) * 0.8 / np.pi)
    assert measured[..., 0].mean() == pytest.approx(np.mean(expected), rel=5e-3)


def test_the_camera_sees_lamps_panes_and_sky():
    sky = Sky(*(np.array(color, np.float32) for color in ((800, 900, 1000), (400, 500, 600), (50, 40, 30))))
    lamp_wall = quad((3, -0.5, -1), (0, 0, 1), (0, 1, 0), emission=(7, 8, 9), color=(0, 0, 0))
    pane = quad((3, 0.5, -1), (0, 0, 1), (0, 1, 0), portal=True, transmission=0.5)
    flat = scene(lamp_wall, pane, sky=sky)
    for target, expected in (((3, 0, -0.5), (7, 8, 9)), ((3, 1, -0.5), (25, 20, 15)), ((0, -3, -1), (50, 40, 30))):
        measured, _ = radiance(flat, pose((0, 0, 0), target), bounces=1, samples=4, fov=0.1)
        np.testing.assert_allclose(measured.reshape(-1, 3), np.tile(expected, (768, 1)), rtol=1e-4)
    measured, _ = radiance(flat, pose((0, 0, 0), (0, -1, 1)), bounces=1, samples=4, fov=0.05)
    np.testing.assert_allclose(measured.mean(axis=(0, 1)), np.array([400, 400, 400]) / np.sqrt(2) + [400, 500, 600], rtol=2e-3)


def test_backs_of_lamps_and_panes_are_dark():
    back = quad((3, -2, -2), (0, 4, 0), (0, 0, 4), emission=(7, 8, 9), color=(0, 0, 0))
    measured, _ = radiance(scene(back._replace(faces=back.faces[:, ::-1])), pose((0, 0, 0), (3, 0, 0.1)), bounces=1, samples=4)
    assert measured.max() > 0
    measured, _ = radiance(scene(back), pose((0, 0, 0), (3, 0, 0.1)), bounces=1, samples=4)
    assert measured.max() == 0


def test_no_light_leaks_through_touching_edges():
    """A black lid on a closed box, lit from outside: not a single path gets in."""
    inside = box((0, 0, 0), (1, 1, 1), inside=True, color=ALL)
    outside = box((-1, -1, 3), (2, 2, 3.1), emission=(1e4, 1e4, 1e4))
    measured, _ = radiance(scene(inside, outside), pose((0.2, 0.3, 0.5), (0.9, 0.8, 0.1)), bounces=1, fov=2.0, samples=16)
    assert measured.max() == 0


def test_smooth_normals_shade_but_do_not_leak():
    flat = scene(quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), color=ALL), lamp(-0.1, -0.1, 2.0, 0.2, (1000, 1000, 1000)))
    tilted = np.array([0.6, 0.0, 0.8], np.float32)
    flat.mesh.normals[:4] = tilted
    view = pose((0.5, 0.0, 1.0), (0.0, 0.0, 0.0))
    measured, points = radiance(flat, view, bounces=0, fov=0.1)
    expected = form_factor(points, tilted.astype(np.float64), np.array([(-0.1, -0.1, 2), (0.1, -0.1, 2), (0.1, 0.1, 2), (-0.1, 0.1, 2)]))
    assert measured.mean() == pytest.approx(1000 * expected.mean(), rel=5e-3)
    flat.mesh.normals[:4] = -tilted  # the geometric side decides
    flipped, _ = radiance(flat, view, bounces=0, fov=0.1)
    np.testing.assert_allclose(flipped, measured, rtol=1e-6)
    below, _ = radiance(flat, pose((0.5, 0.0, -1.0), (0.0, 0.0, 0.0)), bounces=1, fov=0.1)
    assert below.max() == 0


def test_a_room_without_lights_is_black():
    measured, _ = radiance(scene(box((0, 0, 0), (1, 1, 1), inside=True), sky=DARK), pose((0.2, 0.3, 0.5), (0.9, 0.8, 0.1)), bounces=1)
    assert measured.max() == 0
