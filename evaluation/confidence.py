"""Confidence intervals by the bootstrap over rooms (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 13).

Frames of one room are alike, so whole rooms are drawn again, with replacement.  The interval is that between percentiles of the metric over
the draws.  The same seed gives the same interval.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evaluation.core.task import Tally, Task

DRAWS = 1000
LEVEL = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A metric: its value over all rooms, and the ends of its confidence interval.

    ``value`` is None where the metric is undefined, ``low`` and ``high`` also where fewer than two rooms tell nothing of their spread.
    """

    value: float | None
    low: float | None = None
    high: float | None = None


@lru_cache(maxsize=32)
def resampling_weights(units: int, draws: int, seed: int) -> NDArray[np.float64]:
    """Return (draws, units) float64, read-only: how often each unit is drawn when as many as there are are drawn with replacement."""
    rng = np.random.default_rng([seed, units])
    weights = rng.multinomial(units, np.full(units, 1.0 / units), size=draws).astype(np.float64)
    weights.flags.writeable = False
    return weights


def intervals(task: Task, rooms: Sequence[Tally], *, seed: int, draws: int = DRAWS, level: float = LEVEL) -> dict[str, Interval]:
    """Return metric name -> value and confidence interval.

    Args:
        task: whose tallies they are.
        rooms: one tally a room: its frames' tallies merged (``task.tallying.merge``).
        seed: of the draws.
        draws: how many sets of rooms are drawn.
        level: share of the draws that lies inside the interval.
    """
    values = task.score_tallies(rooms)
    if len(rooms) < 2:
        return {name: Interval(value=_known(value)) for name, value in values.items()}
    drawn = task.tallying.finish(rooms, resampling_weights(len(rooms), draws, seed))
    found = {}
    for (name, value), column in zip(values.items(), drawn.T, strict=True):
        defined = column[np.isfinite(column)]
        if len(defined) and np.isfinite(value):
            low, high = np.percentile(defined, [50.0 * (1.0 - level), 50.0 * (1.0 + level)])
            found[name] = Interval(value=value, low=float(low), high=float(high))
        else:
            found[name] = Interval(value=_known(value))
    return found


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
