"""Tiles between images and lanes: every number at its pixel, none beside the tile, whole tiles and such as lie over the edge alike."""

import numpy as np
import pytest

from renderer.core import tiles
from renderer.core.kernel import from_python

WIDTH, HEIGHT = 11, 7
PLACES = [(0, 0), (4, 1), (7, 3), (8, 0), (4, 4), (8, 4)]
STORES = {1: from_python(tiles.store_numbers), 2: from_python(tiles.store_pairs), 3: from_python(tiles.store_vectors)}
LOADS = {1: from_python(tiles.load_numbers), 2: from_python(tiles.load_pairs), 3: from_python(tiles.load_vectors)}
store_bits = from_python(tiles.store_bits)


def shape(channels):
    return (HEIGHT, WIDTH) if channels == 1 else (HEIGHT, WIDTH, channels)


def tile(image, column, row):
    return image[row : row + 4, column : column + 4]


@pytest.mark.parametrize("channels", STORES)
@pytest.mark.parametrize(("column", "row"), PLACES)
def test_fields_lie_at_their_pixels(channels, column, row):
    lanes, image = np.arange(80, dtype=np.float32), np.full(shape(channels), -1.0, np.float32)
    STORES[channels](lanes, 16, column, row, image)
    there = tile(image, column, row)
    expected = lanes[16:][: 16 * channels].reshape(channels, 4, 4).transpose(1, 2, 0)[: there.shape[0], : there.shape[1]]
    assert np.array_equal(there, expected.reshape(there.shape))
    assert (image == -1.0).sum() == image.size - there.size


@pytest.mark.parametrize("channels", LOADS)
@pytest.mark.parametrize(("column", "row"), PLACES)
def test_pixels_lie_in_their_lanes(channels, column, row):
    """Beyond the image its last pixels stand for what is missing."""
    image, lanes = np.arange(HEIGHT * WIDTH * channels, dtype=np.float32).reshape(shape(channels)), np.full(80, -1.0, np.float32)
    LOADS[channels](image, column, row, 16, lanes)
    missing = [(0, max(row + 4 - HEIGHT, 0)), (0, max(column + 4 - WIDTH, 0)), (0, 0)]
    expected = np.pad(tile(image, column, row).reshape(-1, min(4, WIDTH - column), channels), missing, "edge").transpose(2, 0, 1)
    assert np.array_equal(lanes[16:][: 16 * channels], expected.ravel())
    assert (lanes == -1.0).sum() == 80 - 16 * channels


@pytest.mark.parametrize(("dtype", "shift"), [(np.uint8, 0), (np.uint8, 4), (np.uint16, 8), (np.int32, 0)])
@pytest.mark.parametrize(("column", "row"), PLACES)
def test_bits_are_cut_out(dtype, shift, column, row):
    lanes, image = np.random.default_rng(2).integers(0, 2**32, 32, np.uint32), np.zeros((HEIGHT, WIDTH), dtype)
    store_bits(lanes, 16, shift, column, row, image)
    there = tile(image, column, row)
    assert np.array_equal(there, (lanes[16:] >> shift).astype(dtype).reshape(4, 4)[: there.shape[0], : there.shape[1]])
    there[...] = 0
    assert not image.any()
