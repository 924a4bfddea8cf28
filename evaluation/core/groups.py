"""Pixels by true class and by true distance, and tables of sums over these groups."""

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evaluation.core.errors import EvaluationError
from evaluation.core.task import Measurement, Truth

DISTANCE_EDGES_M: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Where the bins of distance along the optical axis begin; a bin holds its beginning, the last has no end."""

NO_BIN = len(DISTANCE_EDGES_M)
"""Index of pixels that belong to no bin: their true depth is unknown or nothing is hit."""

DISTANCE_NAMES: tuple[str, ...] = (
    *(f"{low:g} to {high:g} m" for low, high in pairwise(DISTANCE_EDGES_M)),
    f"{DISTANCE_EDGES_M[-1]:g} m and more",
)
"""Index of the bin -> its name."""

VOID = 0
"""Class id of what has no class; it is no group of its own."""


class Groups(NamedTuple):
    """Which group each pixel is in: ``cells`` (pixels,) int32 is class id * (NO_BIN + 1) + bin; ``classes`` is the number of class ids."""

    cells: NDArray[np.int32]
    classes: int

    @property
    def rows(self) -> int:
        """How many rows a table of sums by cell has."""
        return self.classes * (NO_BIN + 1)


def distance_bins(depth_m: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the index of the distance bin of each depth, in the depth's shape; ``NO_BIN`` where it is not finite or not positive."""
    depth = np.asarray(depth_m)
    bins = np.zeros(depth.shape, np.uint8)
    for edge in DISTANCE_EDGES_M[1:]:
        bins += depth >= edge
    bins[~((depth > 0.0) & (depth < np.inf))] = NO_BIN
    return bins


def pixel_groups(truth: Truth, shape: tuple[int, ...]) -> Groups:
    """Return the groups of the pixels of an image by the truth's layers "semantic" and "depth"; without these, all void or in no bin.

    Raises:
        EvaluationError: one of the two has another shape.
    """
    cells = np.zeros(shape, np.int32)
    classes = 1
    if truth.get("semantic") is not None:
        semantic = image(truth["semantic"], "semantic", "truth", shape)
        classes = class_count(semantic, "truth")
        np.multiply(semantic, NO_BIN + 1, out=cells, casting="unsafe")
    if truth.get("depth") is not None:
        cells += distance_bins(image(truth["depth"], "depth", "truth", shape))
    else:
        cells += NO_BIN
    return Groups(cells.ravel(), classes)


def class_count(ids: NDArray[Any], whose: str) -> int:
    """Return one more than the highest class id of an image.

    Raises:
        EvaluationError: the image does not hold class ids from 0 to 65535.
    """
    if not np.issubdtype(ids.dtype, np.integer):
        raise EvaluationError(f"{whose} of semantic: expected class ids as integers, got {ids.dtype}")
    low, high = (int(ids.min()), int(ids.max())) if ids.size else (0, 0)
    if low < 0 or high > 65535:
        raise EvaluationError(f"{whose} of semantic: expected class ids from 0 to 65535, got {low if low < 0 else high}")
    return high + 1


def image(array: object, name: str, whose: str, shape: tuple[int, ...] | None = None, channels: int = 1) -> NDArray[Any]:
    """Return an image as an array, checked.

    Args:
        array: (h, w), or (h, w, channels) where there are several.
        name: of the layer or task, for messages.
        whose: "truth" or "estimate", for messages.
        shape: (h, w) that it must have, if any.
        channels: how many numbers a pixel has.

    Raises:
        EvaluationError: it has another shape or does not hold numbers.
    """
    pixels = np.asarray(array)
    if pixels.dtype.kind not in "buif":
        raise EvaluationError(f"{whose} of {name}: expected an array of numbers, got {pixels.dtype}")
    last = (channels,) if channels > 1 else ()
    wanted = (*shape, *last) if shape is not None else None
    if pixels.ndim != 2 + len(last) or pixels.shape[2:] != last or (wanted is not None and pixels.shape != wanted):
        expected = wanted or ("height", "width", *last)
        text = f"expected an image of shape ({', '.join(map(str, expected))}), got {pixels.shape}"
        raise EvaluationError(f"{whose} of {name}: {text}; resize it to the true image in the algorithm")
    return pixels


def layer(truth: Truth, name: str, task: str, channels: int = 1) -> NDArray[Any]:
    """Return a layer of the truth that a task needs.

    Raises:
        EvaluationError: it is missing or has another shape.
    """
    if truth.get(name) is None:
        raise EvaluationError(
            f"truth of {task}: expected the layer {name!r}, got {', '.join(truth) or 'nothing'}; record it (streams.{name})"
        )
    return image(truth[name], name, "truth", channels=channels)


def measurement_of(table: NDArray[np.float64], tally: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None) -> Measurement:
    """Return the measurement of a table of sums by cell.

    Args:
        table: (classes * (NO_BIN + 1), sums) float64, the first column counts true pixels: groups without any are left out.
        tally: makes the tally of a group of its summed row; the row itself if not given.
    """
    cells = table.reshape(-1, NO_BIN + 1, table.shape[1])
    make = tally or np.array
    return Measurement(
        whole=make(cells.sum(axis=(0, 1))),
        by_class=_parts(cells.sum(axis=1), make, VOID),
        by_distance=_parts(cells.sum(axis=0), make, NO_BIN),
    )


def _parts(
    rows: NDArray[np.float64], make: Callable[[NDArray[np.float64]], NDArray[np.float64]], left_out: int
) -> Mapping[int, NDArray[np.float64]]:
    return {key: make(row) for key, row in enumerate(rows) if key != left_out and row[0] > 0}
