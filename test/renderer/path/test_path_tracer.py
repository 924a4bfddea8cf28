"""Whole paths against known answers: furnaces of every material, mirrors, panes, glass, and odd scenes without a NaN."""

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from reference_scenes import SCENES
from white_surfaces import WHITE

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.bsdf import microfacet
from renderer.camera.cameras import pose_camera
from renderer.core.kernel import from_python
from renderer.path.integrator import trace_paths
from renderer.path.queues import WAVE_EDGE
from renderer.path.records import Film, Transport, Work, make_scratch
from renderer.scene.flat_scene import Sky

fresnel_thin_dielectric = from_python(microfacet.fresnel_thin_dielectric)

FIELDS = {
    "METALLIC": "metallic", "ROUGHNESS": "roughness", "COAT": "clearcoat", "SHEEN": "sheen", "TRANSMISSION": "transmission", "IOR": "ior",
}  # fmt: skip
ALL = (1.0, 1.0, 1.0)


def radiance(flat, view, *, depth=6, samples=64, size=(24, 24), fov=1.0, **settings):
    camera = CameraConfig(width=size[0], height=size[1], horizontal_fov_rad=fov)
    config = RenderConfig(samples_per_pixel=samples, max_depth=depth, threads=2, **settings)
    with Renderer(flat, camera, config, 11) as renderer:
        image = renderer.render(view, 0, ("color",)).radiance
    assert np.isfinite(image).all() and (image >= 0).all()
    return image.astype(np.float64)


@pytest.mark.parametrize("name", [name for name, look in WHITE.items() if "COS_FRONT" not in look])
def test_a_white_thing_in_a_furnace_is_invisible(name):
    """A box of every material between walls that all shine with 1 and reflect nothing: 1 in every direction."""
    look = {FIELDS[key]: value for key, value in ({"ROUGHNESS": 0.5, "IOR": 1.5} | WHITE[name]).items()}
    walls = box((-2, -2, -2), (2, 2, 2), inside=True, emission=ALL, color=(0, 0, 0))
    thing = box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), color=ALL, **look)
    image = radiance(scene(walls, thing), pose((1.2, 0.9, 0.8), (0, 0, 0)), depth=40, samples=128, fov=0.5)
    assert image.mean() == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("look", [{"ior": 1.0}, {"ior": 1.5, "roughness": 0.4, "sheen": 0.5}, {"ior": 1.5, "transmission": 0.4}])
def test_a_white_sheet_in_a_furnace_is_invisible(look):
    walls = box((-2, -2, -2), (2, 2, 2), inside=True, emission=ALL, color=(0, 0, 0))
    sheet = quad((-1.5, 0, -1.5), (3, 0, 0), (0, 0.6, 3), color=ALL, diffuse_transmission=0.6, **look)
    for eye in ((0.4, 1.8, 0.3), (0.4, -1.8, 0.3)):
        image = radiance(scene(walls, sheet), pose(eye, (0, 0, 0)), depth=40, samples=128, fov=0.5)
        assert image.mean() == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("front", [True, False])
def test_a_sheet_lit_from_behind_shows_what_it_lets_through(front):
    """A matt sheet of colour 0.8 that lets half of it through, over a disc-like lamp: luminance t E / pi, with E by Lambert's formula."""
    lamp = quad((-0.5, 1.0, -0.5), (1.0, 0, 0), (0, 0, 1.0), emission=(100.0,) * 3, color=(0, 0, 0))
    along, across = ((0.02, 0, 0), (0, 0, 0.02)) if front else ((0, 0, 0.02), (0.02, 0, 0))
    sheet = quad((-0.01, 0, -0.01), along, across, color=(0.8, 0.4, 0.2), ior=1.0, diffuse_transmission=0.5)
    image = radiance(scene(lamp, sheet), pose((0, -1, 0), (0, 1, 0)), fov=0.004, samples=256, depth=2)
    a = 0.5 / np.hypot(1.0, 0.5)
    form = 4.0 / np.pi * a * np.arctan(a)
    np.testing.assert_allclose(image.mean(axis=(0, 1)), 100.0 * form * np.array([0.4, 0.2, 0.1]), rtol=0.01)


