"""Metrics, tasks and measurements.

A task measures one frame (a trajectory: one room) into tallies: what is kept of it so that the metrics of any set of frames can be computed
without the images.  Tallies of dense tasks are sums, those of average precision are lists of matches.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Truth = Mapping[str, Any]
"""What is true of a frame by layer name: "depth" (h, w) m, "semantic" (h, w) class ids, and so on; docs/metrics.md lists them by task."""

Tally = Any
"""What is kept of one frame, or of one group of its pixels; only its task's tallying looks into it."""

COVERAGE = "coverage"
"""Metric of every task: the share of the truth that the estimate says anything about."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """A number that says how good estimates are: its name, unit ("" for a share or a plain number), and which way is better."""

    name: str
    unit: str = ""
    better: Literal["lower", "higher"] = "lower"
    source: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tallying:
    """How tallies become metrics.

    Attributes:
        merge: makes one tally of several, so that a whole room takes as little memory as a frame.
        finish: (n tallies, (draws, n) float64 weights) -> (draws, metrics) float64, NaN where a metric is undefined.  The weight says how
            often the tally counts; a resampled set of rooms is one row of weights.
    """

    merge: Callable[[Sequence[Tally]], Tally]
    finish: Callable[[Sequence[Tally], NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measurement:
    """What is kept of one frame, or of several merged: the whole, and its parts by true class id and by index of the distance bin."""

    whole: Tally
    by_class: Mapping[int, Tally]
    by_distance: Mapping[int, Tally]


Breakdown = Literal["class", "distance"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """Something that an algorithm estimates, and how it is judged.

    Attributes:
        name: key in ``TASKS``, and of what an algorithm returns.
        truth: layers of the truth that ``measure`` needs; "semantic" and "depth" besides give the parts by class and by distance.
        beside: further layers that say more where the truth has them.
        estimate: what ``measure`` takes, in words.
        metrics: in the order of their columns; one is ``COVERAGE``.
        measure: (truth, estimate) -> measurement of one frame.  Raises ``EvaluationError`` where shapes or types do not fit.
        tallying: how measurements become metrics.
        whole_rooms: whether truth and estimate are those of a whole room instead of one frame.
    """

    name: str
    truth: tuple[str, ...]
    estimate: str
    metrics: tuple[Metric, ...]
    measure: Callable[[Truth, Any], Measurement]
    tallying: Tallying
    whole_rooms: bool = False
    beside: tuple[str, ...] = ()

    def merge(self, measurements: Sequence[Measurement]) -> Measurement:
        """Return one measurement that counts as all of these together."""
        return Measurement(
            whole=self.tallying.merge([measurement.whole for measurement in measurements]),
            by_class=self._merge_parts([measurement.by_class for measurement in measurements]),
            by_distance=self._merge_parts([measurement.by_distance for measurement in measurements]),
        )

    def _merge_parts(self, parts: Sequence[Mapping[int, Tally]]) -> dict[int, Tally]:
        keys = sorted({key for part in parts for key in part})
        return {key: self.tallying.merge([part[key] for part in parts if key in part]) for key in keys}

    def score(self, measurements: Sequence[Measurement]) -> dict[str, float]:
        """Return metric name -> value over these frames; NaN where it is undefined, as without any valid pixel."""
        return self.score_tallies([measurement.whole for measurement in measurements])

    def score_by(self, measurements: Sequence[Measurement], by: Breakdown) -> dict[int, dict[str, float]]:
        """Return class id, or index of the distance bin, -> metric name -> value over these frames."""
        merged = self._merge_parts([parts_of(measurement, by) for measurement in measurements])
        return {key: self.score_tallies([tally]) for key, tally in merged.items()}

    def score_tallies(self, tallies: Sequence[Tally]) -> dict[str, float]:
        """Return metric name -> value of tallies, each counted once."""
        if not tallies:
            return {metric.name: float("nan") for metric in self.metrics}
        values = self.tallying.finish(tallies, np.ones((1, len(tallies))))[0]
        return {metric.name: float(value) for metric, value in zip(self.metrics, values, strict=True)}


def parts_of(measurement: Measurement, by: Breakdown) -> Mapping[int, Tally]:
    """Return the parts of a measurement: class id, or index of the distance bin, -> tally."""
    return measurement.by_class if by == "class" else measurement.by_distance
