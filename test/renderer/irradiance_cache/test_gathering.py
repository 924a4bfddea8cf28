"""Final gathers under uniform light."""

import numpy as np
import pytest
from box_room import DARK, box, pierced, pose, quad, scene
from cached_rooms import filled, look_up, nodes_of, solved

from renderer import CameraConfig
from renderer.irradiance_cache.cache_geometry import CacheConfig
from renderer.scene.flat_scene import Sky

FLOOR = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), color=(0.5, 0.5, 0.5), object_id=0)
EVEN = box((-4, -4, -4), (4, 4, 4), inside=True, glow_cd_m2=10.0, color=(1.0, 0.5, 0.2), object_id=0)
GLOW = 10.0 * np.array([1.0, 0.5, 0.2])
FINE = CacheConfig(spacing_m=0.05, coarse_spacing_m=0.3)
GREY = {"color": (0.5, 0.5, 0.5), "roughness": 1.0}


def at_floor(*others, floor=FLOOR):
    flat = scene(floor, *others)
    cache = filled(flat)
    nodes = nodes_of(cache, 0, flat)
    return cache, nodes, cache.light.indirect[nodes].astype(float)


def test_under_an_even_environment_a_plane_gets_pi_of_its_luminance():
    cache, nodes, lux = at_floor(EVEN)
    np.testing.assert_allclose(lux, np.tile(np.pi * GLOW, (len(lux), 1)), rtol=0.035)
    assert (cache.light.direct[nodes] == 0).all() and (cache.light.valid[nodes] == 1).all()
    np.testing.assert_allclose(cache.rows[nodes, :3], lux, rtol=0.035)
    np.testing.assert_allclose(cache.light.toward[nodes, 2], 1.0, atol=0.02)
    np.testing.assert_allclose(cache.light.toward[nodes].mean(axis=0), [0, 0, 1.0], atol=0.05)


def test_clear_glass_above_takes_its_tint():
    plate = box((-2, -2, 0.02), (2, 2, 0.04), color=(0.5, 0.5, 0.5), transmission=1.0, ior=1.5, roughness=0.0)
    _, _, free = at_floor(EVEN)
    _, _, lux = at_floor(EVEN, plate)
    # Per face the square root of the colour, by chance for each ray.
    assert lux.mean() / free.mean() == pytest.approx(0.5, rel=0.05)


def test_a_mirror_shows_the_room_to_the_floor():
    """A wide mirror across half of all directions doubles back what the other half shows: an even room stays even but for its colour."""
    mirror = quad((0, -3, -3), (0, 6, 0), (0, 0, 6), metallic=1.0, roughness=0.0, color=(0.5, 0.5, 0.5))
    left = quad((-1, -1, 0), (0.9, 0, 0), (0, 2, 0), color=(0.5, 0.5, 0.5), object_id=0)
    _, _, free = at_floor(EVEN, floor=left)
    _, _, lux = at_floor(EVEN, mirror, floor=left)
    shares = lux.mean(axis=1) / free.mean(axis=1)
    assert 0.5 < shares.min() and shares.max() < 1.0
    assert (shares < 0.85).any(), "near the mirror half of the light comes by way of it"


@pytest.mark.parametrize(("height_m", "lit"), [(3.0, 1.0), (0.5, 0.0)])
def test_a_lamp_lights_the_floor_by_way_of_a_mirror_as_one_behind_it_would(height_m, lit):
    """In a black room; all that the far floor sees of the lamp's image lies above a low mirror."""
    steel = {"metallic": 1.0, "roughness": 0.0, "color": (0.8, 0.8, 0.8), "object_id": 2}
    mirror = [box((1.5, low, 0), (1.52, low + 3, height_m), **steel) for low in (-3, 0)]
    lamp = box((-0.05, -0.05, 1.95), (0.05, 0.05, 2.05), emission=(1e4,) * 3, color=(0.0,) * 3, object_id=3)
    walls = box((-4, -4, -1), (4, 4, 4), inside=True, object_id=1, color=(0.0,) * 3, roughness=1.0, ior=1.0)
    floor = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), color=(0.5, 0.5, 0.5), roughness=1.0, ior=1.0, object_id=0)
    mirrored = scene(floor, walls, lamp, *mirror)
    alone, cache = filled(scene(floor, walls, lamp), FINE), filled(mirrored, FINE)
    assert np.array_equal(alone.atlas.position[:30], cache.atlas.position[:30]), "the floor's nodes come first"
    nodes = nodes_of(cache, 0, mirrored)
    nodes = nodes[(np.abs(cache.atlas.position[nodes, :2]) < 0.7).all(axis=1)]
    by_mirror = cache.rows[nodes, 1] - alone.rows[nodes, 1]
    toward = np.array([3.0, 0.0, 2.0]) - cache.atlas.position[nodes]
    squared, cosines = (toward**2).sum(axis=1), np.abs(toward) / np.linalg.norm(toward, axis=1, keepdims=True)
    expected = 0.8 * 1e4 * 0.1**2 * cosines.sum(axis=1) * cosines[:, 2] / squared
    np.testing.assert_allclose(by_mirror / expected, lit, atol=0.1)
    assert np.mean(by_mirror / expected) == pytest.approx(lit, abs=0.02)