def test_a_lamp_shows_through_a_net():
    """Straight through the holes, and by what the threads between them let through: L b (h + (1 - h) t F), F by Lambert's formula."""
    holes, through, color = 0.4, 0.5, np.array([0.8, 0.6, 0.4])
    lamp = quad((-0.5, 1.0, -0.5), (1.0, 0, 0), (0, 0, 1.0), emission=(100.0,) * 3, color=(0, 0, 0))
    net = quad((-0.01, 0, -0.01), (0.02, 0, 0), (0, 0, 0.02), color=tuple(color), ior=1.5, transmission=holes, diffuse_transmission=through)
    image = radiance(scene(lamp, net), pose((0, -1, 0), (0, 1, 0)), fov=0.004, samples=1024, depth=2)
    a = 0.5 / np.hypot(1.0, 0.5)
    form = 4.0 / np.pi * a * np.arctan(a)
    np.testing.assert_allclose(image.mean(axis=(0, 1)), 100.0 * color * (holes + (1.0 - holes) * through * form), rtol=0.01)


def test_a_shining_furnace_sums_to_one():
    room = box((0, 0, 0), (2, 3, 1.5), inside=True, emission=(0.5, 0.5, 0.5), color=(0.5, 0.5, 0.5))
    image = radiance(scene(room), pose((0.4, 0.5, 0.6), (1.5, 2.5, 1.0)), depth=20, samples=128)
    assert image.mean() == pytest.approx(1.0, abs=5e-3)


def test_walls_that_glow_like_screens_light_a_room_as_the_sum_of_their_reflections_says():
    """A white box between walls of luminance 1 that reflect 0.03 themselves: 1 / (1 - 0.03) in every direction; backs stay dark."""
    walls = box((-2, -2, -2), (2, 2, 2), inside=True, color=ALL, glow_cd_m2=1.0)
    thing = box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), color=ALL)
    image = radiance(scene(walls, thing), pose((1.2, 0.9, 0.8), (0, 0, 0)), depth=40, samples=128, fov=0.5)
    assert image.mean() == pytest.approx(1.0 / 0.97, abs=5e-3)
    screen = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.5, 0.2, 0.1), glow_cd_m2=300.0)
    np.testing.assert_allclose(radiance(scene(screen), pose((0, 0, 0), (0, 1, 0)), fov=0.5)[12, 12], (150.0, 60.0, 30.0), rtol=1e-5)
    assert radiance(scene(screen), pose((0, 4, 0), (0, 1, 0)), fov=0.5).max() == 0.0


def test_a_mirror_shows_what_stands_opposite():
    mirror = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9, 0.8, 0.7), metallic=1.0, roughness=0.0)
    left = quad((0, -3, -3), (-3, 0, 0), (0, 0, 6), emission=(10, 10, 10), color=(0, 0, 0))
    right = quad((3, -3, -3), (-3, 0, 0), (0, 0, 6), emission=(40, 40, 40), color=(0, 0, 0))
    image = radiance(scene(mirror, left, right), pose((0, 0, 0), (0, 1, 0)), fov=0.5)
    np.testing.assert_allclose(image[:, 13:].mean(axis=(0, 1)), 40 * np.array([0.9, 0.8, 0.7]), rtol=0.02)
    np.testing.assert_allclose(image[:, :11].mean(axis=(0, 1)), 10 * np.array([0.9, 0.8, 0.7]), rtol=0.02)


def test_a_window_mirrors_the_lamp_and_shows_the_sky_by_fresnel():
    sky = Sky(*(np.full(3, 100, np.float32) for _ in range(3)))
    pane = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), portal=True, transmission=0.9, ior=1.5, roughness=0.0)
    lamp = quad((3, -3, -3), (-6, 0, 0), (0, 0, 6), emission=(5000, 5000, 5000), color=(0, 0, 0))
    image = radiance(scene(pane, lamp, sky=sky), pose((0, 0, 0), (0, 1, 0)), fov=0.1)
    mirrored = float(fresnel_thin_dielectric(np.float32(1), np.float32(1.5)))
    assert image.mean() == pytest.approx(5000 * mirrored + 100 * 0.9 * (1 - mirrored), rel=0.01)


