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


def early_rate(count: float, there: float) -> float:
    """Return the mean number of things that come up to clutter 1 where ``count`` belong and the grammar stands ``there`` already."""
    return max(count - there, BARE_SHARE * count)


def arrival_levels(rng: np.random.Generator, early: float, late: float, until: float) -> Iterator[float]:
    """Yield the levels of clutter at which things come, in rising order.

    Args:
        rng: source of randomness; the levels up to ``until`` do not depend on ``until``.
        early: mean number of things that come up to clutter 1.
        late: mean number that come for each unit above that.
        until: the last level.
    """
    level = 0.0
    while True:
        need, first = float(rng.standard_exponential()), early * max(_TIDY - level, 0.0)
        if need < first:
            level += need / early
        elif late > 0.0:
            level = max(level, _TIDY) + (need - first) / late
        else:
            return
        if level > until:
            return
        yield level


def mean_arrivals(early: float, late: float, until: float) -> float:
    """Return the mean number of things that come up to the level ``until``; the arguments are those of :func:`arrival_levels`."""
    return early * min(until, _TIDY) + late * max(until - _TIDY, 0.0)


def disorder(level: float) -> float:
    """Return how far from its tidy place a thing lies that comes at a level of clutter: 0 up to clutter 1, 1 from clutter 3."""
    return min(max((level - _TIDY) / (_MESSY - _TIDY), 0.0), 1.0)
