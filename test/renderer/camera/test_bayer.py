"""The mosaic and its interpolation: what is even or straight comes back, filters are the published ones, edges are better by Malvar's."""

import numpy as np
import pytest

from renderer.camera.bayer import PATTERNS, demosaic, mosaic

METHODS = ("bilinear", "malvar")
COLOR = np.array([3.0, 5.0, 11.0], np.float32)


def test_a_mosaic_holds_the_named_colours():
    for pattern in PATTERNS:
        seen = mosaic(np.broadcast_to(COLOR, (4, 6, 3)), pattern)
        names = ["rgb"[int(np.flatnonzero(COLOR == value)[0])] for value in (seen[0, 0], seen[0, 1], seen[1, 0], seen[1, 1])]
        assert "".join(names) == pattern and np.array_equal(seen[2:, 2:], seen[:2, :4])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("size", [(6, 8), (5, 7), (2, 2), (3, 2)])
def test_an_even_image_comes_back(pattern, method, size):
    even = np.broadcast_to(COLOR, (*size, 3))
    np.testing.assert_allclose(demosaic(mosaic(even, pattern), pattern, method), even, rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_slope_comes_back_away_from_the_edges(pattern, method):
    y, x = np.mgrid[:12, :14].astype(np.float32)
    slope = np.stack([10 + 2 * x + y, 30 - x + 3 * y, 50 + x - 2 * y], axis=-1)
    read = demosaic(mosaic(slope, pattern), pattern, method)
    assert np.array_equal(mosaic(read, pattern), mosaic(slope, pattern)), "what was seen stays"
    np.testing.assert_allclose(read[2:-2, 2:-2], slope[2:-2, 2:-2], rtol=1e-5)


def test_the_filters_are_those_of_the_paper():
    """Figure 2 of Malvar, He and Cutler: the answer at a pixel to an impulse elsewhere, in eighths; red at (4, 4) of rggb."""

    def answers(row, column, channel):
        taps = np.zeros((5, 5))
        for y in range(-2, 3):
            for x in range(-2, 3):
                seen = np.full((10, 10), 8.0, np.float32)  # well above 0, where answers would be cut
                seen[row + y, column + x] += 8.0
                taps[y + 2, x + 2] = demosaic(seen, "rggb", "malvar")[row, column, channel] - 8.0
        return taps

    green_at_red = [[0, 0, -1, 0, 0], [0, 0, 2, 0, 0], [-1, 2, 4, 2, -1], [0, 0, 2, 0, 0], [0, 0, -1, 0, 0]]
    red_in_its_row = [[0, 0, 0.5, 0, 0], [0, -1, 0, -1, 0], [-1, 4, 5, 4, -1], [0, -1, 0, -1, 0], [0, 0, 0.5, 0, 0]]
    red_at_blue = [[0, 0, -1.5, 0, 0], [0, 2, 0, 2, 0], [-1.5, 0, 6, 0, -1.5], [0, 2, 0, 2, 0], [0, 0, -1.5, 0, 0]]
    np.testing.assert_allclose(answers(4, 4, 1), green_at_red, atol=1e-5)
    np.testing.assert_allclose(answers(5, 5, 1), green_at_red, atol=1e-5)
    np.testing.assert_allclose(answers(4, 5, 0), red_in_its_row, atol=1e-5)
    np.testing.assert_allclose(answers(5, 4, 0), np.transpose(red_in_its_row), atol=1e-5)
    np.testing.assert_allclose(answers(5, 4, 2), red_in_its_row, atol=1e-5)
    np.testing.assert_allclose(answers(5, 5, 0), red_at_blue, atol=1e-5)
    np.testing.assert_allclose(answers(4, 4, 2), red_at_blue, atol=1e-5)


def test_edges_of_grey_have_weaker_fringes_by_malvar_and_nothing_is_negative():
    y, x = np.mgrid[:64, :64]
    disc = np.where((x - 31.3) ** 2 + (y - 30.8) ** 2 < 400, 1.0, 0.05).astype(np.float32)
    grey = np.repeat(disc[..., None], 3, axis=2)
    fringes = {}
    for method in METHODS:
        read = demosaic(mosaic(grey, "rggb"), "rggb", method)
        fringes[method] = float(((read - grey) ** 2).mean())
        assert read.min() >= 0.0
    assert fringes["malvar"] < 0.5 * fringes["bilinear"]
