"""Places within large triangles of curved surfaces, where nodes lie: rows along long thin ones, lattices in others."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

INSET = 0.25
"""How far off rims nodes lie, in steps between them."""


class Places(NamedTuple):
    """Places within t large triangles, of a row or more each.

    size: (t, 2), how many places its rows have, and how many rows there are; corners: (t, 3, 2), column and row of its corners; whose,
    at: (e,), the triangle of each place, and where in ``grid`` it is from the first of all on; shares, inner: (e, 3), barycentric weights
    of the places, and of points near them that lie off the rims.
    """

    size: NDArray[np.int64]
    corners: NDArray[np.float64]
    whose: NDArray[np.int64]
    at: NDArray[np.int64]
    shares: NDArray[np.float64]
    inner: NDArray[np.float64]


def find_strips(corners: NDArray[np.float64], spacing_m: NDArray[np.float64]) -> Places:
    """Return the places along triangles (t, 3, 3), so far apart (t,): below along the longest edge, above along the other two."""
    edges = np.roll(corners, -1, axis=1) - corners
    begin, every = np.linalg.norm(edges, axis=2).argmax(axis=1), np.arange(len(corners))
    longest = edges[every, begin]
    squared = (longest * longest).sum(axis=1)
    # How far along it the third corner stands.
    foot = np.clip(-(edges[every, begin - 1] * longest).sum(axis=1) / squared, 1e-3, 1.0 - 1e-3)
    steps = np.ceil(np.sqrt(squared) / spacing_m).astype(np.int64)
    whose = np.repeat(every, 2 * (steps + 1))
    row, column = np.divmod(count_up(2 * (steps + 1)), steps[whose] + 1)

    def shares(inset: float) -> NDArray[np.float64]:
        along = np.clip(column, inset, steps[whose] - inset) / steps[whose]
        height = np.minimum(along / foot[whose], (1.0 - along) / (1.0 - foot[whose])) * np.where(row == 0, inset, 1.0 - inset)
        values = np.column_stack([1.0 - along - height * (1.0 - foot[whose]), along - height * foot[whose], height])
        turned = np.empty_like(values)
        np.put_along_axis(turned, (begin[whose, None] + np.arange(3)) % 3, values, axis=1)
        return turned

    at = np.zeros((len(corners), 3, 2))
    at[every, (begin + 1) % 3, 0] = steps
    at[every, begin - 1] = np.column_stack([foot * steps, np.ones(len(corners))])
    return Places(np.column_stack([steps + 1, np.full(len(steps), 2)]), at, whose, np.arange(len(whose)), shares(0.0), shares(INSET))


def find_lattices(corners: NDArray[np.float64], spacing_m: NDArray[np.float64]) -> Places:
    """Return the places in triangles (t, 3, 3) that divide each edge into equal steps, at most so long (t,)."""
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    steps = np.ceil(longest / spacing_m).astype(np.int64)
    size = steps + 1
    whose = np.repeat(np.arange(len(corners)), size * size)
    row, column = np.divmod(count_up(size * size), size[whose])
    within = row + column <= steps[whose]
    at, whose, row, column = np.flatnonzero(within), whose[within], row[within], column[within]
    shares = np.column_stack([steps[whose] - row - column, column, row]) / steps[whose, None]
    inset = (INSET / np.maximum(steps, 1))[whose, None]
    inner = np.maximum(shares, inset)
    ends = np.zeros((len(corners), 3, 2))
    ends[:, 1, 0] = ends[:, 2, 1] = steps
    return Places(np.column_stack([size, size]), ends, whose, at, shares, inner / inner.sum(axis=1, keepdims=True))


def count_up(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return 0, 1, ... for each of ``counts`` (t,), one after the other."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
