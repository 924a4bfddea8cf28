"""Whether an algorithm has become worse: a new evaluation beside a baseline, metric by metric, over the frames that both judged.

The difference of a metric is the mean, over the frames in which both have a value, of new minus baseline.  Its interval comes from a paired
bootstrap: whole rooms are drawn again, or frames where there are fewer than ``FEWEST_ROOMS``, and the differences move together.  It
is the difference plus and minus t times the standard deviation over the draws, with Student's t for the number of rooms (Hesterberg, The
American Statistician 2015, "t interval with bootstrap standard error": percentiles are too narrow for few rooms).  All metrics together
err with 5 % at most: the level of each is raised by their number (Bonferroni).  A difference is real where its interval leaves out zero.

An algorithm that computes the same every time has differences of exactly zero, which are the same; one that is worse by the same amount
in every room has an interval of no width.  A single difference, as of the poses of one room, cannot be judged and passes.  Values that a
baseline has and the new evaluation lacks are losses, and fail the gate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from evaluation.confidence import resampling_weights
from evaluation.core.errors import EvaluationError
from evaluation.evaluation_file import Evaluation, FrameKey, FrameRow, MetricRow

DRAWS = 2000
LEVEL = 0.95
FEWEST_ROOMS = 10
ROUNDING = 1e-9
"""Differences below this share of the values themselves, or of 0.001, are those of rounding, and count as zero."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """How one metric changed.

    ``baseline`` and ``new`` are its means over the frames in which both have a value, ``difference`` is new minus baseline, ``low`` and
    ``high`` its interval, infinite where there is one room or frame only; ``units`` says over how many rooms or frames.
    """

    task: str
    metric: str
    unit: str
    better: Literal["lower", "higher"]
    baseline: float
    new: float
    difference: float
    low: float
    high: float
    units: str
    verdict: Literal["worse", "better", "same"]


@dataclass(frozen=True, slots=True, kw_only=True)
class GateReport:
    """What the gate says of all metrics that both evaluations have, and in one line each what the new one has lost."""

    verdicts: tuple[Verdict, ...]
    losses: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing is worse and nothing is lost."""
        return not self.losses and all(verdict.verdict != "worse" for verdict in self.verdicts)


class _FrameId(NamedTuple):
    """What makes two rows those of one frame, wherever its bag lies."""

    variant: str | None
    room_type: str
    seed: int
    room: int
    frame: int
    stamp_ns: int


class _Pairs(NamedTuple):
    """A metric in the frames in which both have a value: (n,) each, and the number of the room."""

    baseline: NDArray[np.float64]
    new: NDArray[np.float64]
    rooms: NDArray[np.int64]


def compare(baseline: Evaluation, new: Evaluation, *, seed: int = 0, draws: int = DRAWS, level: float = LEVEL) -> GateReport:
    """Compare an evaluation with a baseline.

    Raises:
        EvaluationError: the two judged other frames, or a metric means another thing in each.
    """
    old_rows, new_rows = _by_task(baseline, "baseline"), _by_task(new, "new evaluation")
    _check_frames(old_rows, new_rows)
    metrics = _common_metrics(baseline, new)
    losses: list[str] = []
    pairs: dict[tuple[str, str], _Pairs] = {}
    for task, rows in old_rows.items():
        if task not in new_rows:
            losses.append(f"{task}: the baseline has this task, the new evaluation has not")
            continue
        lost = sum(_lost(row, new_rows[task].get(frame)) for frame, row in rows.items())
        if lost:
            losses.append(f"{task}: {lost} of {len(rows)} frames that the baseline has values for have none")
        for metric in metrics[task]:
            pairs[task, metric.name] = _paired(rows, new_rows[task], metric.name)
            gone = _gone(rows, new_rows[task], metric.name)
            if gone and not lost:
                losses.append(f"{task}: {metric.name} has no value in {gone} of {len(rows)} frames that the baseline has one for")
    tested = max(1, sum(len(found.new) > 0 for found in pairs.values()))
    alone = 1.0 - (1.0 - level) / tested
    rows_of = {(task, metric.name): metric for task in metrics for metric in metrics[task]}
    verdicts = [
        _verdict(task, rows_of[task, name], found, seed=seed, draws=draws, level=alone)
        for (task, name), found in pairs.items()
        if len(found.new)
    ]
    return GateReport(verdicts=tuple(verdicts), losses=tuple(losses))


def _by_task(evaluation: Evaluation, whose: str) -> dict[str, dict[_FrameId, FrameRow]]:
    tasks: dict[str, dict[_FrameId, FrameRow]] = {task.name: {} for task in evaluation.tasks}
    for row in evaluation.frames:
        frame = _frame_id(row.key)
        if frame in tasks[row.task]:
            raise EvaluationError(f"{whose}: expected each frame once in {row.task}, got {_told(frame)} twice; evaluate it again")
        tasks[row.task][frame] = row
    return {task: rows for task, rows in tasks.items() if rows}


def _frame_id(key: FrameKey) -> _FrameId:
    return _FrameId(key.variant, key.room_type, key.seed, key.room, key.frame, key.stamp_ns)


def _told(frame: _FrameId) -> str:
    variant = f"variant {frame.variant}, " if frame.variant is not None else ""
    return f"frame {frame.frame} at {frame.stamp_ns} ns of {variant}{frame.room_type} {frame.room} (seed {frame.seed})"