def test_a_glass_slab_shifts_what_is_behind_it_by_snell():
    """Seen through 0.5 m of glass at 45 degrees, an edge moves sideways by t sin(a - b) / cos b."""
    slab = box((-4, 1.0, -4), (4, 1.5, 4), color=ALL, transmission=1.0, ior=1.5, roughness=0.0)
    screen = quad((0, 3, -20), (20, 0, 0), (0, 0, 40), emission=(100, 100, 100), color=(0, 0, 0))
    inside = np.arcsin(np.sin(np.pi / 4) / 1.5)
    shift_along_screen = 0.5 * (np.tan(np.pi / 4) - np.tan(inside))
    start = np.array([-3.0 + shift_along_screen, 0.0, 0.0])  # the ray at 45 degrees now ends on the edge x = 0
    image = radiance(scene(slab, screen), pose(tuple(start), (start[0] + 1, 1, 0)), fov=0.02, size=(64, 8), samples=32, depth=3)
    profile = image.mean(axis=(0, 2))
    assert profile.max() > 60
    edge = np.abs(profile - 0.5 * profile.max()).argmin()
    assert abs(edge - 32) <= 6  # pixels of a third of a milliradian; the blur of smooth glass is a milliradian


def test_blurred_caustics_keep_their_energy():
    coated = box((0.5, 0.5, 0.0), (1.5, 1.5, 0.6), color=ALL, roughness=0.1, metallic=1.0)
    furnace = box((0, 0, 0), (2, 2, 2), inside=True, color=(0.5, 0.5, 0.5), emission=(0.5, 0.5, 0.5))
    view = pose((0.2, 0.2, 1.6), (1.0, 1.0, 0.5))
    blurred = radiance(scene(furnace, coated), view, depth=24, samples=64, caustic_blur=1.0)
    np.testing.assert_allclose(blurred.mean(axis=(0, 1)), 1.0, rtol=0.01)


def test_blurring_caustics_leaves_direct_light_alone():
    room = box((0, 0, 0), (2, 2, 2), inside=True, color=(0.8, 0.8, 0.8), roughness=0.2)
    lamp = quad((0.5, 0.5, 1.9), (0, 1.0, 0), (1.0, 0, 0), emission=(10, 10, 10))
    flat, view = scene(room, lamp), pose((0.3, 0.3, 1.0), (1.5, 1.5, 0.2))
    np.testing.assert_array_equal(radiance(flat, view, depth=2), radiance(flat, view, depth=2, caustic_blur=1.0))
    exact, blurred = radiance(flat, view), radiance(flat, view, caustic_blur=1.0)
    assert not np.array_equal(exact, blurred)
    np.testing.assert_allclose(blurred.mean(), exact.mean(), rtol=0.03)


def test_blurred_textures_leave_what_the_camera_sees_alone_and_keep_their_energy():
    seen = SCENES["textured room"]()
    views = {"size": (40, 30), "fov": seen.horizontal_fov_rad, "samples": 128}
    np.testing.assert_array_equal(
        radiance(seen.flat, seen.pose, depth=2, **views), radiance(seen.flat, seen.pose, depth=2, blur_textures=False, **views)
    )
    blurred, sharp = radiance(seen.flat, seen.pose, **views), radiance(seen.flat, seen.pose, blur_textures=False, **views)
    assert not np.array_equal(blurred, sharp)
    np.testing.assert_allclose(blurred.mean(), sharp.mean(), rtol=0.005)


