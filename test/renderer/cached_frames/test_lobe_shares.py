"""What lobes of GGX mirror of discs and polygons, asked of microfacets drawn at random."""

import numpy as np
import pytest

from renderer.cached_frames.lobe_shares import lobe_frame, quadrilateral_share, slopes_in_disc
from renderer.core.kernel import from_python


def slopes_of_ggx(alpha, count=1_000_000):
    rng = np.random.default_rng(5)
    slope, turn = alpha * np.sqrt(1 / (1 - rng.random(count)) - 1), rng.random(count) * 2 * np.pi
    return slope * np.cos(turn), slope * np.sin(turn)


def test_the_lobe_of_gloss_that_a_ball_takes_is_that_of_its_slopes():
    """Asked of a million microfacets: slopes drawn from GGX, and the share of them that mirror the ball."""
    alpha, spread = 0.1, 0.04
    radius, (x, y) = np.sqrt(spread) / 2, slopes_of_ggx(alpha)
    for tilt in (0.0, 0.08, 0.2):
        inside = (x - tilt) ** 2 + y**2 < (radius**2 * (1 + tilt**2) ** 1.5)
        facet = 1 / np.sqrt(1 + tilt**2)
        assert from_python(slopes_in_disc)(*np.array([facet, 1, alpha, spread], np.float32)) == pytest.approx(inside.mean(), rel=0.02)


def reflected(wo, alpha, count=400_000):
    """Return directions into which GGX reflects light from wo, by slopes drawn from its density, and how much goes there each."""
    rng = np.random.default_rng(3)
    slope, turn = alpha * np.sqrt(1 / (1 - rng.random(count)) - 1), rng.random(count) * 2 * np.pi
    wm = np.stack([slope * np.cos(turn), slope * np.sin(turn), np.ones(count)], axis=1)
    wm /= np.linalg.norm(wm, axis=1, keepdims=True)
    half = wm @ wo
    wi = 2 * half[:, None] * wm - wo
    seen, height = (half > 0) & (wi[:, 2] > 0), np.maximum(wi[:, 2], 1e-9)
    roots = [np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2) for cosine in (wo[2], height)]
    return wi, np.where(seen, 2 * half * height / (wm[:, 2] * (height * roots[0] + wo[2] * roots[1])), 0.0)


@pytest.mark.parametrize(("alpha", "off"), [(0.03, 0.02), (0.1, 0.03), (0.25, 0.035), (0.36, 0.05)])
@pytest.mark.parametrize("tilt_rad", [0.0, 0.5, 1.0, 1.25])
def test_the_share_of_a_lobe_that_a_polygon_covers_is_that_of_ggx(alpha, off, tilt_rad):
    """Asked of what is reflected onto thirds of a window that stands where the mirrored ray goes."""
    wo = np.array([np.sin(tilt_rad) * 0.6, np.sin(tilt_rad) * 0.8, np.cos(tilt_rad)])
    mirrored = np.array([-wo[0], -wo[1], wo[2]])
    across = np.cross(mirrored, [0.3, -0.2, 1.0])
    across /= np.linalg.norm(across)
    up = np.cross(mirrored, across)
    rows = np.array(from_python(lobe_frame)(tuple(np.float32(wo)), np.float32(alpha)))
    wi, weight = reflected(wo, alpha)
    x, y = (wi @ axis / np.maximum(wi @ mirrored, 1e-9) for axis in (across, up))
    for left in (-0.6, -0.2, 0.2):
        within = (wi @ mirrored > 0) & (x > left) & (x < left + 0.4) & (abs(y) < 0.3)
        corners = [mirrored + a * across + b * up for a, b in ((left, -0.3), (left + 0.4, -0.3), (left + 0.4, 0.3), (left, 0.3))]
        local = [tuple(np.float32(rows @ corner)) for corner in corners]
        share = from_python(quadrilateral_share)(*local)
        assert share == pytest.approx((weight * within).sum() / weight.sum(), abs=off)


def test_a_square_before_all_that_a_lobe_sees_has_all_of_it():
    corners = [tuple(np.float32([x, y, 1e-3])) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    assert from_python(quadrilateral_share)(*corners) == pytest.approx(1.0, abs=0.01)


def test_what_of_a_quadrilateral_lies_behind_a_lobe_takes_nothing_from_its_share():
    """A pane a few centimetres from a slat goes on far behind what the slat mirrors; asked of directions drawn by their cosine."""
    rng, clipped = np.random.default_rng(2), from_python(quadrilateral_share)
    u, turn = rng.random(400_000), rng.random(400_000) * 2 * np.pi
    ways = np.stack([np.sqrt(u) * np.cos(turn), np.sqrt(u) * np.sin(turn), np.sqrt(1 - u)], axis=1)
    for _ in range(40):
        middle, along = rng.normal(size=3), rng.normal(size=3)
        aside = np.cross(along, rng.normal(size=3))
        normal = np.cross(along, aside)
        if middle @ normal < 0:
            along, normal = -along, -normal
        reach = (middle @ normal) / (ways @ normal)
        place = reach[:, None] * ways - middle
        covered = (reach > 0) & (abs(place @ along) < along @ along) & (abs(place @ aside) < aside @ aside)
        corners = [middle + s * along + t * aside for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        assert clipped(*(tuple(np.float32(corner)) for corner in corners)) == pytest.approx(covered.mean(), abs=4e-3)
