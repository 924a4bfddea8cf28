"""What stands around a room: at its distance, out of the sun's way, the same for the same seed."""

import math

import numpy as np
import pytest

from renderer.surroundings.neighbourhood import FACADE, PLANES, SETTINGS, make_neighbourhood


def drawn(setting: str, seed: int, to_sun: tuple[float, float, float] | None = None):
    return make_neighbourhood(np.random.default_rng(seed), SETTINGS[setting], to_sun)


def is_met(planes: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> bool:
    """Return whether a ray meets a convex body (PLANES, 4), by clipping it."""
    near, far = 0.0, math.inf
    for *normal, offset in planes:
        toward, room = float(np.dot(normal, direction)), offset - float(np.dot(normal, origin))
        if abs(toward) < 1e-12:
            far = far if room >= 0.0 else -1.0
        elif toward < 0.0:
            near = max(near, room / toward)
        else:
            far = min(far, room / toward)
    return near < far


@pytest.mark.parametrize("setting", SETTINGS)
def test_houses_keep_twelve_metres_and_trees_their_distance(setting: str) -> None:
    for seed in range(20):
        place = drawn(setting, seed)
        facades = place.planes[place.kind == FACADE]
        assert len(facades) >= 2
        east, north, west, south = facades[:, 0, 3], facades[:, 1, 3], -facades[:, 2, 3], -facades[:, 3, 3]
        away = np.hypot(np.maximum(np.maximum(west, -east), 0.0), np.maximum(np.maximum(south, -north), 0.0))
        assert away.min() >= 12.0
        assert (np.hypot(place.crowns[:, 0], place.crowns[:, 1]) - place.crowns[:, 3]).min() > 4.0


@pytest.mark.parametrize("setting", SETTINGS)
def test_nothing_stands_before_the_sun(setting: str) -> None:
    blocked = 0
    for seed in range(12):
        azimuth, elevation = 0.5 * seed, 0.05 + 0.03 * seed
        to_sun = (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation))
        place, all_of_it = drawn(setting, seed, to_sun), drawn(setting, seed)
        eye = np.array([0.0, 0.0, 2.0])
        assert place.planes.shape[1:] == (PLANES, 4)
        assert not any(is_met(body, eye, np.array(to_sun)) for body in place.planes)
        blocked += any(is_met(body, eye, np.array(to_sun)) for body in all_of_it.planes)
    assert setting == "country" or blocked > 0


def test_the_same_seed_gives_the_same_place_and_others_another() -> None:
    one, again, other = drawn("suburb", 3), drawn("suburb", 3), drawn("suburb", 4)
    assert all(np.array_equal(a, b) for a, b in zip(one, again, strict=True))
    assert one.looks.shape != other.looks.shape or not np.array_equal(one.looks, other.looks)
