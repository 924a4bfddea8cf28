"""Frames of single surfaces with known answers: matt planes, mirrors, glass, panes, lamps in gloss, the sun."""

import numpy as np
import pytest
from box_room import DARK, box, hollow_sphere, pose, quad, scene
from cached_rooms import CACHED, look_up

from renderer import CameraConfig, Renderer
from renderer.cached_frames.gloss_rays import pixel_noise
from renderer.cached_frames.lamp_shapes import build_lamps
from renderer.cached_frames.mirrored import limit_seen
from renderer.cached_frames.records import EVEN, KIND, LEFT, RAY_ALPHA, SEEN, SHARP, make_shade_scratch
from renderer.core.kernel import from_python
from renderer.path.records import make_scratch
from renderer.scene.flat_scene import Sky

NARROW = CameraConfig(width=32, height=24, horizontal_fov_rad=0.1)
AHEAD = pose((0, 0, 0), (0, 1, 0))


def seen(*pieces, view=AHEAD, sky=DARK, **settings):
    image = look_up(scene(*pieces, sky=sky), view, camera=NARROW, **settings).radiance.astype(float)
    assert np.isfinite(image).all() and (image >= 0).all()
    return image


def test_a_lamp_shows_its_luminance_from_its_front_only():
    lamp = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), emission=(300, 200, 100), color=(0, 0, 0))
    np.testing.assert_allclose(seen(lamp), np.tile([300.0, 200, 100], (24, 32, 1)), rtol=1e-5)
    assert seen(lamp, view=pose((0, 4, 0), (0, 1, 0))).max() == 0.0


def test_a_matt_wall_shows_its_colour_times_illuminance():
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.8, 0.4, 0.2), roughness=1.0)
    lamp = quad((-0.5, 0, 0.5), (1, 0, 0), (0, 0, 1), emission=(100, 100, 100), color=(0, 0, 0))
    cached = seen(wall, lamp._replace(faces=lamp.faces[:, ::-1]))
    traced = seen(wall, lamp._replace(faces=lamp.faces[:, ::-1]), integrator="path", samples_per_pixel=64, threads=2)
    assert traced.mean() > 1.0
    np.testing.assert_allclose(cached.mean(axis=(0, 1)), traced.mean(axis=(0, 1)), rtol=0.02)


def test_a_mirror_shows_what_stands_opposite():
    mirror = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9, 0.8, 0.7), metallic=1.0, roughness=0.0)
    lamp = quad((3, -3, -3), (-6, 0, 0), (0, 0, 6), emission=(40, 40, 40), color=(0, 0, 0))
    np.testing.assert_allclose(seen(mirror, lamp).mean(axis=(0, 1)), 40 * np.array([0.9, 0.8, 0.7]), rtol=0.02)


def test_a_mirror_shows_a_wall_as_bright_as_it_is():
    mirror = quad((-3, 2, -3), (6, 0, 0), (0, 0, 6), color=(1, 1, 1), metallic=1.0, roughness=0.0)
    room = box((-4, -4, -4), (4, 4, 4), inside=True, glow_cd_m2=10.0, color=(1, 1, 1), object_id=0)
    np.testing.assert_allclose(seen(mirror, room), 10 / 0.97, rtol=0.03)


@pytest.mark.parametrize(("color", "roughness"), [((0.8, 0.8, 0.8), 1.0), ((0.4, 0.1, 0.04), 0.9), ((0.4, 0.1, 0.04), 0.7)])
def test_a_mirror_shows_a_wall_with_its_shadows_as_it_is_seen_itself(color, roughness):
    """The camera sees the same piece of wall ahead, in a mirror, and behind itself, three times as near."""
    wall = quad((-2, -2, -2), (0, 0, 4), (4, 0, 0), color=color, roughness=roughness, ior=1.5 if roughness < 1.0 else 1.0)
    shelf = box((-0.15, -2, 0.05), (0.15, -1.9, 0.07), color=(0.5, 0.5, 0.5), roughness=1.0)
    lamp = quad((-0.1, -1.4, 1.5), (0, 0.2, 0), (0.2, 0, 0), emission=(500, 500, 500), color=(0, 0, 0))
    room = box((-4, -4, -4), (4, 4, 4), inside=True, color=(0.5, 0.5, 0.5), roughness=1.0, object_id=0)
    mirror = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)
    flat, near = (
        scene(wall, shelf, lamp, room, mirror, sky=DARK),
        CameraConfig(width=32, height=24, horizontal_fov_rad=2 * np.arctan(3 * np.tan(0.05))),
    )
    shown = look_up(flat, AHEAD, camera=NARROW).radiance
    itself = 0.9 * look_up(flat, pose((0, 0, 0), (0, -1, 0)), camera=near).radiance[:, ::-1]
    assert itself[..., 0].min() < 0.4 * itself[..., 0].max()
    np.testing.assert_allclose(shown.mean(axis=(0, 1)), itself.mean(axis=(0, 1)), rtol=0.04)
    assert (abs(shown - itself).max(axis=2) < 0.1 * itself.max(axis=2)).mean() > 0.93


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.3])
def test_metal_shows_the_light_on_itself_where_all_that_it_mirrors_lies_beside_black_nodes(roughness):
    """Nodes within gaps are black, and the rays that end between them and the gap's end tell nothing."""
    metal = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.8, 0.8, 0.8), metallic=1.0, roughness=roughness)
    room = box((-4, -4, -4), (4, 4, 4), inside=True, color=(0.5, 0.5, 0.5), object_id=0)
    lamp = quad((-2, -1, 1.5), (0, 4, 0), (4, 0, 0), emission=(100, 100, 100), color=(0, 0, 0))
    with Renderer(scene(metal, room, lamp, sky=DARK), NARROW, CACHED, 5) as renderer:
        lit = renderer.render(AHEAD, 0, ("radiance",)).radiance[..., 1].mean()
        tables = renderer.cached()._tables
        for table in (tables.rows, tables.sun, tables.even, tables.around, tables.leaving):
            table[:] = 0.0
        assert 0.3 * lit < renderer.render(AHEAD, 0, ("radiance",)).radiance[..., 1].mean() < 3.0 * lit


