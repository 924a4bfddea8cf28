"""What is told of a frame for filters and for the search for near-equal views: a few numbers and two small pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

GRID = (24, 32)
"""Rows and columns of the small pictures."""
_LUMA = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenObject:
    """An object in a frame.

    Attributes:
        category: as in the scene description.
        image_share: of the image's pixels that are the object's.
        visible_fraction: of the object's own pixels that nothing hides, as the annotations have it; None where they are not recorded.
    """

    category: str
    image_share: float
    visible_fraction: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameFacts:
    """What filters ask of a frame; None is what was not asked for or is not recorded.

    Attributes:
        number: of the frame in its room, from 0.
        objects: those in view, the room's shell not among them.
        brightness: mean of the colour's luma, 0 to 1.
        exposure_ev100: that the colour was exposed with.
        position_m: of the camera in the map, (3,).
        axes: rotation of the optical frame in the map, (3, 3).
        ids: object ids at the points of ``GRID``.
        thumbnail: luma at the points of ``GRID``, 0 to 255, uint8; means over cells.
    """

    number: int
    objects: tuple[SeenObject, ...] | None = None
    brightness: float | None = None
    exposure_ev100: float | None = None
    position_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    axes: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    ids: NDArray[np.uint16] | None = None
    thumbnail: NDArray[np.uint8] | None = None


def small_luma(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the mean luma (Rec. 709) of each cell of ``GRID`` of a colour image (height, width, 3), rounded; no cell is empty."""
    rows, columns = _edges(color.shape[0], GRID[0]), _edges(color.shape[1], GRID[1])
    sums = np.add.reduceat(np.add.reduceat(color.astype(np.uint32), rows[:-1], axis=0), columns[:-1], axis=1)
    counts = np.diff(rows)[:, None] * np.diff(columns)[None, :]
    return np.rint(sums @ _LUMA / counts).astype(np.uint8)


def small_ids(ids: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return the ids in the middle of each cell of ``GRID`` of an image (height, width)."""
    rows, columns = _edges(ids.shape[0], GRID[0]), _edges(ids.shape[1], GRID[1])
    return ids[np.ix_((rows[:-1] + rows[1:]) // 2, (columns[:-1] + columns[1:]) // 2)]


def seen_objects(
    ids: NDArray[np.uint16], categories: Mapping[int, str], fractions: Mapping[int, float] | None = None
) -> tuple[SeenObject, ...]:
    """Return the objects of an id image, by id.

    Args:
        ids: (height, width); 0 is the shell.
        categories: id -> category; ids that it does not know are no objects.
        fractions: id -> visible fraction, where annotations tell it.
    """
    counts = np.bincount(ids.ravel())
    told = fractions or {}
    return tuple(
        SeenObject(category=categories[number], image_share=float(counts[number]) / ids.size, visible_fraction=told.get(number))
        for number in map(int, np.flatnonzero(counts))
        if number and number in categories
    )


def _edges(length: int, cells: int) -> NDArray[np.intp]:
    """Return the first pixel of each cell and the end; a side shorter than the grid has a cell for each pixel."""
    return np.linspace(0, length, min(cells, length) + 1).astype(np.intp)
