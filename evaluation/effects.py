"""How much a metric reacts to a factor: means over rooms, paired contrasts, standardised regression, all with intervals over rooms.

Frames of a room are alike and count as one sample.  Intervals are those of :mod:`evaluation.confidence`; what is compared stays paired
within rooms.  They have no ends with fewer than two rooms.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evaluation.confidence import LEVEL, Interval, Scale, mean_interval, pseudo_values

Array = NDArray[np.float64]


class Contrast(NamedTuple):
    """The range of a metric over a factor's values.

    Attributes:
        range: the largest mean difference to the base minus the smallest, at least 0, in the metric's unit.
        least, most: columns where the metric is smallest and largest.
    """

    range: Interval
    least: int
    most: int


class Regression(NamedTuple):
    """A linear fit: a coefficient for each factor, and the share of variance that all of them explain."""

    coefficients: tuple[Interval, ...]
    r_squared: float


def room_means(values: Array, scale: Scale, seed: int = 0) -> list[Interval | None]:
    """Return the mean of each column over the rooms that have it.

    Args:
        values: (rooms, columns), NaN where a room has none.
        scale: what the numbers are.
        seed: of the bootstrap.

    Returns:
        a mean with its interval for each column, None for a column without rooms.
    """
    means = _means(values)
    return [mean_interval(means[k], values[:, k], scale, seed=seed) if np.isfinite(means[k]) else None for k in range(values.shape[1])]


def differences(values: Array, base: int | None) -> Array:
    """Return values minus those of the column ``base`` of the same room, (rooms, columns); None: minus the room's own mean."""
    if base is not None:
        return values - values[:, [base]]
    known = np.isfinite(values)
    means: Array = np.where(known, values, 0.0).sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    return values - means


def contrast(values: Array, base: int | None, seed: int = 0, level: float = LEVEL) -> Contrast | None:
    """Return how far the mean differences to the base lie apart, paired within rooms.

    The two columns are chosen once, in all rooms; the interval is that of their difference, so it holds 0 where the sign is not sure.

    Args:
        values: (rooms, columns), NaN where a room has none.
        base: column of the base; None: there is none, each room is compared with its own mean.
        seed: of the bootstrap.
        level: of the interval.

    Returns:
        None where fewer than two columns have a room in common with the base.
    """
    apart = differences(values, base)
    means = _means(apart)
    if np.isfinite(means).sum() < 2:
        return None
    least, most = int(np.nanargmin(means)), int(np.nanargmax(means))
    if least == most:
        least, most = (int(column) for column in np.flatnonzero(np.isfinite(means))[:2])
    span = mean_interval(means[most] - means[least], apart[:, most] - apart[:, least], "signed", seed=seed, level=level)
    return Contrast(span, least, most)


def standardised_regression(
    response: Array, factors: Sequence[Array], rooms: NDArray[np.integer[Any]], seed: int = 0, level: float = LEVEL
) -> Regression | None:
    """Return the standardised coefficients of a linear fit of the response to all factors at once, within rooms.

    A coefficient is the standard deviation of a factor's fitted part over that of the response; for a factor of one column this is its
    standardised regression coefficient (Saltelli et al., Global Sensitivity Analysis, The Primer, 2008, section 1.2.5) with its sign.
    Response and columns are first centred within each room, so that only what changes within rooms counts, or by their mean where no room
    has two samples.

    Args:
        response: (samples,), finite.
        factors: for each factor (samples, columns): one column of numbers, or for names one column of 0 and 1 for each but the first.
        rooms: (samples,), the number of each sample's room.
        seed: of the bootstrap over rooms.
        level: of the intervals.

    Returns:
        None where the response does not change.
    """
    names, place = np.unique(rooms, return_inverse=True)
    ends = np.cumsum([0, *(columns.shape[1] for columns in factors)])
    matrix = np.column_stack([*factors, response])
    group = place if len(names) < len(place) else np.zeros_like(place)
    sums = np.zeros((group.max() + 1, matrix.shape[1]))
    np.add.at(sums, group, matrix)
    matrix = matrix - (sums / np.bincount(group)[:, None])[group]
    products = np.zeros((len(names), matrix.shape[1], matrix.shape[1]))
    np.add.at(products, place, matrix[:, :, None] * matrix[:, None, :])
    whole = products.sum(axis=0)
    if whole[-1, -1] <= 1e-24 * max(1.0, float(np.abs(response).max()) ** 2):
        return None
    values, r_squared = _fit(whole[None], ends)
    pseudo = pseudo_values(
        lambda weights: _fit(np.tensordot(weights, products, axes=1), ends)[0], np.ones((len(names), len(factors)), bool)
    )
    coefficients = tuple(
        mean_interval(value, column, "signed", seed=seed, level=level) for value, column in zip(values[0], pseudo.T, strict=True)
    )
    return Regression(coefficients, float(r_squared[0]))


def _fit(products: Array, ends: Array) -> tuple[Array, Array]:
    """Return coefficients (fits, factors) and shares explained (fits,) of sums of products of columns, the response last."""
    inner, mixed, total = products[:, :-1, :-1], products[:, :-1, -1], products[:, -1, -1]
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", inner), 1e-300))
    slopes = np.einsum("nij,nj->ni", np.linalg.pinv(inner / (scale[:, :, None] * scale[:, None, :]), rcond=1e-9), mixed / scale) / scale
    total = np.where(total > 0.0, total, np.nan)
    parts = []
    for first, last in pairwise(ends):
        own, block = slopes[:, first:last], inner[:, first:last, first:last]
        size = np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", own, block, own), 0.0) / total)
        parts.append(size * np.sign(own[:, 0]) if last - first == 1 else size)
    return np.stack(parts, axis=1), np.einsum("ni,ni->n", slopes, mixed) / total


def _means(values: Array) -> Array:
    """Return the means of columns over the rooms that have them, (columns,), NaN where none has."""
    counts = np.isfinite(values).sum(axis=0)
    means: Array = np.divide(np.nansum(values, axis=0), counts, out=np.full(values.shape[1], np.nan), where=counts > 0)
    return means
