"""Copies between images and the lanes of a packet, a tile of 4 x 4 pixels at a time.

Whole tiles go by loops of a known length, which are several times as fast as loops that end where the image does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import TILE
from renderer.core.embree import LANES
from renderer.core.kernel import inlined


@inlined
def is_whole(image: NDArray[np.float32], column: int, row: int) -> bool:
    """Return whether the tile that begins at (column, row) lies within the image."""
    height: int = image.shape[0]
    width: int = image.shape[1]
    return row + TILE <= height and column + TILE <= width


@inlined
def load_numbers(image: NDArray[np.float32], column: int, row: int, field: int, lanes: NDArray[np.float32]) -> None:
    """Copy a tile of an image (height, width) to a field of the lanes; beyond the image its last pixels stand for what is missing."""
    if is_whole(image, column, row):
        for k in range(LANES):
            lanes[field + k] = image[row + (k >> 2), column + (k & 3)]
    else:
        for k in range(LANES):
            lanes[field + k] = image[min(row + (k >> 2), image.shape[0] - 1), min(column + (k & 3), image.shape[1] - 1)]


@inlined
def load_pairs(image: NDArray[np.float32], column: int, row: int, field: int, lanes: NDArray[np.float32]) -> None:
    """Copy a tile of an image (height, width, 2) to two fields in the same way."""
    if is_whole(image, column, row):
        for k in range(LANES):
            y, x = row + (k >> 2), column + (k & 3)
            lanes[field + k], lanes[field + LANES + k] = image[y, x, 0], image[y, x, 1]
    else:
        for k in range(LANES):
            y, x = min(row + (k >> 2), image.shape[0] - 1), min(column + (k & 3), image.shape[1] - 1)
            lanes[field + k], lanes[field + LANES + k] = image[y, x, 0], image[y, x, 1]


@inlined
def load_vectors(image: NDArray[np.float32], column: int, row: int, field: int, lanes: NDArray[np.float32]) -> None:
    """Copy a tile of an image (height, width, 3) to three fields in the same way."""
    if is_whole(image, column, row):
        for k in range(LANES):
            y, x = row + (k >> 2), column + (k & 3)
            lanes[field + k], lanes[field + LANES + k], lanes[field + 2 * LANES + k] = image[y, x, 0], image[y, x, 1], image[y, x, 2]
    else:
        for k in range(LANES):
            y, x = min(row + (k >> 2), image.shape[0] - 1), min(column + (k & 3), image.shape[1] - 1)
            lanes[field + k], lanes[field + LANES + k], lanes[field + 2 * LANES + k] = image[y, x, 0], image[y, x, 1], image[y, x, 2]


@inlined
def store_numbers(lanes: NDArray[np.float32], field: int, column: int, row: int, image: NDArray[np.float32]) -> None:
    """Copy a field of the lanes to a tile of an image (height, width)."""
    if is_whole(image, column, row):
        for k in range(LANES):
            image[row + (k >> 2), column + (k & 3)] = lanes[field + k]
    else:
        for y in range(row, min(row + TILE, image.shape[0])):
            for x in range(column, min(column + TILE, image.shape[1])):
                image[y, x] = lanes[field + (y - row) * TILE + x - column]


@inlined
def store_pairs(lanes: NDArray[np.float32], field: int, column: int, row: int, image: NDArray[np.float32]) -> None:
    """Copy two fields to a tile of an image (height, width, 2)."""
    if is_whole(image, column, row):
        for k in range(LANES):
            y, x = row + (k >> 2), column + (k & 3)
            image[y, x, 0], image[y, x, 1] = lanes[field + k], lanes[field + LANES + k]
    else:
        for y in range(row, min(row + TILE, image.shape[0])):
            for x in range(column, min(column + TILE, image.shape[1])):
                k = (y - row) * TILE + x - column
                image[y, x, 0], image[y, x, 1] = lanes[field + k], lanes[field + LANES + k]


@inlined
def store_vectors(lanes: NDArray[np.float32], field: int, column: int, row: int, image: NDArray[np.float32]) -> None:
    """Copy three fields to a tile of an image (height, width, 3)."""
    if is_whole(image, column, row):
        for k in range(LANES):
            y, x = row + (k >> 2), column + (k & 3)
            image[y, x, 0], image[y, x, 1], image[y, x, 2] = lanes[field + k], lanes[field + LANES + k], lanes[field + 2 * LANES + k]
    else:
        for y in range(row, min(row + TILE, image.shape[0])):
            for x in range(column, min(column + TILE, image.shape[1])):
                k = (y - row) * TILE + x - column
                image[y, x, 0], image[y, x, 1], image[y, x, 2] = lanes[field + k], lanes[field + LANES + k], lanes[field + 2 * LANES + k]