@pytest.mark.parametrize("transmission", [0.5, 0.8, 1.0])
def test_glass_in_a_mirror_scatters_and_mirrors_what_falls_on_it(transmission):
    mirror = quad((-3, 2, -3), (6, 0, 0), (0, 0, 6), color=(1, 1, 1), metallic=1.0, roughness=0.0)
    glass = box((-3, -1.02, -3), (3, -1, 3), color=(0.7, 0.7, 0.7), transmission=transmission, ior=1.5, roughness=0.0)
    room = box((-4, -4, -4), (4, 4, 4), inside=True, glow_cd_m2=10.0, color=(0.5, 0.5, 0.5), object_id=0)
    traced = seen(mirror, glass, room, integrator="path", samples_per_pixel=128, threads=2).mean()
    assert seen(mirror, glass, room).mean() == pytest.approx(traced, rel=0.12)


def test_a_pane_shows_the_sky_through_it_and_the_lamp_in_it_as_the_path_tracer_does():
    sky = Sky(*(np.full(3, 100, np.float32) for _ in range(3)))
    pane = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), portal=True, transmission=0.9, ior=1.5, roughness=0.0)
    lamp = quad((3, -3, -3), (-6, 0, 0), (0, 0, 6), emission=(5000, 5000, 5000), color=(0, 0, 0))
    traced = seen(pane, lamp, sky=sky, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert seen(pane, lamp, sky=sky).mean() == pytest.approx(traced, rel=0.02)


def test_clear_glass_shows_what_stands_behind_it():
    plate = box((-1, 2, -1), (1, 2.01, 1), color=(0.81, 0.49, 0.25), transmission=1.0, ior=1.5, roughness=0.0)
    lamp = quad((-3, 4, -3), (6, 0, 0), (0, 0, 6), emission=(100, 100, 100), color=(0, 0, 0))
    np.testing.assert_allclose(seen(plate, lamp).mean(axis=(0, 1)), 100 * np.array([0.81, 0.49, 0.25]) * 0.96**2, rtol=0.02)


@pytest.mark.parametrize(("plate_y", "share"), [(1.0, 0.96**2), (3.0, 1.0), (None, 1.0)])
def test_a_wall_is_lit_through_clear_glass_wherever_it_stands(plate_y, share):
    """Shadow rays through glass go on; a board hides all of a second lamp, whether or not there is glass elsewhere."""
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.8, 0.4, 0.2), roughness=1.0)
    lamp, hidden = (quad((x - 0.1, 0, 0.5), (0.2, 0, 0), (0, 0, 0.2), emission=(100,) * 3, color=(0, 0, 0)) for x in (0.0, 6.0))
    lamp, hidden = (piece._replace(faces=piece.faces[:, ::-1]) for piece in (lamp, hidden))
    board = quad((3, -1, -2), (0, 3, 0), (0, 0, 4), color=(0, 0, 0), roughness=1.0)
    glass = [box((-2, plate_y, -2), (2, plate_y + 0.01, 2), color=(1, 1, 1), transmission=1.0, ior=1.5, roughness=0.0)] if plate_y else []
    bare, lit = (seen(wall, lamp, board, *more, view=pose((0, 1.5, 0), (0, 2, 0))) for more in ((), (hidden, *glass)))
    assert bare.mean() > 0.1 and lit.mean() == pytest.approx(share * bare.mean(), rel=0.03)


def test_a_floor_in_the_sun_is_lit_by_lambert():
    way, lux, versine = np.array([0.0, 0.6, 0.8]), np.array([90e3, 80e3, 60e3]), 1.0 - np.cos(np.radians(0.533 / 2))
    sky = DARK._replace(sun=np.array([*way, versine, *(lux / (2 * np.pi * versine))], np.float32))
    floor = quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), color=(0.8, 0.4, 0.2), roughness=1.0)
    pane = quad((-2, 1.5, 0.2), (4, 0, 0), (0, 0, 1), portal=True, transmission=0.9)
    view = pose((0.1, 1.0, 1.5), (0.0, 1.0, 0.0))
    cached = seen(floor, pane, view=view, sky=sky)
    traced = seen(floor, pane, view=view, sky=sky, integrator="path", samples_per_pixel=64, threads=2)
    assert traced.mean() > 1e3 and cached.std(axis=(0, 1)).max() < 0.01 * cached.mean(), "the disc's own shades are no noise"
    np.testing.assert_allclose(cached.mean(axis=(0, 1)), traced.mean(axis=(0, 1)), rtol=0.02)


