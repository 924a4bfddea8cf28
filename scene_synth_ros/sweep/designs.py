"""Designs of experiments: which values of the factors make the variants of a base room."""

import itertools
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.sweep.sweep_file import DesignName, Span, SweepFactor, SweepSpec

Point = Mapping[str, object]
"""Name of a factor -> its value; factors that are not there have the value of the base room."""

_DIGITS = 6
"""Significant digits of the values of ranges, which people read."""


def design_points(spec: SweepSpec) -> list[Point]:
    """Return the points of a sweep's design, the same for every base room.

    grid: every combination of the values; one_at_a_time: the base room, then each factor's values with the others as they are;
    latin_hypercube: ``samples`` points of which every ``samples``-th part of each factor's range holds one (McKay, Beckman and Conover,
    Technometrics 1979), by ``scipy.stats.qmc``.
    """
    return _DESIGNS[spec.design](spec)


def _grid(spec: SweepSpec) -> list[Point]:
    names = [factor.name for factor in spec.factors]
    return [dict(zip(names, values, strict=True)) for values in itertools.product(*map(listed_values, spec.factors))]


def _one_at_a_time(spec: SweepSpec) -> list[Point]:
    return [{}, *({factor.name: value} for factor in spec.factors for value in listed_values(factor))]


def _latin_hypercube(spec: SweepSpec) -> list[Point]:
    from scipy.stats import qmc  # half a second, which the other designs do not need

    sampler = qmc.LatinHypercube(len(spec.factors), seed=np.random.default_rng(spec.seed))
    shares: NDArray[np.float64] = sampler.random(spec.samples)
    return [{factor.name: _at(factor, float(share)) for factor, share in zip(spec.factors, row, strict=True)} for row in shares]


_DESIGNS: dict[DesignName, Callable[[SweepSpec], list[Point]]] = {
    "grid": _grid,
    "one_at_a_time": _one_at_a_time,
    "latin_hypercube": _latin_hypercube,
}


def listed_values(factor: SweepFactor) -> tuple[object, ...]:
    """Return a factor's values: its list, or so many steps through its range."""
    if factor.span is None:
        return factor.values
    return tuple(_at(factor, share) for share in np.linspace(0.0, 1.0, factor.spec.steps).tolist())


def _at(factor: SweepFactor, share: float) -> object:
    """Return the value at a share, 0 to 1, of the factor's range, or of its list."""
    if factor.span is None:
        return factor.values[min(int(share * len(factor.values)), len(factor.values) - 1)]
    return _rounded(_between(factor.span, share, factor.spec.scale))


def _between(span: Span, share: float, scale: str) -> float:
    if scale == "log":
        return float(span.low * (span.high / span.low) ** share)
    return span.low + share * (span.high - span.low)


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
