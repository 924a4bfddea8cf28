"""What gloss shows of lamps and panes, with known answers or by paths."""

import numpy as np
import pytest
from box_room import DARK, box, hollow_sphere, pose, quad, scene
from cached_rooms import look_up
from single_surfaces import seen

from renderer import CameraConfig
from renderer.cached_frames.lamp_shapes import build_lamps
from renderer.scene.flat_scene import Sky


def test_a_lamp_shows_its_luminance_from_its_front_only():
    lamp = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), emission=(300, 200, 100), color=(0, 0, 0))
    np.testing.assert_allclose(seen(lamp), np.tile([300.0, 200, 100], (24, 32, 1)), rtol=1e-5)
    assert seen(lamp, view=pose((0, 4, 0), (0, 1, 0))).max() == 0.0


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