@pytest.mark.parametrize("outside", [0.0, 0.5])
def test_a_window_lights_the_floor_by_way_of_a_mirror_as_one_behind_it_would(outside):
    """Without walls; every node by as many rays, so that none is a spot of light.  A black wall outside hides a share of the sky."""
    steel = {"metallic": 1.0, "roughness": 0.0, "color": (0.8, 0.8, 0.8), "object_id": 2}
    mirror = [box((1.5, low, 0), (1.52, low + 3, 3.0), **steel) for low in (-3, 0)]
    pane = quad((-1.5, -0.4, 1.6), (0, 0.8, 0), (0, 0, 0.8), portal=True, transmission=0.9, ior=1.0, object_id=3)
    floor = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), color=(0.5, 0.5, 0.5), roughness=1.0, ior=1.0, object_id=0)
    sky = Sky(*np.full((3, 3), 800.0, np.float32))
    hedge = [quad((-1.51, -0.4, 1.6), (0, 0.8 * outside, 0), (0, 0, 0.8), color=(0.0,) * 3, ior=1.0)] if outside else []
    rooms = [scene(floor, pane, *hedge, *more, sky=sky) for more in ((), mirror)]
    alone, cache = (filled(room, FINE) for room in rooms)
    nodes = nodes_of(cache, 0, rooms[1])
    nodes = nodes[(np.abs(cache.atlas.position[nodes, :2]) < 0.7).all(axis=1)]
    y, z = np.meshgrid(np.linspace(-0.4 + 0.8 * outside, 0.4, 40), np.linspace(1.6, 2.4, 40))
    toward = np.column_stack([np.full(y.size, 4.5), y.ravel(), z.ravel()]) - cache.atlas.position[nodes, None].astype(float)
    expected = (1.0 - outside) * 0.8 * 0.9 * 800.0 * 0.8**2 * (toward[..., 0] * toward[..., 2] / (toward**2).sum(axis=-1) ** 2).mean(axis=1)
    by_mirror = cache.light.indirect[nodes, 1] - alone.light.indirect[nodes, 1]
    np.testing.assert_allclose(by_mirror / expected, 1.0, atol=0.35 if outside else 0.05)
    assert np.mean(by_mirror / expected) == pytest.approx(1.0, abs=0.03)


def test_rooms_below_the_horizon_bring_nothing():
    below = box((-0.5, -0.5, -0.6), (0.5, 0.5, -0.2), glow_cd_m2=1000.0, color=(1.0, 1.0, 1.0))
    _, _, lux = at_floor(below)
    assert (lux == 0).all()


@pytest.mark.parametrize("albedo", [0.3, 0.7])
def test_a_block_shades_the_floor_before_it(albedo):
    """The block is lit too: shade is between that of a black one, half the light, and none."""
    block = box((-1, 0.5, 0), (1, 0.6, 3), color=(albedo,) * 3, roughness=1.0)
    cache, nodes, lux = at_floor(EVEN, block)
    x, y, _ = cache.atlas.position[nodes].T
    near = lux[np.isclose(y, y[y < 0.5].max()) & (np.abs(x) < 0.5)]
    share = near.mean() / (np.pi * GLOW.mean())
    assert 0.5 < share < 0.54 + 0.5 * albedo


def test_glass_sends_back_the_light_that_does_not_go_through():
    """A lamp shines into half a white room, on a wall of milky glass; all of that half is as bright as paths find it, within 3 %."""
    room = box((-2, -1, 0), (2, 1, 2), inside=True, object_id=0, color=(0.85,) * 3, roughness=1.0)
    glass = box((0, -1, 0), (0.02, 1, 2), color=(0.7,) * 3, transmission=0.6, ior=1.5, roughness=0.05, object_id=2)
    lamp = quad((-0.3, -0.3, 1.0), (0, 0, 0.6), (0, 0.6, 0), emission=(1e3,) * 3, color=(0.0,) * 3, object_id=3)
    flat, view = scene(room, glass, lamp), pose((-0.4, 0.8, 1.5), (-1.9, -0.6, 0.6))
    known = look_up(flat, view, cache_spacing_m=0.06).radiance
    traced = look_up(flat, view, integrator="path", samples_per_pixel=512).radiance
    assert known.mean() == pytest.approx(traced.mean(), rel=0.03)


