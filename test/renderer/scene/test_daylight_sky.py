"""Sun and sky against published figures and their own definitions."""

import math

import numpy as np
import pytest
from sample_scene import sample_scene

from renderer.core.color import LUMINANCE
from renderer.core.equirectangular import map_directions, pixel_solid_angles
from renderer.core.kernel import from_python
from renderer.path import infinite_light
from renderer.scene.daylight_sky import (
    ANGULAR_RADIUS_RAD,
    COLUMNS,
    ROWS,
    SOLID_ANGLE_SR,
    air_mass,
    clear_sky_rgb,
    daylight_map,
    matching_functions,
    overcast_sky_rgb,
    sun_illuminance_lx,
    zenith_yxy,
)
from renderer.scene.sky import build_sky
from scene_description import Daylight

sky_le = from_python(infinite_light.sky_le)


def daylight(elevation_deg: float, **changes: float) -> Daylight:
    angle = math.radians(elevation_deg)
    return Daylight(sun_direction=(math.cos(angle), 0.0, math.sin(angle)), **changes)


def horizontal_lx(table):
    upper = table[: ROWS // 2].astype(np.float64)
    onto = pixel_solid_angles(ROWS, COLUMNS)[: ROWS // 2, None] * map_directions(ROWS, COLUMNS)[: ROWS // 2, :, 2]
    return float((upper * onto[..., None]).sum(axis=(0, 1)) @ LUMINANCE)


@pytest.mark.parametrize(("elevation", "mass"), [(90, 0.9997), (30, 1.9943), (10, 5.5841), (5, 10.3058), (0, 37.92)])
def test_air_mass_is_kasten_and_youngs(elevation, mass):
    assert air_mass(math.radians(elevation)) == pytest.approx(mass, rel=2e-3)


def test_matching_functions_peak_where_the_eye_does():
    x, y, z = matching_functions(np.arange(380.0, 781.0, 5.0))
    assert y.max() == pytest.approx(1.0, abs=0.02) and 550 <= 380 + 5 * y.argmax() <= 560
    assert x.sum() == pytest.approx(y.sum(), rel=0.02) and z.sum() == pytest.approx(y.sum(), rel=0.02)  # equal energy is white


def test_the_sun_is_warm_when_low_and_gone_when_set():
    """A high sun brings 80 to 100 klx (IES 1984: 127.5 klx exp(-0.21 m) on a clear day)."""
    for elevation in (30.0, 60.0):
        lux = sun_illuminance_lx(math.radians(elevation), 2.5)
        assert float(lux @ LUMINANCE) == pytest.approx(127_500 * math.exp(-0.21 * air_mass(math.radians(elevation))), rel=0.15)
    warmth = [rgb[0] / rgb[2] for rgb in (sun_illuminance_lx(math.radians(e), 3.0) for e in (60.0, 20.0, 8.0))]
    assert warmth[0] < 2.0 < warmth[1] < warmth[2]
    assert not sun_illuminance_lx(math.radians(-1.0), 3.0).any()
    near, far = (sun_illuminance_lx(1.0, 3.0, au) for au in (0.983, 1.017))
    assert near[1] / far[1] == pytest.approx((1.017 / 0.983) ** 2)


def test_the_zenith_is_preethams():
    """Spot values of the published formulas, worked by hand: T = 3, sun at 45 degrees elevation."""
    chi = (4 / 9 - 3 / 120) * (math.pi - 2 * math.pi / 4)
    luminance, x, y = zenith_yxy(math.radians(45.0), 3.0)
    assert luminance == pytest.approx(1000 * ((4.0453 * 3 - 4.9710) * math.tan(chi) - 0.2155 * 3 + 2.4192))
    assert 0.235 < x < 0.255 and 0.24 < y < 0.26  # a deep blue


def test_a_clear_sky_is_brightest_about_the_sun_and_blue_away_from_it():
    way = np.array([math.cos(0.6), 0.0, math.sin(0.6)])
    directions = map_directions(64, 128)[:32].reshape(-1, 3)
    sky = clear_sky_rgb(directions, way, 3.0)
    brightest = directions[(sky @ LUMINANCE * (directions[:, 2] > 0.3)).argmax()]
    assert brightest @ way > 0.99
    opposite = clear_sky_rgb(np.array([[-math.cos(0.9), 0.0, math.sin(0.9)]]), way, 3.0)[0]
    assert opposite[2] > 1.5 * opposite[0]


@pytest.mark.parametrize("elevation", [10.0, 40.0, 70.0])
def test_illuminances_are_those_of_the_ies(elevation):
    clear, overcast = (daylight_map(daylight(elevation, turbidity=2.5, cloud_cover=cover))[0] for cover in (0.0, 1.0))
    sine = math.sin(math.radians(elevation))
    assert horizontal_lx(clear) == pytest.approx(800 + 15_500 * math.sqrt(sine), rel=1e-3)
    assert horizontal_lx(overcast) == pytest.approx(300 + 21_000 * sine, rel=0.01)
    zenith, horizon = overcast_sky_rgb(np.array([[0.0, 0, 1], [1, 0, 0]]), 0.5) @ LUMINANCE
    assert zenith == pytest.approx(3.0 * horizon)


def test_cover_hides_the_sun_and_ground_is_lit_by_both():
    table, sun = daylight_map(daylight(40.0, cloud_cover=0.5))
    _, whole = daylight_map(daylight(40.0))
    assert sun[4:] == pytest.approx(0.5 * whole[4:])
    assert len(daylight_map(daylight(40.0, cloud_cover=1.0))[1]) == 0
    beam = float(sun[4:] @ LUMINANCE) * SOLID_ANGLE_SR * math.sin(math.radians(40.0))
    ground = Daylight(sun_direction=(1.0, 0.0, 0.0)).ground_color
    expected = (horizontal_lx(table) + beam) / math.pi * float(np.array(ground) @ LUMINANCE)
    assert float(table[-1, 5] @ LUMINANCE) == pytest.approx(expected, rel=0.05)
    assert math.degrees(2 * ANGULAR_RADIUS_RAD) == pytest.approx(0.533)


def test_sun_and_sky_are_scaled_apart():
    plain, sun = daylight_map(daylight(40.0))
    half = ROWS // 2
    dim, same_sun = daylight_map(daylight(40.0, sky_scale=0.25))
    np.testing.assert_allclose(dim[:half], 0.25 * plain[:half], rtol=1e-6)
    np.testing.assert_array_equal(same_sun, sun)
    no_sun, none = daylight_map(daylight(40.0, sun_scale=0.0))
    np.testing.assert_array_equal(no_sun[:half], plain[:half])
    assert len(none) == 0 and (no_sun[half:] < plain[half:]).all()  # the ground is lit by the sky alone
    np.testing.assert_array_equal(daylight_map(daylight(40.0, sun_scale=1.0, sky_scale=1.0))[0], plain)


def test_maps_are_read_back_where_their_pixels_lie():
    rng = np.random.default_rng(2)
    table = rng.uniform(0, 1000, (12, 24, 3)).astype(np.float32)
    sky = build_sky(sample_scene().environment)._replace(table=table)
    ways = map_directions(12, 24)
    for i, j in ((0, 0), (3, 7), (11, 23), (6, 12)):
        assert sky_le(sky, *ways[i, j].astype(np.float32)) == pytest.approx(table[i, j], rel=1e-3)
    yaw = 0.5 * (math.atan2(*ways[5, 23, 1::-1]) + math.atan2(*ways[5, 0, 1::-1]) - 2 * math.pi)  # the seam is no seam
    x, y = math.cos(yaw), math.sin(yaw)
    level = math.hypot(*ways[5, 0, :2])
    seam = sky_le(sky, np.float32(level * x), np.float32(level * y), np.float32(ways[5, 0, 2]))
    assert seam == pytest.approx(0.5 * (table[5, 0] + table[5, 23]), rel=1e-3)


def test_scenes_without_daylight_keep_their_gradient():
    sky = build_sky(sample_scene().environment)
    assert not sky.table.size and not sky.sun.size
    assert sky_le(sky, np.float32(0.6), np.float32(0), np.float32(0.8)) == pytest.approx(sky.horizon + 0.8 * (sky.zenith - sky.horizon))
