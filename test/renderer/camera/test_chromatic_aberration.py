"""Lateral chromatic aberration: where the points of each colour go, and what stays."""

import math

import numpy as np
import pytest

from renderer.camera.sensor import magnify_channels

SIZE = (49, 81)


def centroid(image):
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    return np.array([(image * u).sum(), (image * v).sum()]) / image.sum()


@pytest.mark.parametrize(("column", "row"), [(10, 8), (70, 40), (40, 4), (40, 24)])
def test_points_move_outward_in_proportion_to_their_distance(column, row):
    light = np.zeros((*SIZE, 3), np.float32)
    light[row - 1 : row + 2, column - 1 : column + 2] = 1.0
    red, blue = 2.0, -1.5
    seen = magnify_channels(light, red, blue)
    away = np.array([column - 40.0, row - 24.0]) / (0.5 * math.hypot(81, 49))
    np.testing.assert_allclose(centroid(seen[..., 0]), np.array([column, row]) + red * away, atol=0.05)
    np.testing.assert_allclose(centroid(seen[..., 2]), np.array([column, row]) + blue * away, atol=0.05)
    assert np.array_equal(seen[..., 1], light[..., 1])


def test_even_light_stays_and_so_does_all_where_nothing_is_asked():
    light = np.full((*SIZE, 3), 7.0, np.float32)
    assert np.array_equal(magnify_channels(light, 3.0, -3.0), light)
    assert magnify_channels(light, 0.0, 0.0) is light
    for size in ((1, 1), (1, 5), (2, 1)):
        assert magnify_channels(np.ones((*size, 3), np.float32), 1.0, -1.0).shape == (*size, 3)


def test_a_slope_is_magnified_exactly():
    x = np.broadcast_to(np.arange(81, dtype=np.float32), SIZE)
    seen = magnify_channels(np.stack([x, x, x], axis=-1), 1.0, 0.0)
    np.testing.assert_allclose(seen[24, :, 0], 40 + (np.arange(81) - 40) / (1 + 1 / (0.5 * math.hypot(81, 49))), rtol=1e-5)
