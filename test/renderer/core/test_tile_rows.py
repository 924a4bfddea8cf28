"""Packets written to images row by row: every number at its pixel, and none beside the tile."""

import numpy as np
import pytest
from numba import njit

from renderer.core.tile_rows import store_bits, store_rows, store_vectors

WIDTH, HEIGHT, COLUMN, ROW = 11, 7, 5, 2
TILE = (slice(ROW, ROW + 4), slice(COLUMN, COLUMN + 4))


@njit
def rows(source, field, image, at, stride):
    store_rows(source, field, image, at, stride)


@njit
def vectors(source, field, image, at, stride):
    store_vectors(source, field, image, at, stride)


@njit
def bits(source, field, shift, image, at, stride):
    store_bits(source, field, shift, image, at, stride)


def test_numbers_lie_at_their_pixels():
    source, image = np.arange(48, dtype=np.float32), np.full((HEIGHT, WIDTH), -1.0, np.float32)
    rows(source, 16, image.reshape(-1), ROW * WIDTH + COLUMN, WIDTH)
    assert np.array_equal(image[TILE], np.arange(16.0, 32.0).reshape(4, 4)) and (image == -1.0).sum() == image.size - 16


def test_vectors_lie_side_by_side():
    source, image = np.arange(64, dtype=np.float32), np.full((HEIGHT, WIDTH, 3), -1.0, np.float32)
    vectors(source, 16, image.reshape(-1), 3 * (ROW * WIDTH + COLUMN), 3 * WIDTH)
    assert (
        np.array_equal(image[TILE], np.arange(16.0, 64.0).reshape(3, 4, 4).transpose(1, 2, 0)) and (image == -1.0).sum() == image.size - 48
    )


@pytest.mark.parametrize(("dtype", "shift"), [(np.uint8, 0), (np.uint8, 4), (np.uint16, 8)])
def test_bits_are_cut_out(dtype, shift):
    source, image = np.random.default_rng(2).integers(0, 2**32, 32, np.uint32), np.zeros((HEIGHT, WIDTH), dtype)
    bits(source, 16, shift, image.reshape(-1), ROW * WIDTH + COLUMN, WIDTH)
    assert np.array_equal(image[TILE], (source[16:] >> shift).astype(dtype).reshape(4, 4))
    image[TILE] = 0
    assert not image.any()
