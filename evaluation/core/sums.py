"""Tallies that are sums: vectors of float64 that add up over frames.

Vectors of one task may differ in length, where classes that a frame does not know come last; the missing end counts as zeros.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from evaluation.core.task import Tallying

Sums = NDArray[np.float64]


def stack(tallies: Sequence[Sums]) -> Sums:
    """Return (n, longest) float64, shorter vectors filled with zeros."""
    lengths = {len(tally) for tally in tallies}
    if len(lengths) == 1:
        return np.array(tallies, np.float64)
    rows = np.zeros((len(tallies), max(lengths)))
    for row, tally in zip(rows, tallies, strict=True):
        row[: len(tally)] = tally
    return rows


def merge_sums(tallies: Sequence[Sums]) -> Sums:
    """Return their sum."""
    total: Sums = stack(tallies).sum(axis=0)
    return total


def sums_tallying(formula: Callable[[Sums], Sums]) -> Tallying:
    """Return the tallying of sums; ``formula`` takes (draws, sums) to (draws, metrics), both float64."""

    def finish(tallies: Sequence[Sums], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        with np.errstate(divide="ignore", invalid="ignore"):
            return formula(weights @ stack(tallies))

    return Tallying(merge=merge_sums, finish=finish)