def test_odd_scenes_give_no_nan():
    sliver = quad((0, 0, 0.5), (1, 0, 0), (2, 0, 0), emission=(5, 5, 5))
    black = box((0.2, 0.2, 0), (0.6, 0.6, 0.4), color=(0, 0, 0), ior=1.0)
    smooth = box((1.0, 0.2, 0), (1.4, 0.6, 0.4), color=ALL, transmission=1.0, roughness=0.0, ior=1.0)
    room = box((0, 0, 0), (2, 2, 2), inside=True, emission=(1, 1, 1), color=ALL)
    flat = scene(room, sliver, black, smooth)
    for eye in ((1.0, 1.0, 1.0), (1.2, 0.4, 0.2), (2.0, 1.0, 1.0), (1.0, 1.0, 0.5), (5.0, 5.0, 5.0)):
        radiance(flat, pose(eye, (0.4, 0.4, 0.2)), samples=4, fov=2.0)
    for size in ((1, 1), (1, 37), (17, 1)):
        assert radiance(flat, pose((1, 1, 1), (0.4, 0.4, 0.2)), samples=1, size=size).shape == (size[1], size[0], 3)


def test_the_last_tile_of_an_8k_image_is_that_of_a_small_one():
    """Indices reach the last pixel of 33 million; the film's untouched pages cost no memory."""
    camera, view = CameraConfig(width=7680, height=4320, horizontal_fov_rad=1.0), pose((0.5, 0.5, 1.0), (1.5, 1.4, 0.9))
    room = box((0, 0, 0), (2, 2, 2), inside=True, emission=(3, 2, 1), color=(0, 0, 0))
    film = Film(np.zeros((4320, 7680, 3), np.float32), *(np.zeros((0, 0, size), np.float32) for size in (3, 6, 3, 3, 2, 3)))
    tiles = (7680 // WAVE_EDGE) * (4320 // WAVE_EDGE)
    with Renderer(scene(room), camera, RenderConfig(threads=1), 11) as renderer:
        posed = pose_camera(camera, view)
        transport = Transport(np.uint32(1), 3, np.float32(np.inf), np.float32(0.0), np.float32(np.inf))
        scratch = make_scratch(len(renderer._scene.lights.groups.area))
        work = Work(tiles - 1, tiles, 0, 4)
        trace_paths(renderer._scene.lit, posed, transport, work, scratch, film)
    tile = film.light[-WAVE_EDGE:, -WAVE_EDGE:]
    np.testing.assert_allclose(tile, np.broadcast_to([12.0, 8.0, 4.0], tile.shape), rtol=1e-5)
    assert film.light[-WAVE_EDGE:, :-WAVE_EDGE].max() == 0 and film.light[-WAVE_EDGE - 1].max() == 0


def test_aovs_look_into_mirrors():
    """The denoiser's AOVs show what a mirror shows, tinted by it; the layer of albedo shows the mirror itself."""
    wall = quad((-2, 3, -2), (4, 0, 0), (0, 0, 4), color=(0.2, 0.5, 0.8), ior=1.0)
    mirror = quad((-2, -1, -2), (0, 0, 4), (4, 0, 0), color=(0.5, 0.5, 0.5), metallic=1.0, roughness=0.02)
    camera, view = CameraConfig(width=16, height=16, horizontal_fov_rad=0.2), pose((0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
    film = Film(
        *(np.zeros((16, 16, size), np.float32) for size in (3, 3, 6)), *(np.zeros((0, 0, size), np.float32) for size in (3, 3, 2, 3))
    )
    with Renderer(
        scene(wall, mirror, quad((0, 1.5, 5), (1, 0, 0), (0, 1, 0), emission=(9, 9, 9))), camera, RenderConfig(threads=1), 1
    ) as renderer:
        transport = Transport(np.uint32(1), 3, np.float32(np.inf), np.float32(0.0), np.float32(np.inf))
        scratch = make_scratch(len(renderer._scene.lights.groups.area))
        posed = pose_camera(camera, view)
        trace_paths(renderer._scene.lit, posed, transport, Work(0, 1, 0, 64), scratch, film)
    np.testing.assert_allclose(film.albedo.mean(axis=(0, 1)) / 64, 0.5, rtol=1e-3)
    aov = film.aov.mean(axis=(0, 1)) / 64
    np.testing.assert_allclose(aov[:3], 0.5 * np.array([0.2, 0.5, 0.8]), rtol=0.03)
    np.testing.assert_allclose(aov[3:], [0.0, -1.0, 0.0], atol=1e-3)