def test_lamps_are_balls_of_their_size_and_place():
    bulb = hollow_sphere(8, emission=(50, 40, 30), color=(0, 0, 0))
    panel = quad((2, 0, 2), (0, 1, 0), (1, 0, 0), emission=(7, 7, 7), color=(0, 0, 0))
    lamps = build_lamps(
        scene(box((0, 0, 0), (1, 1, 1)), bulb._replace(vertices=0.5 * bulb.vertices + (0, 0, 3), faces=bulb.faces[:, ::-1]), panel), DARK
    )
    assert lamps.part.tolist() == [1, 2] and lamps.most.tolist() == [120.0, 21.0]
    np.testing.assert_allclose(lamps.balls[0, :4], [0, 0, 3, 0.5], atol=0.02)
    np.testing.assert_allclose(lamps.balls[1, :8], [2.5, 0.5, 2, np.sqrt(1 / np.pi), 0, 0, -1, 1], atol=1e-5)
    assert lamps.balls[0, 7] == 0.0


def test_each_pane_is_a_rectangle():
    panes = [quad((x, 2, 1), (1, 0, 0), (0, 0, 1), portal=True, transmission=0.9) for x in (0, 1)]
    tall = quad((4, 0, 1), (0, -1, 0), (0, 0, 2), portal=True, transmission=0.9)
    sky = DARK._replace(zenith=np.array([3.0, 4.0, 5.0], np.float32))
    lamps = build_lamps(scene(box((0, 0, 0), (1, 1, 1)), *panes, tall), sky)
    assert lamps.part.tolist() == [1, 2, 3] and lamps.most.tolist() == [12.0] * 3
    np.testing.assert_allclose(lamps.balls[1, :8], [1.5, 2, 1.5, np.sqrt(1 / np.pi), 0, -1, 0, 1], atol=1e-5)
    np.testing.assert_allclose(lamps.balls[2, :4], [4, -0.5, 2, np.sqrt(2 / np.pi)], atol=1e-5)
    sides = lamps.balls[2, 8:14].reshape(2, 3)
    np.testing.assert_allclose(np.sort(np.linalg.norm(sides, axis=1)), [0.5, 1.0], atol=1e-5)
    np.testing.assert_allclose(sides[..., 0], 0.0, atol=1e-6)


@pytest.mark.parametrize(("metallic", "roughness"), [(1.0, 0.4), (1.0, 0.5), (0.0, 0.35)])
def test_rough_gloss_shows_a_lamp_as_bright_as_the_path_tracer_does(metallic, roughness):
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9 * metallic,) * 3, metallic=metallic, roughness=roughness, ior=1.5)
    lamp = quad((0.15, -1, -0.15), (-0.3, 0, 0), (0, 0, 0.3), emission=(1000,) * 3, color=(0, 0, 0))
    cached, traced = seen(wall, lamp), seen(wall, lamp, integrator="path", samples_per_pixel=256, threads=2)
    assert traced.mean() > 0.1 and cached.mean() == pytest.approx(traced.mean(), rel=0.05)


def test_the_sky_is_seen_through_a_net_before_a_pane():
    sky = Sky(*(np.full(3, 1000.0, np.float32) for _ in range(3)))
    pane = quad((-1, 3, -1), (2, 0, 0), (0, 0, 2), portal=True, transmission=0.9, ior=1.5, roughness=0.0)
    net = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9,) * 3, transmission=0.5, diffuse_transmission=0.3, ior=1.5, roughness=1.0)
    cached, traced = seen(net, pane, sky=sky), seen(net, pane, sky=sky, integrator="path", samples_per_pixel=256, threads=2)
    assert traced.mean() > 300.0 and cached.mean() == pytest.approx(traced.mean(), rel=0.06)


@pytest.mark.parametrize("turn_rad", [0.0, 0.9])
def test_a_lamp_that_is_flat_or_long_shows_what_of_it_is_seen_from_there(turn_rad):
    """A plate of light whose edge is turned to the wall: an ellipsoid stands for it, which shows a little less aslant."""
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9,) * 3, metallic=1.0, roughness=0.5, ior=1.5)
    plate = box((-0.08, -0.08, -0.01), (0.08, 0.08, 0.01), emission=(1000,) * 3, color=(0, 0, 0))
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    lamp = plate._replace(vertices=plate.vertices @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]) + (0, -1, 0))
    cached, traced = seen(wall, lamp), seen(wall, lamp, integrator="path", samples_per_pixel=256, threads=2)
    assert cached.mean() == pytest.approx(traced.mean(), rel=0.15)


