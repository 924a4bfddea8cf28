"""When small things come: each at a level of clutter, so that more clutter adds things and leaves those that were there.

The things of a support are the events of a Poisson process whose time is the clutter: those that came up to what is asked for are there.
Their number has a Poisson distribution at any clutter, and every clutter contains what smaller ones have.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

BARE_SHARE = 0.25
"""Least share of a support's count that comes up to clutter 1, however much the grammar stands there itself."""

_TIDY, _MESSY = 1.0, 3.0


def arrival_levels(rng: np.random.Generator, count: float, there: float, begins: float, until: float) -> Iterator[float]:
    """Yield the levels of clutter at which things come, in rising order.

    Args:
        rng: source of randomness; the levels up to ``until`` do not depend on ``until``.
        count: mean number of things that come for each unit of clutter.
        there: number of things that the grammar stands there, which count for the first unit.
        begins: level at which things begin to come.
        until: the last level.
    """
    early, level = _early(count, there), begins
    while count > 0.0:
        need = float(rng.standard_exponential())
        # the rate changes at clutter 1
        first = max(_TIDY - level, 0.0)
        level = level + need / early if need <= early * first else level + first + (need - early * first) / count
        if level > until:
            return
        yield level


def mean_arrivals(count: float, there: float, begins: float, until: float) -> float:
    """Return the mean number of things that come up to the level ``until``; the arguments are those of :func:`arrival_levels`."""
    return _early(count, there) * max(min(until, _TIDY) - begins, 0.0) + count * max(until - max(begins, _TIDY), 0.0)


def _early(count: float, there: float) -> float:
    """Return the mean number of things that come up to clutter 1."""
    return max(count - there, BARE_SHARE * count)


def disorder(level: float) -> float:
    """Return how far from its tidy place a thing lies that comes at a level of clutter: 0 up to clutter 1, 1 from clutter 3."""
    return min(max((level - _TIDY) / (_MESSY - _TIDY), 0.0), 1.0)
