"""Radiosity: light that passes along links, and rooms in which every surface has one known luminance."""

import numpy as np
import pytest
from box_room import box, hollow_sphere, scene
from cached_rooms import filled

from renderer.irradiance_cache.hemisphere import BEHIND, DARK
from renderer.irradiance_cache.radiosity import Sheets, solve_links

GREY = np.full((8, 3), [0.2, 0.5, 0.8], np.float32)
ONES, NOTHING = np.ones((8, 3), np.float32), np.zeros((8, 3), np.float32)


NO_SHEETS = Sheets(np.full(8, -1, np.int32), NOTHING, NOTHING, NOTHING)


def solve(links, given=NOTHING, seen=NOTHING, albedo=GREY, glow=NOTHING, sheets=NO_SHEETS, sweeps=100):
    luminance = np.zeros((len(links), 3), np.float32)
    solve_links(np.asarray(links, np.int32), given, seen, albedo, glow, sheets, sweeps, luminance)
    return luminance


def test_a_closed_grey_furnace_sums_the_series():
    """Glow of 1, illuminance of pi, and 16 rays that sight a luminance of 1 each are the same light."""
    links = np.random.default_rng(2).integers(0, 8, (8, 16))
    np.testing.assert_allclose(solve(links, glow=ONES), ONES / (1 - GREY), rtol=1e-5)
    np.testing.assert_allclose(solve(links, given=np.pi * ONES), GREY / (1 - GREY), rtol=1e-5)
    np.testing.assert_allclose(solve(links, seen=16 * ONES), GREY / (1 - GREY), rtol=1e-5)


def test_rays_into_the_dark_bring_nothing_and_those_within_things_do_not_count():
    half = np.full((8, 16), DARK)
    half[:, ::2] = 3
    np.testing.assert_allclose(solve(half, glow=ONES), ONES / (1 - 0.5 * GREY), rtol=1e-5)
    half[half == DARK] = BEHIND
    np.testing.assert_allclose(solve(half, glow=ONES), ONES / (1 - GREY), rtol=1e-5)
    np.testing.assert_allclose(solve(np.full((8, 16), BEHIND), glow=ONES), ONES)


def test_two_walls_light_each_other():
    links = np.repeat([[4], [4], [4], [4], [0], [0], [0], [0]], 16, axis=1)
    glow = np.where(np.arange(8)[:, None] < 4, ONES, NOTHING).astype(np.float32)
    luminance = solve(links, glow=glow)
    np.testing.assert_allclose(luminance[:4], 1 / (1 - GREY[:4] ** 2), rtol=1e-5)
    np.testing.assert_allclose(luminance[4:], GREY[4:] / (1 - GREY[4:] ** 2), rtol=1e-5)


def test_a_sheet_passes_light_on():
    """Nodes 0 to 3 see themselves and are lit by pi, 4 to 7 are their backs and see themselves.

    Arriving over pi: a = 1 + r a + t b in front, b = r b + t a behind.
    """
    links = np.repeat(np.arange(8)[:, None], 16, axis=1)
    given = np.where(np.arange(8)[:, None] < 4, np.pi * ONES, NOTHING).astype(np.float32)
    passed = np.full((8, 3), [0.1, 0.2, 0.15], np.float32)
    sheets = Sheets(np.array([4, 5, 6, 7, 0, 1, 2, 3], np.int32), passed, NOTHING, np.zeros((8, 3), np.float32))
    leaving = solve(links, given=given, sheets=sheets, sweeps=1000) + sheets.light
    kept, through = 1 - GREY[0], passed[0]
    scale = 1 / (kept**2 - through**2)
    np.testing.assert_allclose(leaving[:4], np.tile(kept * scale - 1, (4, 1)), rtol=1e-4)
    np.testing.assert_allclose(leaving[4:], np.tile(through * scale, (4, 1)), rtol=1e-4)


def test_walls_that_glow_evenly_have_one_luminance():
    """What glows reflects 0.03 of its colour: (colour, as luminance 1 is tinted by it) / (1 - 0.03 colour)."""
    room = scene(box((0, 0, 0), (2, 3, 1.5), inside=True, glow_cd_m2=1.0, color=(1.0, 0.5, 0.2), object_id=0))
    cache, color = filled(room), np.array([1.0, 0.5, 0.2])
    np.testing.assert_allclose(cache.geometry.looks.albedo, np.tile(0.03 * color, (len(cache.geometry.looks.albedo), 1)), rtol=1e-4)
    np.testing.assert_allclose(cache.luminance, np.tile(color / (1 - 0.03 * color), (len(cache.luminance), 1)), rtol=1e-4)
    np.testing.assert_allclose(cache.light.indirect, np.pi * np.tile(color / (1 - 0.03 * color), (len(cache.atlas.face), 1)), rtol=1e-4)


def lamp_on_wall(flat, atlas):
    """Illuminance of the nodes on part 0 by a small cube of 1e4 cd/m2 in the origin."""
    on_wall = flat.face_part[atlas.face] == 0
    position, normal = atlas.position[on_wall].astype(float), atlas.normal[on_wall].astype(float)
    distance = np.linalg.norm(position, axis=1)
    intensity = 1e4 * 0.06**2 * np.abs(position).sum(axis=1) / distance
    return intensity * -(position * normal).sum(axis=1) / distance**3


@pytest.mark.parametrize("albedo", [0.2, 0.5, 0.8, 0.9])
def test_an_integrating_sphere_spreads_light_evenly(albedo):
    """Each point gets the lamp's illuminance / (1 - albedo), evenly; the lamp absorbs its share of the rays."""
    flat = scene(
        hollow_sphere(8, color=(albedo,) * 3, object_id=0, roughness=1.0),
        box((-0.03, -0.03, -0.03), (0.03, 0.03, 0.03), emission=(1e4,) * 3, color=(0, 0, 0)),
    )
    cache = filled(flat)
    direct = lamp_on_wall(flat, cache.atlas)
    on_wall = flat.face_part[cache.atlas.face] == 0
    np.testing.assert_allclose(cache.light.direct[on_wall, 1], direct, rtol=0.08)
    assert cache.light.direct[on_wall, 1].mean() == pytest.approx(direct.mean(), rel=0.01)
    on_wall = flat.face_part[cache.coarse.face] == 0
    weight = cache.coarse.area[on_wall].astype(float)
    mean = np.average(lamp_on_wall(flat, cache.coarse), weights=weight)
    absorbed = 6 * 0.06**2 / weight.sum()
    shown = cache.luminance[on_wall, 1]
    assert np.average(shown, weights=weight) == pytest.approx(albedo / np.pi * mean / (1 - albedo * (1 - absorbed)), rel=0.01)
