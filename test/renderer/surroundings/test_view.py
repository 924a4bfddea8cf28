"""The view of a neighbourhood: light by known answers, turns, day and night."""

import math

import numpy as np
import pytest

from renderer.core.equirectangular import map_directions
from renderer.core.kernel import from_python
from renderer.scene.daylight_sky import VERSINE, daylight_map, gradient_map
from renderer.surroundings.neighbourhood import LOOK, PLANES, POST, Neighbourhood
from renderer.surroundings.panorama import COLUMNS, ROWS, irradiance
from renderer.surroundings.view import light_of, panorama_of, sky_harmonics, surroundings_map
from scene_description import Daylight, Surroundings

TO_SUN = (0.0, -math.cos(0.6), math.sin(0.6))
DAY = Daylight(sun_direction=TO_SUN, cloud_cover=0.2)
NIGHT = tuple(np.array([value] * 3, np.float32) for value in (0.05, 0.1, 0.1))


def a_post(x: float, y: float, size: float, height: float) -> Neighbourhood:
    """Return a place with a square pillar and nothing else."""
    planes = [
        (1, 0, 0, x + size),
        (0, 1, 0, y + size),
        (-1, 0, 0, -x),
        (0, -1, 0, -y),
        (0, 0, 1, height),
        (0, 0, -1, 0),
        (0, 0, 0, 1),
        (0, 0, 0, 1),
    ]
    look = np.array([[size, size, height, 1.0, 0.5, 0.5, 0.5, 3.0]], np.float32)
    assert len(planes) == PLANES and look.shape[1] == LOOK
    return Neighbourhood(
        np.array([planes], np.float32),
        np.array([POST], np.int32),
        np.array([[x, y, height]], np.float32),
        look,
        np.array([[x + 0.5 * size, y + 0.5 * size, 0.5 * height, size + height]], np.float32),
        np.zeros((0, 8), np.float32),
        np.zeros((0, 4), np.float32),
        np.zeros((0, 3), np.float32),
        np.array([500.0, 1.0, 2.0], np.float32),
    )


def seen(image: np.ndarray, x: float, y: float, z: float) -> np.ndarray:
    """Return the pixel of a map in a direction."""
    nearest = (map_directions(ROWS, COLUMNS) * np.array([x, y, z]) / math.hypot(x, y, z)).sum(axis=-1).argmax()
    return image.reshape(-1, 3)[nearest]


def test_an_even_environment_brings_pi_times_its_luminance_to_any_plane() -> None:
    harmonics = sky_harmonics(np.full((96, 384, 3), 7.0, np.float32)).astype(np.float32)
    call = from_python(irradiance)
    for normal in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, 0.0, -0.8)):
        assert call(harmonics, *(np.float32(item) for item in normal)) == pytest.approx((7.0 * math.pi,) * 3, rel=2e-3)


def test_a_wall_in_the_sun_has_the_luminance_of_a_matt_surface_and_casts_its_shadow() -> None:
    sky = np.zeros((96, 384, 3), np.float32)
    beam = np.array([1000.0, 1000.0, 1000.0])
    image = panorama_of(a_post(-3.0, 10.0, 6.0, 8.0), light_of(sky, np.array(TO_SUN), beam, 0.0), 1.8)
    # the wall faces the sun's azimuth; tones vary between 0.8 and 1.1 of the base colour
    expected = 0.5 / math.pi * 1000.0 * math.cos(0.6)
    wall = seen(image, 0.0, 10.0, 2.0)
    assert 0.78 * expected < wall[1] < 1.1 * expected
    behind = panorama_of(a_post(-3.0, -16.0, 6.0, 8.0), light_of(sky, np.array(TO_SUN), beam, 0.0), 1.8)
    # its shadow reaches 8 m / tan(0.6) = 11.7 m beyond it, over the ground before the eye
    assert seen(behind, 0.0, -6.0, -1.8)[1] == 0.0
    assert seen(behind, 6.0, 0.0, -1.8)[1] > 1.0


def test_the_house_shades_the_ground_before_windows_that_look_away_from_the_sun_and_has_a_terrace() -> None:
    light = light_of(np.zeros((96, 384, 3), np.float32), np.array(TO_SUN), np.array([1000.0, 1000.0, 1000.0]), 0.0)
    image = panorama_of(a_post(30.0, 0.0, 1.0, 1.0), light, 1.8)
    # a roof 3.5 m above the eye shades (1.8 + 3.5) m / tan(0.6) = 7.7 m
    assert seen(image, 0.0, 6.5, -1.8)[1] == 0.0
    lawn, slabs = seen(image, 0.0, -6.5, -1.8), seen(image, 0.0, -2.5, -1.8)
    assert seen(image, 0.0, 9.5, -1.8)[1] > 10.0 and lawn[1] > 10.0
    assert lawn[0] < 0.9 * lawn[1] and slabs[0] >= slabs[1]


def test_a_quarter_turn_turns_the_place_under_the_same_sky() -> None:
    table, sun = daylight_map(DAY)
    plain = surroundings_map(Surroundings(setting="suburb", seed=4), table, np.zeros(0, np.float32), 0.2)
    turned = surroundings_map(
        Surroundings(setting="suburb", seed=4, quarter_turns=1), np.roll(table, -table.shape[1] // 4, axis=1), np.zeros(0, np.float32), 0.2
    )
    assert np.array_equal(np.roll(turned, COLUMNS // 4, axis=1), plain)
    with_sun = surroundings_map(Surroundings(setting="suburb", seed=4), table, sun, 0.2)
    assert sun[3] == np.float32(VERSINE) and with_sun.sum() > plain.sum()


def test_windows_are_lit_in_the_dark_only() -> None:
    town = Surroundings(setting="town", seed=8, floor_above_ground_m=6.5)
    night = surroundings_map(town, gradient_map(*NIGHT), np.zeros(0, np.float32), 0.0)
    assert 8.0 < night.max() < 2000.0
    lit = (night[..., 0] > 8.0) & (night[..., 0] > 1.5 * night[..., 2])
    assert 20 < lit.sum() < 0.02 * lit.size
    table, sun = daylight_map(DAY)
    day = surroundings_map(town, table, sun, 0.2)
    assert day.min() >= 0.0 and np.isfinite(day).all()
    assert day[: ROWS // 2].mean() > 100.0 * night[: ROWS // 2].mean()
