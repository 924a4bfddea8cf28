"""Small mixtures for places and gaps, of components that fall off exponentially, as the absolute differences in the energy do.

They are fitted by expectation maximisation, with the number of components, one to three, that the Bayesian information criterion prefers
(Schwarz, Annals of Statistics 1978).  Places have two dimensions and the density ``exp(-r / b) / (2 pi b^2)`` at the distance r from the
middle.  Gaps have one dimension and are truncated at zero, where the wall is; what is flush with the wall is as narrow a component as the
data makes it, all others are at least as wide as places are recorded.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Bools, Floats

_MOST_COMPONENTS = 3
_LEAST_OF_ONE = 3.0
"""Least number of observations in a component, where there is more than one component."""

_LEAST_FENCED, _LEAST_QUARTILES_M = 4, 0.02

_ROUNDS, _CONVERGED = 40, 1e-7
_GRID = 13

FLUSH_M = 0.00025
"""Least length scale of what is flush with a wall: recorded to 1 mm, it stands within half of that."""

_FLUSH_MIDDLE_M = 0.001


class Component(NamedTuple):
    """A component: share, middle (one or two numbers), and length scale b, all lengths in metres."""

    share: float
    middle: tuple[float, ...]
    scale: float


def gap_mixture(gaps: Sequence[float], least_scale: float) -> list[Component]:
    """Return components ``exp(-|g - m| / b)`` of gaps, truncated at zero; negative gaps count as zero."""
    data = np.maximum(np.asarray(gaps, np.float64), 0.0)
    far = _far(data)
    near = _best(data[~far, None], least_scale, _truncated_component, _truncated_log_density, 3)
    share = float(far.mean())
    apart = [Component(share, (0.0,), float(data[far].mean()))] if share else []
    return [part._replace(share=part.share * (1.0 - share)) for part in near] + apart


def _far(gaps: Floats) -> Bools:
    """Return which gaps are so far from all others, and so few, that they would only widen the component that they fell into.

    That is beyond the outer fence of Tukey (*Exploratory Data Analysis*, 1977), with the distance of the quartiles 2 cm at least.  They get
    a component of their own, which falls off from the wall.
    """
    quarter, three_quarters = np.quantile(gaps, (0.25, 0.75))
    far = gaps > three_quarters + 3.0 * max(three_quarters - quarter, _LEAST_QUARTILES_M)
    return np.asarray(far if _LEAST_FENCED <= len(gaps) and far.sum() < _LEAST_OF_ONE else np.zeros(len(gaps), bool))


def place_mixture(places: Sequence[tuple[float, float]], least_scale: float) -> list[Component]:
    """Return components of places in a plane that fall off with the distance from their middles."""
    return _best(np.asarray(places, np.float64), least_scale, _round_component, _round_log_density, 4)


_Fit = Callable[[Floats, Floats, float], tuple[Floats, float]]
_LogDensity = Callable[[Floats, Floats, float], Floats]


def _best(data: Floats, least_scale: float, fit: _Fit, log_density: _LogDensity, parameters: int) -> list[Component]:
    best: tuple[float, list[Component]] | None = None
    for count in range(1, _MOST_COMPONENTS + 1):
        if count > 1 and len(data) < _LEAST_OF_ONE * count:
            break
        components, log_likelihood = _maximised(data, count, least_scale, fit, log_density)
        criterion = (parameters * count - 1) * math.log(len(data)) - 2.0 * log_likelihood
        enough = count == 1 or min(part.share for part in components) * len(data) >= _LEAST_OF_ONE - 0.5
        if enough and (best is None or criterion < best[0] - 1e-9):
            best = criterion, components
    if best is None:
        raise ValueError("data: expected at least one observation, got none")
    return best[1]


def _maximised(data: Floats, count: int, least: float, fit: _Fit, log_density: _LogDensity) -> tuple[list[Component], float]:
    """Run the expectation maximisation from equal shares of the data along the axis of its greatest extent."""
    axis = int(np.argmax(np.ptp(data, axis=0)))
    rank = np.argsort(np.argsort(data[:, axis], kind="stable"), kind="stable")
    weights = (rank * count // len(data))[None] == np.arange(count)[:, None]
    responsibility = np.where(weights, 1.0, 0.0)
    parts: list[tuple[float, Floats, float]] = []
    total = np.zeros(len(data))
    for _ in range(_ROUNDS):
        parts = [(float(row.mean()), *fit(data, row, least)) for row in responsibility]
        logs = np.array([math.log(max(share, 1e-12)) + log_density(data, middle, scale) for share, middle, scale in parts])
        total = np.logaddexp.reduce(logs, axis=0)
        before, responsibility = responsibility, np.exp(logs - total)
        if float(np.abs(responsibility - before).max()) < _CONVERGED:
            break
    components = [Component(share, tuple(middle.tolist()), scale) for share, middle, scale in parts]
    return components, float(total.sum())


def _weighted_median(values: Floats, weights: Floats) -> float:
    order = np.argsort(values, kind="stable")
    mass = np.cumsum(weights[order])
    return float(values[order][min(int(np.searchsorted(mass, 0.5 * mass[-1])), len(values) - 1)])


def _round_component(data: Floats, weights: Floats, least: float) -> tuple[Floats, float]:
    middle = np.array([_weighted_median(column, weights) for column in data.T])
    distance = np.linalg.norm(data - middle, axis=1)
    return middle, max(0.5 * float(weights @ distance) / max(float(weights.sum()), 1e-12), least)


def _round_log_density(data: Floats, middle: Floats, scale: float) -> Floats:
    return np.asarray(-np.linalg.norm(data - middle, axis=1) / scale - math.log(2.0 * math.pi * scale * scale))


def _truncated_component(data: Floats, weights: Floats, least: float) -> tuple[Floats, float]:
    """Return the middle and scale of greatest likelihood; near zero the truncation matters, and a grid is searched."""
    median = _weighted_median(data[:, 0], weights)
    mass = max(float(weights.sum()), 1e-12)
    scale = max(float(weights @ np.abs(data[:, 0] - median)) / mass, least)
    if median < _FLUSH_MIDDLE_M:
        scale = max(float(weights @ np.abs(data[:, 0] - median)) / mass, FLUSH_M)
        least = FLUSH_M
    if median > 3.0 * scale:
        return np.array([median]), scale
    best = (-math.inf, median, scale)
    for middle in np.linspace(0.0, median, _GRID) if median > 0.0 else np.zeros(1):
        for tried in np.maximum(scale * np.geomspace(0.5, 2.0, _GRID), least):
            score = float(weights @ _truncated_log_density(data, np.array([middle]), float(tried)))
            if score > best[0]:
                best = (score, float(middle), float(tried))
    return np.array([best[1]]), best[2]


def _truncated_log_density(data: Floats, middle: Floats, scale: float) -> Floats:
    norm = scale * (2.0 - math.exp(-float(middle[0]) / scale))
    return np.asarray(-np.abs(data[:, 0] - middle[0]) / scale - math.log(norm))