def _check_frames(old: Mapping[str, Mapping[_FrameId, FrameRow]], new: Mapping[str, Mapping[_FrameId, FrameRow]]) -> None:
    """Refuse evaluations of other frames: fewer are a loss, others are no comparison."""
    for task in (task for task in old if task in new):
        only_old, only_new = old[task].keys() - new[task].keys(), new[task].keys() - old[task].keys()
        if only_old and only_new:
            counts = f"{len(only_old)} of the baseline's {len(old[task])} are missing and {len(only_new)} others are there"
            example = f"the baseline has {_told(min(only_old, key=str))}, the new evaluation {_told(min(only_new, key=str))}"
            raise EvaluationError(f"{task}: expected the frames of the baseline, got others: {counts}; {example}; make a new baseline")


def _common_metrics(baseline: Evaluation, new: Evaluation) -> dict[str, list[MetricRow]]:
    """Return task -> the baseline's metrics.  A metric that the new evaluation lacks shows as one without values."""
    new_tasks = {task.name: {metric.name: metric for metric in task.metrics} for task in new.tasks}
    for task in baseline.tasks:
        for metric in task.metrics:
            other = new_tasks.get(task.name, {}).get(metric.name, metric)
            if other != metric:
                expected, got = f"unit {metric.unit!r}, {metric.better} is better", f"unit {other.unit!r}, {other.better} is better"
                raise EvaluationError(f"{task.name}.{metric.name}: expected the baseline's {expected}, got {got}; make a new baseline")
    return {task.name: list(task.metrics) for task in baseline.tasks}


def _lost(old: FrameRow, new: FrameRow | None) -> bool:
    """Return whether a frame that had values has none at all now."""
    had = any(value is not None for value in old.metrics.values())
    return had and (new is None or all(value is None for value in new.metrics.values()))


def _gone(old: Mapping[_FrameId, FrameRow], new: Mapping[_FrameId, FrameRow], metric: str) -> int:
    values = [(row.metrics[metric], new[frame].metrics.get(metric)) for frame, row in old.items() if frame in new]
    return sum(before is not None and after is None for before, after in values)


def _paired(old: Mapping[_FrameId, FrameRow], new: Mapping[_FrameId, FrameRow], metric: str) -> _Pairs:
    found = []
    rooms: dict[tuple[str, int, int], int] = {}
    for frame, row in old.items():
        before = row.metrics[metric]
        after = new[frame].metrics.get(metric) if frame in new else None
        if before is not None and after is not None:
            found.append((before, after, rooms.setdefault((frame.room_type, frame.seed, frame.room), len(rooms))))
    table = np.array(found, np.float64).reshape(-1, 3)
    return _Pairs(table[:, 0], table[:, 1], table[:, 2].astype(np.int64))


def _verdict(task: str, metric: MetricRow, pairs: _Pairs, *, seed: int, draws: int, level: float) -> Verdict:
    differences = pairs.new - pairs.baseline
    scale = np.maximum(np.abs(pairs.new), np.abs(pairs.baseline))
    differences[np.abs(differences) <= ROUNDING * np.maximum(scale, 1e-3)] = 0.0
    rooms = int(pairs.rooms.max()) + 1
    by_room = rooms >= FEWEST_ROOMS
    units = pairs.rooms if by_room else np.arange(len(differences))
    difference = float(differences.mean())
    spread = half_width(np.bincount(units, differences).astype(np.float64), np.bincount(units), seed=seed, draws=draws, level=level)
    low, high = difference - spread, difference + spread
    worse = high < 0.0 if metric.better == "higher" else low > 0.0
    better = low > 0.0 if metric.better == "higher" else high < 0.0
    return Verdict(
        task=task,
        metric=metric.name,
        unit=metric.unit,
        better=metric.better,
        baseline=float(pairs.baseline.mean()),
        new=float(pairs.new.mean()),
        difference=difference,
        low=low,
        high=high,
        units=f"{units.max() + 1} {'rooms' if by_room else 'frames'}",
        verdict="worse" if worse else "better" if better else "same",
    )


def half_width(sums: NDArray[np.float64], counts: NDArray[np.int64], *, seed: int, draws: int, level: float) -> float:
    """Return half the width of the interval of a mean by the bootstrap: Student's t times the standard deviation over the draws.

    Args:
        sums: (units,) sum of the differences in each room or frame.
        counts: (units,) how many differences it has.
        seed: of the draws.
        draws: how many sets of units are drawn.
        level: of the interval.

    Differences that are all the same have no spread.  A single one that is not zero tells nothing of its spread: the width is infinite.
    """
    count = len(sums)
    if not sums.any():
        return 0.0
    if count == 1:
        return math.inf
    if np.ptp(sums / counts) <= ROUNDING * np.abs(sums / counts).max():
        return 0.0
    weights = resampling_weights(count, draws, seed)
    means = (weights @ sums) / (weights @ counts)
    # The bootstrap divides by the number of units where the unbiased variance divides by one less.
    spread = means.std() * np.sqrt(count / (count - 1))
    return float(stdtrit(count - 1, 0.5 + 0.5 * level) * spread)


def gate_table(report: GateReport) -> str:
    """Return what a terminal shows, in lines: what is lost, every metric that changed or cannot be judged, how many did not change."""
    shown = [f"lost    {loss}" for loss in report.losses]
    for verdict in report.verdicts:
        unit = f" {verdict.unit}" if verdict.unit else ""
        change = f"{verdict.task}.{verdict.metric}: {verdict.baseline:.4g} -> {verdict.new:.4g}{unit}"
        if math.isinf(verdict.high):
            shown.append(f"unsure  {change}; one difference tells nothing of its spread")
        elif verdict.verdict != "same":
            interval = f"{verdict.difference:+.3g} [{verdict.low:+.3g}, {verdict.high:+.3g}]"
            shown.append(f"{verdict.verdict:<7} {change}, {interval} over {verdict.units}")
    same = sum(verdict.verdict == "same" for verdict in report.verdicts)
    return "\n".join([*shown, f"same    {same} of {len(report.verdicts)} metrics"])