def sends_ray(where, x, y):
    return {"metal": (x + y) % 2 == 0, "gloss": (x | y) % 2 == 0, "post": ((x + y) % 2 == 0) & (x // 2 == 12)}[where]


@pytest.mark.parametrize(("where", "error"), [("metal", 0.2), ("gloss", 0.3), ("post", 0.8)])
def test_the_rays_that_pixels_share_find_what_fills_a_tenth_of_their_lobe(where, error):
    """By a tent over 15 x 15 pixels, of which a half or a quarter send rays, or a half of an upright post two pixels wide; rms."""
    (y, x), noise_of = np.mgrid[:64, :64], from_python(pixel_noise)
    noise = [noise_of(int(u), int(v), np.uint32(23)) for u, v in zip(x.ravel(), y.ravel(), strict=True)]
    u, v = np.array(noise, np.float64).reshape(64, 64, 2).transpose(2, 0, 1)
    tent, errors = 8.0 - np.abs(np.arange(-7, 8)), []
    weights = sends_ray(where, x, y).astype(float)
    for middle in np.random.default_rng(3).random((24, 2)):
        away = [np.minimum(np.abs(a - m), 1 - np.abs(a - m)) for a, m in zip((u, v), middle, strict=True)]
        found = weights * (away[0] ** 2 + away[1] ** 2 < 0.1 / np.pi)
        sums = [np.array([np.convolve(line, tent, "same") for line in image]) for image in (found, weights)]
        sums = [np.array([np.convolve(line, tent, "same") for line in image.T]).T[8:-8, 24:26] for image in sums]
        errors.append(sums[0] / sums[1] / 0.1 - 1.0)
    assert 0.01 < np.sqrt(np.mean(np.square(errors))) < error


def test_brushed_metal_shows_no_blocks():
    """A steel wall mirrors a stripe that glows: neighbours differ as much within blocks of 2 x 2 pixels as between them."""
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.6, 0.6, 0.6), metallic=1.0, roughness=0.35)
    stripe = quad((0.25, -1, -2), (-0.5, 0, 0), (0, 0, 4), glow_cd_m2=100.0, color=(1, 1, 1))
    image = look_up(scene(wall, stripe), AHEAD, camera=CameraConfig(width=64, height=48, horizontal_fov_rad=0.5)).radiance[..., 1]
    steps = np.abs(np.diff(image.astype(float), axis=1)).mean(axis=0)
    within, between = steps[::2].mean(), steps[1::2].mean()
    assert image.std() > 1.0 and between == pytest.approx(within, rel=0.25)


def test_a_wide_lamp_shows_in_rough_gloss_from_nearer_than_its_radius():
    """The gloss of a floor before a lamp of 4 x 4 m has no edge where it is as far from the lamp as a disc of that area is wide."""
    floor = quad((-1, -0.5, 0), (2, 0, 0), (0, 6, 0), color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.5)
    lamp = quad((-2, 5.6, -0.01), (4, 0, 0), (0, 0, 4), emission=(100, 100, 100), color=(0, 0, 0))
    camera = CameraConfig(width=16, height=64, horizontal_fov_rad=0.15)
    column = look_up(scene(floor, lamp), pose((0, 0, 1.6), (0, 4.0, 0)), camera=camera).radiance[..., 1].astype(float).mean(axis=1)
    on_floor = column[34:]
    assert np.abs(np.diff(on_floor)).max() < 0.05 * on_floor.mean() and on_floor.min() > 30.0


def test_panes_with_a_bar_between_show_in_a_rough_floor_as_the_path_tracer_has_them():
    """No edges: what stands between the floor and a part of the window takes that part's light."""
    sky = Sky(*(np.full(3, 100, np.float32) for _ in range(3)))
    floor = quad((-2, -0.5, 0), (4, 0, 0), (0, 4.5, 0), color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.5)
    panes = [quad((x, 4, 0.6), (0.5, 0, 0), (0, 0, 1.2), portal=True, transmission=0.9) for x in (-0.75, 0.25)]
    wall = [(-2, 0, 1.25, 2.5), (-0.25, 0, 0.5, 2.5), (0.75, 0, 1.25, 2.5), (-2, 0, 4, 0.6), (-2, 1.8, 4, 0.7)]
    walls = [quad((x, 4, z), (width, 0, 0), (0, 0, height), color=(0, 0, 0), roughness=1.0) for x, z, width, height in wall]
    found, camera = [], CameraConfig(width=48, height=36, horizontal_fov_rad=0.8)
    for settings in ({}, {"integrator": "path", "samples_per_pixel": 256, "threads": 2}):
        image = look_up(scene(floor, *panes, *walls, sky=sky), pose((0, 0, 1.5), (0, 2.8, 0)), camera=camera, **settings).radiance
        found.append(image[9:, :, 1].astype(float))
    assert np.abs(found[0] - found[1]).mean() < 0.06 * found[1].mean()


@pytest.mark.parametrize("hidden", ["near", "far"])
def test_what_a_board_leaves_of_a_lamp_shows_as_much_as_the_lobe_has_of_it(hidden):
    """Not as much as it has of the lamp's middle: where the mirrored ray meets the board, the lobe's flank sees the rest."""
    floor = quad((-1, -0.5, 0), (2, 0, 0), (0, 4.5, 0), color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.45)
    lamp = quad((-0.5, 4, 0.05), (1, 0, 0), (0, 0, 2.4), emission=(100, 100, 100), color=(0, 0, 0))
    low_m, high_m = (0.0, 1.2) if hidden == "near" else (1.2, 2.8)
    board = quad((-1.5, 3.9, low_m), (3, 0, 0), (0, 0, high_m - low_m), color=(0, 0, 0), roughness=1.0)
    view, camera = pose((0, 0, 0.9), (0, 2.4, 0)), CameraConfig(width=32, height=24, horizontal_fov_rad=0.2)
    cached, traced = (
        look_up(scene(floor, lamp, board), view, camera=camera, **settings).radiance.mean()
        for settings in ({}, {"integrator": "path", "samples_per_pixel": 256, "threads": 2})
    )
    assert traced > 0.5 and cached == pytest.approx(traced, rel=0.04)


