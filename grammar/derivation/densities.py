"""Truncated normal distributions and mixtures of them: sampling by inversion of the distribution function, and log-densities."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.special import ndtr, ndtri

from grammar.spec.object_rules import ObjectRule
from grammar.spec.values import TruncatedNormal

_LOG_SQRT_2PI = 0.5 * math.log(2.0 * math.pi)


def draw_truncated_normal(rng: np.random.Generator, mean: float, sd: float, low: float, high: float) -> float:
    """Draw from the normal distribution (mean, sd) truncated to [low, high]; one number is taken from ``rng``."""
    below, above = _tails(mean, sd, low, high)
    value = mean + sd * float(ndtri(below + (above - below) * rng.random()))
    return min(max(value, low), high) if math.isfinite(value) else min(max(mean, low), high)


@lru_cache(maxsize=4096)
def _tails(mean: float, sd: float, low: float, high: float) -> tuple[float, float]:
    """Return the normal distribution's function at both bounds."""
    return float(ndtr((low - mean) / sd)), float(ndtr((high - mean) / sd))


def truncated_normal_log_density(value: float, mean: float, sd: float, low: float, high: float) -> float:
    """Return the log-density of a truncated normal at ``value``; 0 where low equals high, since nothing is drawn there; -inf outside."""
    if low == high:
        return 0.0
    if not low <= value <= high:
        return -math.inf
    share = float(ndtr((high - mean) / sd) - ndtr((low - mean) / sd))
    return -0.5 * ((value - mean) / sd) ** 2 - math.log(sd) - _LOG_SQRT_2PI - math.log(max(share, 1e-300))


def draw_with_log_density(rng: np.random.Generator, normal: TruncatedNormal) -> tuple[float, float]:
    """Return a value drawn from ``normal`` and its log-density."""
    value = draw_truncated_normal(rng, normal.mean, normal.sd, normal.low, normal.high)
    return value, truncated_normal_log_density(value, normal.mean, normal.sd, normal.low, normal.high)


def draw_index(rng: np.random.Generator, probabilities: Sequence[float]) -> int:
    """Draw an index with the given probabilities, which sum to 1; one number is taken from ``rng``."""
    u, total, last = rng.random(), 0.0, 0
    for i, probability in enumerate(probabilities):
        total += probability
        if probability > 0.0:
            last = i
            if u < total:
                return i
    return last


def draw_size(rng: np.random.Generator, rule: ObjectRule) -> tuple[float, float, float]:
    """Return (depth, width, height) in metres drawn from the rule's mixture."""
    mode = rule.sizes[draw_index(rng, [mode.probability for mode in rule.sizes])]
    depth, width, height = (draw_truncated_normal(rng, *axis) for axis in zip(mode.mean_m, mode.sd_m, rule.low_m, rule.high_m, strict=True))
    return depth, width, height


def draw_height(rng: np.random.Generator, rule: ObjectRule) -> tuple[float, float]:
    """Return the height in metres of the middle of an object that hangs on a wall, and its log-density.

    Raises:
        ValueError: nothing of the rule hangs on a wall.
    """
    normal = rule.centre_height_m
    if normal is None:
        raise ValueError("rule: expected one with centre_height_m, got none")
    if not rule.heights:
        return draw_with_log_density(rng, normal)
    mode = rule.heights[draw_index(rng, [mode.probability for mode in rule.heights])]
    value = draw_truncated_normal(rng, mode.mean_m, mode.sd_m, normal.low, normal.high)
    logs = [
        math.log(mode.probability) + truncated_normal_log_density(value, mode.mean_m, mode.sd_m, normal.low, normal.high)
        for mode in rule.heights
        if mode.probability > 0.0
    ]
    return value, float(np.logaddexp.reduce(logs))


def size_log_density(size_m: Sequence[float], rule: ObjectRule, axes: Sequence[int] = (0, 1, 2)) -> float:
    """Return the log-density of a size under the rule's mixture, along some of its axes."""
    logs = []
    for mode in rule.sizes:
        if mode.probability > 0.0:
            all_axes = list(zip(size_m, mode.mean_m, mode.sd_m, rule.low_m, rule.high_m, strict=True))
            logs.append(math.log(mode.probability) + sum(truncated_normal_log_density(*all_axes[k]) for k in axes))
    return float(np.logaddexp.reduce(logs))
