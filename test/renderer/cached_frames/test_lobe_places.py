"""Places on rectangles that lobes of GGX mirror."""

import numpy as np
import pytest

from renderer.cached_frames.lobe_places import (
    choose_places,
    lobe_width_m,
    mirrored_reach,
    nearest_place,
    place_density,
    place_near,
    places_density,
)
from renderer.core.kernel import from_python

REACH, PLACE = from_python(mirrored_reach), from_python(nearest_place)


def test_the_mirrored_ray_meets_a_rectangle_or_passes_beyond_its_rim():
    wo, sides = tuple(np.float32([0.6, 0.0, 0.8])), (tuple(np.float32([0, 1, 0])), tuple(np.float32([0, 0, 1])))
    assert REACH(tuple(np.float32([-0.3, 0.2, 1])), wo, *sides) == pytest.approx(0.3 / 0.6)
    assert REACH(tuple(np.float32([0.3, 0.2, 1])), wo, *sides) == pytest.approx(2.0 / 0.8), "it is behind: beyond its upper rim"
    assert REACH(tuple(np.float32([-0.3, 1.5, 1])), wo, *sides) == pytest.approx(0.3 / 0.6), "the ray passes it"
    assert REACH(tuple(np.float32([0.3, 0.2, -3])), wo, *sides) == 0.0, "it goes away from all of it"


@pytest.mark.parametrize(("far_m", "aside", "off_deg"), [((0.02, 0.15), 1, 5), ((0.5, 4.0), 6, 6)], ids=["close by", "across a room"])
def test_the_place_on_a_rectangle_is_where_it_is_seen_nearest_to_the_mirrored_ray(far_m, aside, off_deg):
    """Nine of ten times, of all in front of it within 60 degrees, it is no more than that much farther off than the nearest is."""
    rng, off = np.random.default_rng(3), []
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21)), axis=-1)
    for _ in range(2000):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T * np.append(rng.uniform(0.2, 1, 2), rng.uniform(*far_m))[:, None]
        middle, wo = axes[2] + rng.uniform(-aside, aside, 2) @ axes[:2], rng.normal(size=3)
        wo /= np.linalg.norm(wo)
        hit = [tuple(np.float32(v)) for v in (middle, wo, axes[0], axes[1])]
        reach = REACH(*hit)
        places = np.append(grid.reshape(-1, 2), [[PLACE(*hit[:2], reach, side) for side in hit[2:]]], axis=0)
        seen = middle + places @ axes[:2]
        angles = np.degrees(np.arccos(np.clip(seen @ (wo * [-1, -1, 1]) / np.linalg.norm(seen, axis=1), -1, 1)))
        if angles.min() < 60:
            off.append(angles[-1] - angles[:-1].min())
    assert len(off) > 500 and np.quantile(off, 0.9) < off_deg


@pytest.mark.parametrize("nearest", [0.0, 1.0, -0.3])
def test_places_are_distributed_as_slopes_of_ggx_are_along_one_axis(nearest):
    width_m, u = 0.2, np.linspace(0, 1, 2001, dtype=np.float32)
    about = np.float32(nearest), tuple(np.float32([0, 2, 0])), np.float32(width_m)
    choose, density_of = from_python(place_near), from_python(place_density)
    places = np.array([choose(*about, x) for x in u])
    density = np.array([density_of(*about, place) for place in places])
    assert places[0] == pytest.approx(-1.0, abs=1e-3) and places[-1] == pytest.approx(1.0, abs=1e-3)
    rng = np.random.default_rng(5)
    slope, turn = 1.2 * width_m / 2 * np.sqrt(1 / (1 - rng.random(400_000)) - 1), rng.random(400_000) * 2 * np.pi
    x = slope * np.cos(turn)
    within = np.sort(x[(x > -1.0 - nearest) & (x < 1.0 - nearest)] + nearest)
    np.testing.assert_allclose(places[200:-200], within[(u[200:-200] * (len(within) - 1)).astype(int)], atol=0.01)
    np.testing.assert_allclose(np.gradient(places, u)[200:-200] * density[200:-200], 1.0, rtol=0.02)


@pytest.mark.parametrize(
    ("place", "axis"), [((0.0, 0.0, 3.0), (2.0, 0.0, 0.0)), ((0.0, 1.5, 2.0), (0.0, 4.0, 0.0)), ((1.0, 0.5, 1.0), (0.6, 0.0, 0.8))]
)
def test_a_lobe_spreads_over_an_axis_by_how_aslant_it_is_seen(place, axis):
    """By differences: what a small step along the axis turns the direction by."""
    place, axis, step_m = np.array(place), np.array(axis), 1e-4
    moved = place + step_m * axis / np.linalg.norm(axis)
    turned_rad = np.arcsin(np.linalg.norm(np.cross(place, moved)) / np.linalg.norm(place) / np.linalg.norm(moved))
    width_m = from_python(lobe_width_m)(tuple(np.float32(place)), tuple(np.float32(axis)), np.float32(0.01))
    assert width_m == pytest.approx(0.01 * step_m / turned_rad, rel=1e-3)


def test_places_have_the_density_that_they_are_said_to_have():
    """Points chosen on a rectangle aslant, counted by cells; and the density is one in all."""
    rect = tuple(np.float32([0.2, 0.1, 2.0])), np.float32(0.4), np.float32(-0.2)
    sides = tuple(np.float32([1.0, 0.0, 0.3])), tuple(np.float32([-0.2, 0.8, 0.1])), np.float32(0.15)
    rng = np.random.default_rng(7)
    choose, density_of = from_python(choose_places), from_python(places_density)
    places = np.array([choose(*rect, *sides, *np.float32(rng.random(2))) for _ in range(20_000)])
    counted, edges, _ = np.histogram2d(*places.T, bins=8, range=[[-1, 1], [-1, 1]])
    fine = (np.arange(64) + 0.5) / 32 - 1
    density = np.array([[density_of(*rect, *sides, np.float32(s), np.float32(t)) for t in fine] for s in fine])
    expected = density.reshape(8, 8, 8, 8).mean(axis=(1, 3)) * (edges[1] - edges[0]) ** 2
    assert expected.sum() == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(counted / len(places), expected, atol=0.006)
