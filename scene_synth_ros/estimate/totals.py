"""What a whole dataset costs, from the costs of a sample of its rooms, and how long machines work on it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

CONFIDENCE = 0.95


class Interval(NamedTuple):
    """An estimate and its interval of confidence."""

    mean: float
    low: float
    high: float

    def times(self, factor: float) -> Interval:
        """Return the interval of a multiple."""
        return Interval(self.mean * factor, self.low * factor, self.high * factor)


def total_of(sample: Sequence[float], count: int) -> Interval:
    """Return the total over ``count`` rooms, from the values of a simple random sample of them.

    The total is N times the sample's mean, its standard error is N s sqrt(1/n - 1/N), and the interval is Student's t with n - 1 degrees of
    freedom (Cochran, Sampling Techniques, 3rd ed. 1977, equations 2.21 to 2.24).  The lower end is at least what was measured.

    Args:
        sample: values of the n rooms measured, not negative, at least one; with one there is no upper end.
        count: N, at least n.
    """
    values = np.asarray(sample, np.float64)
    n = len(values)
    mean = count * float(values.mean())
    if n >= count:
        return Interval(mean, mean, mean)
    if n == 1:
        return Interval(mean, float(values.sum()), math.inf)
    error = count * float(values.std(ddof=1)) * math.sqrt(1.0 / n - 1.0 / count)
    half = float(stdtrit(n - 1, 0.5 + CONFIDENCE / 2.0)) * error
    return Interval(mean, max(float(values.sum()), mean - half), mean + half)


def seconds_on(work: Interval, shards: int, machines: int, workers: int, start_s: float) -> Interval:
    """Return how long so many machines work, by the wall clock, when each worker takes the next shard as soon as it has made one.

    The last shards leave workers idle: with S equal shards and M workers there are ceil(S / M) rounds.

    Args:
        work: seconds that one worker would take for all shards, while the others of its machine work too.
        shards: of the dataset.
        machines: at work.
        workers: of each machine.
        start_s: what a worker takes before its first room.
    """
    rounds = math.ceil(shards / (machines * workers))
    share = rounds / shards
    return Interval(*(start_s + share * seconds for seconds in work))


def sample_indices(rooms: int, count: int, types: int) -> tuple[int, ...]:
    """Return indices of rooms spread evenly over a dataset, as many of each room type; all where there are no more.

    Args:
        rooms: of the dataset; room ``i`` is of type ``i % types``.
        count: how many to choose; rounded up to whole rounds of types.
        types: room types that take turns.
    """
    rounds = math.ceil(rooms / types)
    wanted = min(rounds, math.ceil(count / types))
    firsts = [(2 * k + 1) * rounds // (2 * wanted) * types for k in range(wanted)]
    return tuple(index for first in firsts for index in range(first, first + types) if index < rooms)
