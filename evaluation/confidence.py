"""Confidence intervals over rooms.

Frames of one room are alike, so rooms are the sample.  A metric over all rooms becomes a mean of one number for each room, its pseudo-value
of the jackknife (Tukey 1958; Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 11), and the interval is that of this
mean by Student's t.  Means of positive numbers err more to one side than to the other, so theirs is taken on the logarithm; where rooms
differ widely it is as wide as the widest of three, with that of the bootstrap-t (chapter 12), which follows the skewness of the sample,
and, where the logarithms are not skewed to the left, Cox's for lognormal numbers (Zhou and Gao, Statistics in Medicine 1997).
docs/metrics.md shows how often the truth lies within.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from evaluation.core.task import COVERAGE, Tally, Task

DRAWS = 2000
LEVEL = 0.95
FEWEST_DRAWN = 5
"""Rooms from which on the bootstrap-t counts; sets drawn of fewer are too often all of one room."""
WIDE = 0.4
"""Share of the value that rooms spread by (their standard deviation) from which on they differ widely."""
LEFT_SKEWED, LEFT_SKEWED_OF_FEW = 0.6, 1.5
"""Numbers are no lognormal ones where the skewness of their logarithms is below minus the first less the second over their number."""
ROUNDING = 1e-9
"""A spread below this share of the value is that of rounding."""
_ROWS = 256
"""Sets of rooms that are looked at together, so that memory does not grow with the square of the rooms."""
Floats = NDArray[np.float64]
Scale = Literal["error", "share", "signed"]
"""What numbers are: errors, not below 0; shares, 0 to 1; differences and others of both signs."""
SCALES: Mapping[str, Scale] = {"lower": "error", "higher": "share"}
"""Which way of a metric is better -> what its numbers are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A metric: its value over all rooms, and the ends of its confidence interval.

    ``value`` is None where the metric is undefined, ``low`` and ``high`` also where fewer than two rooms tell nothing of their spread.
    """

    value: float | None
    low: float | None = None
    high: float | None = None


def intervals(
    task: Task,
    rooms: Sequence[Tally],
    *,
    seed: int,
    answers: Sequence[tuple[int, int]] = (),
    draws: int = DRAWS,
    level: float = LEVEL,
) -> dict[str, Interval]:
    """Return metric name -> value and confidence interval, within the range of the metric: no error below 0, no share above 1.

    Args:
        task: whose tallies they are.
        rooms: one tally a room, of one room at least: its frames' tallies merged (``task.tallying.merge``).
        seed: of the draws.
        answers: of each room frames with an estimate and all frames, whose share ``coverage`` is multiplied by; after those of ``rooms``
            may come rooms without any estimate.  Empty: all frames have one.
        draws: how many sets of rooms are drawn.
        level: how often an interval is to hold the truth.
    """
    frames = np.array(answers or [(1, 1)] * len(rooms), np.float64).reshape(-1, 2)
    coverage = np.array([metric.name == COVERAGE for metric in task.metrics])

    def statistic(weights: Floats) -> Floats:
        values = task.tallying.finish(rooms, weights[:, : len(rooms)])
        answered, asked = (weights @ frames).T
        share = np.divide(answered, asked, out=np.full(len(weights), np.nan), where=asked > 0.0)
        return np.where(coverage, values * share[:, None], values)

    values = statistic(np.ones((1, len(frames))))[0]
    if len(frames) < 2:
        return {m.name: Interval(value=float(v) if np.isfinite(v) else None) for m, v in zip(task.metrics, values, strict=True)}
    own = [task.tallying.finish([room], np.ones((1, 1)))[0] for room in rooms]
    has_value = np.concatenate([np.isfinite(own), np.tile(coverage, (len(frames) - len(rooms), 1))])
    return {
        metric.name: mean_interval(float(value), column, SCALES[metric.better], seed=seed, draws=draws, level=level)
        for metric, value, column in zip(task.metrics, values, pseudo_values(statistic, has_value).T, strict=True)
    }


def pseudo_values(statistic: Callable[[Floats], Floats], has_value: NDArray[np.bool_]) -> Floats:
    """Return (rooms, columns) float64: of each room n times the whole less n - 1 times what the others give.

    Args:
        statistic: (m, rooms) float64 weights, how often each room counts -> (m, columns).
        has_value: (rooms, columns) which rooms count among the n of a column; the others' pseudo-values are NaN.
    """
    rooms = len(has_value)
    starts = range(0, rooms, _ROWS)
    without = np.concatenate([statistic(1.0 - np.eye(min(_ROWS, rooms - start), rooms, start)) for start in starts])
    counts = has_value.sum(axis=0)
    pseudo: Floats = np.where(has_value, counts * statistic(np.ones((1, rooms))) - (counts - 1) * without, np.nan)
    return pseudo


def mean_interval(value: float, sample: Floats, scale: Scale, *, seed: int = 0, draws: int = DRAWS, level: float = LEVEL) -> Interval:
    """Return a value with the interval of the mean of a sample, (rooms,) with NaN where a room has none, moved to that value."""
    known = sample[np.isfinite(sample)]
    if not np.isfinite(value) or len(known) < 2:
        return Interval(value=float(value) if np.isfinite(value) else None)
    if scale == "share":
        missing = mean_interval(1.0 - value, 1.0 - known, "error", seed=seed, draws=draws, level=level)
        assert missing.low is not None and missing.high is not None
        return Interval(value=float(value), low=max(1.0 - missing.high, 0.0), high=min(1.0 - missing.low, 1.0))
    apart = known - known.mean()
    error = float(apart.std(ddof=1)) / np.sqrt(len(known))
    if error <= ROUNDING * abs(value):
        return Interval(value=float(value), low=float(value), high=float(value))
    student = float(stdtrit(len(known) - 1, 0.5 + 0.5 * level))
    if scale == "error" and len(known) > 2 and value + apart.min() > 0.0:
        low, high = _positive_ends(value, apart, level, seed, draws)
    else:
        low, high = value - student * error, value + student * error
    return Interval(value=float(value), low=float(max(low, 0.0) if scale == "error" else low), high=float(high))


def _positive_ends(value: float, apart: Floats, level: float, seed: int, draws: int) -> tuple[float, float]:
    """Return the ends of the widest interval of positive numbers, so far ``apart`` from their mean ``value``."""
    count = len(apart)
    error, student = float(apart.std(ddof=1)) / np.sqrt(count), float(stdtrit(count - 1, 0.5 + 0.5 * level))
    lows, highs = [value * np.exp(-student * error / value)], [value * np.exp(student * error / value)]
    if error * np.sqrt(count) > WIDE * value:
        logs = np.log(value + apart)
        if count < FEWEST_DRAWN or skewness(logs) > -LEFT_SKEWED - LEFT_SKEWED_OF_FEW / count:
            variance = float(logs.var(ddof=1))
            middle, reach = logs.mean() + 0.5 * variance, student * np.sqrt(variance / count + 0.5 * variance**2 / (count - 1))
            lows.append(np.exp(middle - reach))
            highs.append(np.exp(middle + reach))
        if count >= FEWEST_DRAWN:
            least, most = np.quantile(_pivots(apart, seed, draws), [0.5 - 0.5 * level, 0.5 + 0.5 * level])
            lows.append(value - most * error)
            highs.append(value - least * error)
    return min(lows), max(highs)


def skewness(sample: Floats) -> float:
    """Return the third moment about the mean over the third power of the standard deviation; 0 of equal numbers."""
    apart = sample - sample.mean()
    variance = float((apart**2).mean())
    return float((apart**3).mean()) / variance**1.5 if variance > 0.0 else 0.0


def _pivots(apart: Floats, seed: int, draws: int) -> Floats:
    """Return the mean over its standard error in each set drawn of a sample of mean 0, (draws,), less those of a single room."""
    count = len(apart)
    weights = resampling_weights(count, draws, seed)
    mean = weights @ apart / count
    variance = weights @ apart**2 / count - mean**2
    several = variance > ROUNDING * apart.var()
    pivots: Floats = mean[several] / np.sqrt(variance[several] / (count - 1))
    return pivots


@lru_cache(maxsize=32)
def resampling_weights(units: int, draws: int, seed: int) -> Floats:
    """Return (draws, units) float64, read-only: how often each unit is drawn when as many as there are are drawn with replacement."""
    rng = np.random.default_rng([seed, units])
    weights = rng.multinomial(units, np.full(units, 1.0 / units), size=draws).astype(np.float64)
    weights.flags.writeable = False
    return weights