def sunlit_ledge():
    """Return a room, view and camera: the sun stands above the wall, so that none of it comes in; a white ledge and a board send it on."""
    white = {"color": (0.8, 0.8, 0.8), "roughness": 1.0}
    pieces = (
        pierced(box((0, 0, 0), (4, 5, 2.6), inside=True, object_id=0, **GREY), (1.2, 0.9), (2.8, 2.1)),
        quad((1.2, 5, 0.9), (1.6, 0, 0), (0, 0, 1.2), portal=True, transmission=0.9),
        box((0.8, 5.05, 0.6), (3.2, 6.5, 0.85), **white),
        quad((0.8, 6.5, 0.85), (0, 0, 1.0), (2.4, 0, 0), **white),
    )
    sun = np.array([0, -0.02, 0.9998, 1e-5, *(3 * [1e5 / (2 * np.pi * 1e-5)])], np.float32)
    return scene(*pieces, sky=DARK._replace(sun=sun)), pose((0.5, 0.5, 1.5), (2.5, 4.0, 1.0)), CameraConfig(width=64, height=48)


def test_what_the_sun_lights_outside_a_window_lights_the_room():
    """All but the view out, which is two thirds of the picture's light."""
    flat, view, camera = sunlit_ledge()
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=512, threads=2).radiance[..., 1]
    cached, inside = look_up(flat, view, camera=camera).radiance[..., 1], traced < 2000.0
    assert inside.mean() > 0.9 and cached[inside].sum() == pytest.approx(traced[inside].sum(), rel=0.04)


@pytest.mark.xfail(strict=True, reason="what stands outside is lit by nodes 10 cm apart: the board's corner is too dark, the picture 4.5 %")
def test_what_the_sun_lights_outside_a_window_is_seen_as_bright_as_by_paths():
    flat, view, camera = sunlit_ledge()
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=128, threads=2).radiance.mean()
    assert look_up(flat, view, camera=camera).radiance.mean() == pytest.approx(traced, rel=0.04)


def test_what_is_small_and_bright_lights_each_coarse_node_and_not_those_whose_rays_meet_it():
    """A panel of 0.4 x 0.4 m that glows 3 m above a floor: luminance is albedo / pi times L A cos^4 / h^2, to a tenth."""
    floor = quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), color=(0.5, 0.5, 0.5), roughness=1.0)
    panel = quad((-0.2, 0.2, 3), (0.4, 0, 0), (0, -0.4, 0), glow_cd_m2=1000.0, color=(1, 1, 1), roughness=1.0)
    flat = scene(floor, panel)
    with solved(flat) as cache:
        nodes = np.flatnonzero((flat.face_part[cache.coarse.face] == 0) & (cache.coarse.normal[:, 2] > 0.5))
        x, y, _ = cache.coarse.position[nodes].astype(float).T
    expected = 0.5 / np.pi * 1000.0 * 0.16 / 9.0 / (1.0 + (x * x + y * y) / 9.0) ** 2
    np.testing.assert_allclose(cache.luminance[nodes, 1], expected, rtol=0.1)


@pytest.mark.parametrize("transmission", [0.6, 0.85])
def test_milky_glass_shows_what_both_of_its_faces_send_back(transmission):
    """A glass wall between the halves of a room, each with a lamp of its own: seen from one, as bright as by paths, within 4 %."""
    room = box((-2, -1, 0), (2, 1, 2), inside=True, object_id=0, color=(0.5,) * 3, roughness=1.0)
    glass = box((0, -1, 0), (0.02, 1, 2), color=(0.7,) * 3, transmission=transmission, ior=1.5, roughness=0.05, object_id=2)
    lamps = [quad((x, -0.3, 1.99), (0, 0.6, 0), (0.6, 0, 0), emission=(1e3,) * 3, color=(0.0,) * 3, object_id=3) for x in (-1.3, 0.7)]
    flat, view = scene(room, glass, *lamps), pose((-1.5, 0.1, 1.2), (0.0, -0.2, 0.8))
    known = look_up(flat, view, cache_spacing_m=0.06).radiance
    traced = look_up(flat, view, integrator="path", samples_per_pixel=1024).radiance
    assert known.mean() == pytest.approx(traced.mean(), rel=0.04)