def test_rough_gloss_shows_all_that_a_pane_shows_of_the_sky():
    """A red wall stands outside where the floor mirrors the window, bright sky beside it: the lobe's flanks see that."""
    table = np.tile(np.array([300, 400, 500], np.float32), (16, 64, 1))
    table[:, 13:20] = (200, 20, 20)
    floor = quad((-2, -0.5, 0), (4, 0, 0), (0, 4.4, 0), color=(0, 0, 0), roughness=0.4, ior=1.5)
    pane = quad((-1.5, 4, 0.2), (3, 0, 0), (0, 0, 1.5), portal=True, transmission=0.9)
    flat = scene(floor, pane, sky=Sky(*np.zeros((3, 3), np.float32), table))
    view, camera = pose((0, 0, 1.0), (0, 2.4, 0)), CameraConfig(width=32, height=24, horizontal_fov_rad=0.5)
    cached, traced = (
        look_up(flat, view, camera=camera, **settings).radiance[4:].mean(axis=(0, 1))
        for settings in ({}, {"integrator": "path", "samples_per_pixel": 256, "threads": 2})
    )
    assert (np.abs(cached / traced - 1.0) < 0.08).all()


def test_milky_glass_lets_through_what_is_clear_of_it():
    plate = box((-1, 2, -1), (1, 2.01, 1), color=(1, 1, 1), transmission=0.8, ior=1.5, roughness=0.0)
    wall = quad((-1, 3, -1), (2, 0, 0), (0, 0, 2), glow_cd_m2=100.0, color=(1, 1, 1))
    traced = seen(plate, wall, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced < 75.0 and seen(plate, wall).mean() == pytest.approx(traced, rel=0.12)


@pytest.mark.parametrize("roughness", [0.25, 0.4])
def test_a_polished_floor_seen_aslant_mirrors_as_much_as_the_path_tracer_says(roughness):
    """Most of the microfacets that are seen lean to the viewer, and reflect less than those of the mirrored direction."""
    floor = quad((-3, 0, 0), (6, 0, 0), (0, 9, 0), color=(0, 0, 0), roughness=roughness, ior=1.5)
    wall = quad((-6, 9, 0), (12, 0, 0), (0, 0, 6), glow_cd_m2=100.0, color=(1, 1, 1))
    view = pose((0, 0, 0.8), (0, 4, 0))
    traced = seen(floor, wall, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 1.0 and seen(floor, wall, view=view).mean() == pytest.approx(traced, rel=0.08)


def test_slats_right_before_a_window_mirror_its_sky_as_the_path_tracer_says():
    """The mirrored ray meets the pane a hand's breadth behind the slat, far from where the pane's middle is nearest to it."""
    sky = Sky(*(np.full(3, 1000, np.float32) for _ in range(3)))
    pane = quad((-0.7, 2, -0.5), (1.4, 0, 0), (0, 0, 1.0), portal=True, transmission=0.9)
    slat = quad((-0.5, 1.86, 0), (1.0, 0, 0), (0, 0.03, 0.012), color=(0, 0, 0), roughness=0.42, ior=1.5)
    view = pose((0, 1.2, 0.3), (0, 1.875, 0.006))
    camera = CameraConfig(width=32, height=24, horizontal_fov_rad=0.04)
    cached, traced = (
        look_up(scene(slat, pane, sky=sky), view, camera=camera, **settings).radiance.mean()
        for settings in ({}, {"integrator": "path", "samples_per_pixel": 256, "threads": 2})
    )
    assert traced > 10.0 and cached == pytest.approx(traced, rel=0.05)


@pytest.mark.parametrize("lean_deg", [38, 45, 52])
def test_a_slat_that_leans_into_the_room_mirrors_what_another_leaves_of_the_pane_behind(lean_deg):
    """The mirrored ray goes up beside the pane or past its upper rim; most of the pane lies below the horizon of the lobe.

    What the slat above leaves of it is seen less aslant than the rest, so that the glass lets more of it through.
    """
    sky, lean = Sky(*(np.full(3, 1000, np.float32) for _ in range(3))), np.radians(lean_deg)
    across = np.array([0, np.cos(lean), np.sin(lean)]) * 0.02
    near, above = (np.array([0, 1.93, z]) - across / 2 for z in (-0.3, -0.275))
    slat = quad((-0.2, *near[1:]), (0.4, 0, 0), tuple(across), metallic=1.0, roughness=0.43, color=(0.8, 0.8, 0.8))
    other = quad((-0.3, *above[1:]), (0.6, 0, 0), tuple(across), color=(0, 0, 0), roughness=1.0)
    backs = [
        quad((0.4 + x, y, z - 5e-4), (-2 * x - 0.8, 0, 0), tuple(across), color=(0, 0, 0), roughness=1.0)
        for x, (_, y, z) in ((-0.2, near), (-0.1, above))
    ]
    pane = quad((-0.6, 2, -0.6), (1.2, 0, 0), (0, 0, 1.2), portal=True, transmission=0.9, ior=1.7)
    camera, view = CameraConfig(width=32, height=8, horizontal_fov_rad=0.1), pose((0, 0.3, -0.3), (0, 1.93, -0.3))
    cached, traced = (
        look_up(scene(slat, other, *backs, pane, sky=sky), view, camera=camera, **settings).radiance[3:5, 8:24, 1].mean()
        for settings in ({}, {"integrator": "path", "samples_per_pixel": 512, "threads": 2})
    )
    assert traced > 30.0 and cached == pytest.approx(traced, rel=0.12)


def test_both_faces_of_a_plate_of_glass_mirror_what_stands_before_it():
    plate = box((-1, 2, -1), (1, 2.004, 1), color=(1, 1, 1), transmission=1.0, ior=1.5, roughness=0.0)
    lit = quad((1, -1, -1), (-2, 0, 0), (0, 0, 2), glow_cd_m2=100.0, color=(1, 1, 1))
    traced = seen(plate, lit, integrator="path", samples_per_pixel=64, threads=2).mean()
    assert traced > 7.0 and seen(plate, lit).mean() == pytest.approx(traced, rel=0.05)


@pytest.mark.parametrize("roughness", [0.2, 0.42])
def test_a_window_behind_a_blind_shows_in_a_polished_table_without_dots_grids_or_blocks(roughness):
    """Slats hide two thirds of the window; the table's colour is smooth from pixel to pixel, and that of the path tracer over blocks."""
    sky = Sky(*(np.full(3, 1000, np.float32) for _ in range(3)))
    table = quad((-2, -0.5, 0), (4, 0, 0), (0, 4.4, 0), color=(0.2, 0.1, 0.05), roughness=roughness, ior=1.5)
    pane = quad((-0.75, 4, 0.3), (1.5, 0, 0), (0, 0, 1.2), portal=True, transmission=0.9)
    blind = [quad((-0.8, 3.95, 0.3 + 0.06 * i), (1.6, 0, 0), (0, 0, 0.04), color=(0, 0, 0), roughness=1.0) for i in range(20)]
    wall = [(-2, 0, 1.25, 2.5), (0.75, 0, 1.25, 2.5), (-0.75, 0, 1.5, 0.3), (-0.75, 1.5, 1.5, 1.0)]
    walls = [quad((x, 4, z), (width, 0, 0), (0, 0, height), color=(0, 0, 0), roughness=1.0) for x, z, width, height in wall]
    found, camera = [], CameraConfig(width=64, height=48, horizontal_fov_rad=0.5)
    for settings in ({}, {"integrator": "path", "samples_per_pixel": 256, "threads": 2}):
        image = look_up(scene(table, pane, *blind, *walls, sky=sky), pose((0, 0, 1.2), (0, 1.9, 0)), camera=camera, **settings).radiance
        found.append(image[..., 1].astype(float))
    cached, traced = found
    blocks = [image.reshape(6, 8, 8, 8).mean(axis=(1, 3)) for image in found]
    assert np.abs(blocks[0] - blocks[1]).mean() < 0.1 * traced.mean()
    # How pixels within the window's image differ from neighbours left and right, those at equal places in tiles of 4 x 4, and all.
    bend = cached[:, 17:47] - 0.5 * (cached[:, 16:46] + cached[:, 18:48])
    by_place = np.array([[bend[i::4, j::4].mean() for j in range(4)] for i in range(4)])
    assert np.abs(by_place).max() < 0.004 * traced.mean(), "a grid"
    assert np.abs(bend).mean() < 0.012 * traced.mean() and np.abs(bend).max() < 0.15 * traced.mean(), "dots or blocks"


def test_a_window_shows_in_an_upright_door_without_a_step_where_the_horizon_is():
    """Half of what the window shows is ground; which half is seen from a door changes with height, and what it mirrors does so smoothly."""
    sky = Sky(*(np.full(3, luminance, np.float32) for luminance in (1000, 1000, 50)))
    door = quad((1, 0, 0), (0, 4, 0), (0, 0, 2.5), color=(0.1, 0.1, 0.1), roughness=0.42, ior=1.5)
    pane = quad((-0.5, 4, 0.6), (1.2, 0, 0), (0, 0, 1.4), portal=True, transmission=0.9)
    flat, view = scene(door, pane, sky=sky), pose((-0.5, 0.5, 1.3), (1.0, 2.4, 1.3))
    camera = CameraConfig(width=32, height=48, horizontal_fov_rad=0.3)
    cached = look_up(flat, view, camera=camera).radiance[..., 1].astype(float)
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=256, threads=2).radiance[..., 1]
    assert traced.mean() > 1.0 and cached.mean() == pytest.approx(traced.mean(), rel=0.1)
    assert np.abs(np.diff(cached.mean(axis=1), 2)).max() < 0.05 * cached.mean()


@pytest.mark.parametrize(("roughness", "error"), [(0.35, 0.1), (0.15, 0.2)])
def test_metal_shows_a_polished_dark_floor_without_the_lamp_that_it_mirrors_elsewhere(roughness, error):
    """The lamp hangs above the floor: what of its light the floor's gloss mirrors goes up, not to the metal."""
    floor = quad((-3, -1, 0), (6, 0, 0), (0, 3, 0), color=(0.05, 0.05, 0.05), roughness=0.3, ior=1.5)
    metal = quad((-1, 2, 0), (2, 0, 0), (0, 0, 1), color=(0.6, 0.6, 0.6), metallic=1.0, roughness=roughness)
    lamp = quad((-0.3, 0.7, 3), (0, 0.6, 0), (0.6, 0, 0), emission=(1000,) * 3, color=(0, 0, 0))
    view = pose((0, 0, 0.8), (0, 2, 0.3))
    traced = seen(floor, metal, lamp, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 0.1 and seen(floor, metal, lamp, view=view).mean() == pytest.approx(traced, rel=error)


@pytest.mark.parametrize("roughness", [0.1, 0.35])
def test_metal_shows_the_light_that_a_sheet_lets_through(roughness):
    """A lamp stands behind a sheet: on the side that the metal faces nothing else falls on it."""
    sheet = quad((2, -1, -1), (-4, 0, 0), (0, 0, 3), color=(0.8, 0.8, 0.8), diffuse_transmission=0.6)
    lamp = quad((1.5, -2.5, -0.5), (-3, 0, 0), (0, 0, 2), emission=(300,) * 3, color=(0, 0, 0))
    metal = quad((-1, 2, 0), (2, 0, 0), (0, 0, 1), color=(0.6, 0.6, 0.6), metallic=1.0, roughness=roughness)
    view = pose((0, 0, 0.5), (0, 2, 0.5))
    traced = seen(sheet, metal, lamp, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 1.0 and seen(sheet, metal, lamp, view=view).mean() == pytest.approx(traced, rel=0.08)


@pytest.mark.parametrize("before", ["dark", "bright"])
def test_what_lies_under_a_smooth_coat_mirrors_what_is_before_it_and_not_the_light_around(before):
    """A dark lacquered floor between a glowing wall and a dark one: its rough lobe shows the one ahead, as its coat does."""
    floor = quad((-3, 0, 0), (6, 0, 0), (0, 6, 0), color=(0.02, 0.02, 0.02), roughness=0.3, ior=1.5, clearcoat=0.9, clearcoat_roughness=0.1)
    glow = 100.0 if before == "bright" else 2.0
    ahead = quad((-6, 6, 0), (12, 0, 0), (0, 0, 4), glow_cd_m2=glow, color=(1, 1, 1))
    behind = quad((6, -1, 0), (-12, 0, 0), (0, 0, 4), glow_cd_m2=102.0 - glow, color=(1, 1, 1))
    view = pose((0, 0, 1.2), (0, 2.4, 0))
    traced = seen(floor, ahead, behind, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 0.1 and seen(floor, ahead, behind, view=view).mean() == pytest.approx(traced, rel=0.08)


@pytest.mark.parametrize("light", ["lamp", "pane"])
@pytest.mark.parametrize("coat_roughness", [0.08, 0.12])
def test_a_light_shows_in_a_coat_and_under_it(light, coat_roughness):
    sky = Sky(*(np.full(3, 500, np.float32) for _ in range(3)))
    wall = quad(
        (-1, 2, -1),
        (2, 0, 0),
        (0, 0, 2),
        color=(0.02, 0.02, 0.02),
        roughness=0.35,
        ior=1.5,
        clearcoat=0.9,
        clearcoat_roughness=coat_roughness,
    )
    what = {"portal": True, "transmission": 0.9} if light == "pane" else {"emission": (500,) * 3, "color": (0, 0, 0)}
    square = quad((0.35, -1, -0.15), (-0.3, 0, 0), (0, 0, 0.3), **what)
    cached, traced = seen(wall, square, sky=sky), seen(wall, square, sky=sky, integrator="path", samples_per_pixel=512, threads=2)
    assert traced.mean() > 0.1 and cached.mean() == pytest.approx(traced.mean(), rel=0.08)


@pytest.mark.parametrize("left_m", [-1.2, 0.0])
def test_what_a_board_leaves_of_a_pane_shows_in_a_coat_and_under_it(left_m):
    """On either side: points chosen by the coat's lobe ask for all of the pane, as those by the lobe under it do."""
    what = {"color": (0.02, 0.02, 0.02), "roughness": 0.5, "ior": 1.5, "clearcoat": 0.9, "clearcoat_roughness": 0.12}
    floor, pane = (
        quad((-2, -2, 0), (4, 0, 0), (0, 3.5, 0), **what),
        quad((-1, 1.5, 0.3), (2, 0, 0), (0, 0, 1.5), portal=True, transmission=0.9),
    )
    board = quad((left_m, 1.45, 0), (1.2, 0, 0), (0, 0, 2), color=(0, 0, 0), roughness=1.0)
    flat = scene(floor, pane, board, sky=Sky(*np.full((3, 3), 1000.0, np.float32)))
    view, camera = pose((0.0, -1.5, 0.9), (0.0, 0.5, 0.0)), CameraConfig(width=32, height=24, horizontal_fov_rad=0.25)
    cached, traced = (
        look_up(flat, view, camera=camera, **settings).radiance.mean()
        for settings in ({}, {"integrator": "path", "samples_per_pixel": 256, "threads": 2})
    )
    assert cached == pytest.approx(traced, rel=0.04)


@pytest.mark.parametrize("roughness", [0.59, 0.61])
def test_dark_leather_mirrors_alike_on_both_sides_of_the_roughness_that_counts_as_matt(roughness):
    """A textured roughness may cross it from pixel to pixel; what is seen of it must not."""
    floor = quad((-3, 0, 0), (6, 0, 0), (0, 6, 0), color=(0.02, 0.02, 0.02), roughness=roughness, ior=1.5)
    ahead = quad((-6, 6, 0), (12, 0, 0), (0, 0, 4), glow_cd_m2=2.0, color=(1, 1, 1))
    behind = quad((6, -1, 0), (-12, 0, 0), (0, 0, 4), glow_cd_m2=100.0, color=(1, 1, 1))
    view = pose((0, 0, 1.2), (0, 2.4, 0))
    traced = seen(floor, ahead, behind, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 0.1 and seen(floor, ahead, behind, view=view).mean() == pytest.approx(traced, rel=0.12)


@pytest.mark.parametrize(("alpha", "expected"), [(0.2, 8.0 * (3.0 + 5.0) / 4.0), (0.5 * float(SHARP), 1000.0)], ids=["rough", "sharp"])
def test_one_ray_of_a_rough_lobe_is_not_much_brighter_than_its_neighbours(alpha, expected):
    """Of four rays three see 1 and one, whose surface has 5 around it, sees 1000; what a smooth mirror shows stays as bright as it is."""
    primary = make_shade_scratch(make_scratch(0)).primary
    primary[KIND, :4], primary[RAY_ALPHA, :4], primary[SEEN : SEEN + 3, :4] = 1.0, alpha, 1.0
    primary[SEEN : SEEN + 3, 2], primary[EVEN : EVEN + 3, 2] = 1000.0, 5.0
    from_python(limit_seen)(primary)
    np.testing.assert_allclose(primary[SEEN, :4], [1.0, 1.0, expected, 1.0], rtol=1e-6)


def test_a_ray_that_has_come_to_the_sky_keeps_what_it_sees():
    """Few of many do between slats."""
    primary = make_shade_scratch(make_scratch(0)).primary
    primary[KIND, :4], primary[RAY_ALPHA, :4], primary[SEEN : SEEN + 3, :4] = 1.0, 0.2, 1.0
    primary[SEEN : SEEN + 3, 2], primary[LEFT, 2] = 1000.0, 1.0
    from_python(limit_seen)(primary)
    assert primary[SEEN, 2] == 1000.0


def test_a_ray_that_alone_sees_light_keeps_it():
    """Its own surface has none but the sun's, which is not of EVEN."""
    primary = make_shade_scratch(make_scratch(0)).primary
    primary[KIND, 0], primary[RAY_ALPHA, 0], primary[SEEN : SEEN + 3, 0] = 1.0, 0.2, 7.0
    from_python(limit_seen)(primary)
    assert primary[SEEN, 0] == 7.0


@pytest.mark.parametrize(("roughness", "within"), [(0.05, 0.02), (0.2, 0.15)])
def test_a_floor_mirrors_what_stands_outside_a_window_and_the_sky_above_it(roughness, within):
    """A dark floor before a window, outside which a bright fence hides the lower half of the sky."""
    floor = quad((-2, -2, 0), (4, 0, 0), (0, 3.5, 0), color=(0.02, 0.02, 0.02), roughness=roughness, ior=1.5)
    pane = quad((-2, 1.5, 0.0), (4, 0, 0), (0, 0, 2), portal=True, transmission=0.9)
    fence = quad((-9, 6.0, 0.0), (18, 0, 0), (0, 0, 2.0), glow_cd_m2=300.0, color=(1, 1, 1))
    sky, view = Sky(*np.full((3, 3), 100.0, np.float32)), pose((0.0, -1.5, 0.9), (0.0, 0.7, 0.0))
    camera, flat = CameraConfig(width=32, height=24, horizontal_fov_rad=0.25), scene(floor, pane, fence, sky=sky)
    cached = look_up(flat, view, camera=camera).radiance[..., 1]
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=256, threads=2).radiance[..., 1]
    assert cached.mean() == pytest.approx(traced.mean(), rel=within)


def test_a_bowl_of_brushed_metal_shows_its_sides_as_they_mirror():
    """A sink below a bright ceiling in a dark room, seen aslant: its far side mirrors the wall above it, not all that falls on it."""
    steel = {"metallic": 1.0, "roughness": 0.3, "color": (0.55, 0.55, 0.55)}
    bowl = box((-0.2, 0.8, -0.2), (0.2, 1.2, 0.0), inside=True, **steel)
    bowl = bowl._replace(faces=bowl.faces[np.abs(bowl.vertices[bowl.faces][..., 2]).max(axis=1) > 1e-6])
    ceiling = quad((-2, -2, 2.2), (0, 4, 0), (4, 0, 0), glow_cd_m2=100.0, color=(1, 1, 1))
    wall = quad((-2, 1.6, -1), (4, 0, 0), (0, 0, 3), color=(0.05, 0.05, 0.05), roughness=1.0)
    view = pose((0.0, 0.0, 0.8), (0.0, 1.0, -0.2))
    camera = CameraConfig(width=32, height=24, horizontal_fov_rad=0.25)
    flat = scene(bowl, ceiling, wall)
    cached = look_up(flat, view, camera=camera).radiance[..., 1].mean()
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=256, threads=2).radiance[..., 1].mean()
    assert cached == pytest.approx(traced, rel=0.12)
