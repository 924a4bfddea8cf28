"""Whether an algorithm has become worse: a new evaluation beside a baseline, metric by metric, over the frames that both judged.

Rooms are the sample, few or many.  The difference of a metric is the mean, over the frames in which both have a value, of new minus
baseline; its interval is that of Student's t over rooms (of the ratio of the rooms' sums and counts, linearised).  Besides, each room, each
room type and each value of a factor is looked at by itself: is it worse than the others by more than they scatter (the two-sample t test of
the rooms' means, and of their logarithms where all are positive)?  All metrics together err with 2.5 % at most, and all such groups with as
much: the level of each is raised by their number (Bonferroni).

An algorithm that computes the same every time has differences of exactly zero, which are the same; one that is worse by the same amount in
every room has an interval of no width. Differences that do not matter (``RELEVANT``) are the same, however sure. Where neither a change nor
sameness is shown, as of a single room, a metric is unsure, and passes. Values that a baseline has and the new evaluation lacks are losses,
and fail the gate.
"""

import dataclasses
import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from evaluation.core.errors import EvaluationError
from evaluation.evaluation_file import Evaluation, FrameKey, FrameRow, MetricRow, TruthRecord

FALSE_ALARMS = 0.05
"""Share of comparisons of equals that may fail, all metrics and groups together; half of it is for the whole, half for groups."""
POWER = 0.8
"""How often a difference is seen that is as large as the detectable one."""
RELEVANT: Mapping[str, float] = {"": 1e-4, "m": 1e-4, "deg": 0.01, "px": 0.01}
"""Unit -> least difference that matters; of other units every one does."""
ROUNDING = 1e-9
"""Differences below this share of the values themselves, or of 0.001, are those of rounding, and count as zero."""
Floats = NDArray[np.float64]
Word = Literal["worse", "better", "same", "unsure", "unproved"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """How one metric changed.

    ``baseline`` and ``new`` are its means over the frames in which both have a value, ``difference`` is new minus baseline, ``low`` and
    ``high`` its interval, infinite where there is one room only.  ``detectable`` is the difference that is seen four times of five with
    rooms that scatter as these do.  ``same`` is what lies within what matters, or within an equivalence that was asked for; ``unproved``
    what does not where one was, ``unsure`` where none was.
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
    detectable: float
    rooms: int
    verdict: Word


class Group(NamedTuple):
    """Rooms, a room type or a value of a factor in which a metric is worse by more than the others scatter, and its means there."""

    task: str
    metric: str
    unit: str
    where: str
    baseline: float
    new: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GateReport:
    """What the gate says of all metrics that both evaluations have, of groups of rooms, and in one line each what the new one has lost."""

    verdicts: tuple[Verdict, ...]
    groups: tuple[Group, ...]
    losses: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing is worse, nothing is lost and nothing that was to be proved the same is unproved."""
        return not self.losses and not self.groups and all(one.verdict in ("same", "better", "unsure") for one in self.verdicts)


class _FrameId(NamedTuple):
    """What makes two rows those of one frame, wherever its bag lies."""

    variant: str | None
    room_type: str
    seed: int
    room: int
    frame: int
    stamp_ns: int


class _Pair(NamedTuple):
    """A metric in one frame in which both have a value."""

    frame: _FrameId
    factors: Mapping[str, object]
    baseline: float
    new: float

    @property
    def room(self) -> tuple[str, int, int]:
        """The room that the frame shows: its type, the run's seed, its number."""
        return self.frame.room_type, self.frame.seed, self.frame.room


def compare(baseline: Evaluation, new: Evaluation, *, equivalence: float | None = None) -> GateReport:
    """Compare an evaluation with a baseline.

    Args:
        baseline: the older one.
        new: the newer one.
        equivalence: ask for proof that no metric changed by more than this share of its baseline, by two one-sided tests each
            (Schuirmann 1987), instead of for lack of proof that one did.

    Raises:
        EvaluationError: the two judged by another truth or other frames, or a metric means another thing in each.
    """
    _check_truth(baseline.truth, new.truth)
    old_rows, new_rows = _by_task(baseline, "baseline"), _by_task(new, "new evaluation")
    _check_frames(old_rows, new_rows)
    metrics = _common_metrics(baseline, new)
    losses: list[str] = []
    pairs: list[tuple[str, MetricRow, list[_Pair]]] = []
    for task, rows in old_rows.items():
        if task not in new_rows:
            losses.append(f"{task}: the baseline has this task, the new evaluation has not")
            continue
        lost = sum(_lost(row, new_rows[task].get(frame)) for frame, row in rows.items())
        if lost:
            losses.append(f"{task}: {lost} of {len(rows)} frames that the baseline has values for have none")
        for metric in metrics[task]:
            pairs.append((task, metric, _paired(rows, new_rows[task], metric.name)))
            gone = _gone(rows, new_rows[task], metric.name)
            if gone and not lost:
                losses.append(f"{task}: {metric.name} has no value in {gone} of {len(rows)} frames that the baseline has one for")
    pairs = [(task, metric, found) for task, metric, found in pairs if found]
    alone = 0.5 * FALSE_ALARMS / max(1, len(pairs))
    verdicts = tuple(_verdict(task, metric, found, alone, equivalence) for task, metric, found in pairs)
    tests = [(task, metric, test) for task, metric, found in pairs for test in _tests(metric, found)]
    limit = 0.5 * FALSE_ALARMS / max(1, len(tests))
    groups = tuple(
        Group(task, metric.name, metric.unit, test.where, test.baseline, test.new)
        for task, metric, test in tests
        if test.chance <= limit and _matters(metric, test.new - test.baseline)
    )
    return GateReport(verdicts=verdicts, groups=groups, losses=tuple(losses))


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


def _check_truth(old: TruthRecord | None, new: TruthRecord | None) -> None:
    """Refuse another camera, other classes or another run than the baseline's; what one of the two does not tell is not compared."""
    for fact in (field.name for field in dataclasses.fields(TruthRecord)) if old is not None and new is not None else ():
        before, after = getattr(old, fact), getattr(new, fact)
        if before is not None and after is not None and before != after:
            expected, got = (", ".join(map(str, value)) if isinstance(value, tuple) else str(value) for value in (before, after))
            advice = "judge by the baseline's truth, or make a new baseline"
            raise EvaluationError(f"truth: expected the baseline's {fact.replace('_', ' ')} {expected}, got {got}; {advice}")


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


def _paired(old: Mapping[_FrameId, FrameRow], new: Mapping[_FrameId, FrameRow], metric: str) -> list[_Pair]:
    found = []
    for frame, row in old.items():
        before = row.metrics[metric]
        after = new[frame].metrics.get(metric) if frame in new else None
        if before is not None and after is not None:
            same = abs(after - before) <= ROUNDING * max(abs(after), abs(before), 1e-3)
            found.append(_Pair(frame, row.key.factors, before, before if same else after))
    return found


def _matters(metric: MetricRow, difference: float) -> bool:
    """Return whether a difference is for the worse, and large enough to matter."""
    return (difference if metric.better == "lower" else -difference) > RELEVANT.get(metric.unit, 0.0)


def _verdict(task: str, metric: MetricRow, pairs: list[_Pair], alone: float, equivalence: float | None) -> Verdict:
    rooms: dict[tuple[str, int, int], list[float]] = defaultdict(list)
    for pair in pairs:
        rooms[pair.room].append(pair.new - pair.baseline)
    sums, counts = np.array([sum(values) for values in rooms.values()]), np.array([len(values) for values in rooms.values()])
    difference = float(sums.sum() / counts.sum())
    error = ratio_error(sums, counts)
    reach = reach_of(error, 1.0 - 0.5 * alone, len(rooms))
    low, high = difference - reach, difference + reach
    before = float(np.mean([pair.baseline for pair in pairs]))
    matters = RELEVANT.get(metric.unit, 0.0)
    farthest = abs(difference) + reach_of(error, 1.0 - alone, len(rooms))
    verdict: Word = "unsure" if equivalence is None else "unproved"
    if (low > 0.0 or high < 0.0) and abs(difference) > matters:
        verdict = "worse" if (low > 0.0) == (metric.better == "lower") else "better"
    elif farthest <= max(matters, (equivalence or 0.0) * abs(before)):
        verdict = "same"
    return Verdict(
        task=task,
        metric=metric.name,
        unit=metric.unit,
        better=metric.better,
        baseline=before,
        new=float(np.mean([pair.new for pair in pairs])),
        difference=difference,
        low=low,
        high=high,
        detectable=reach + reach_of(error, POWER, len(rooms)),
        rooms=len(rooms),
        verdict=verdict,
    )


def reach_of(error: float, share: float, rooms: int) -> float:
    """Return a standard error times the quantile of Student's t for so many rooms: 0 of none, infinite for one room."""
    if error == 0.0:
        return 0.0
    return error * float(stdtrit(rooms - 1, share)) if rooms > 1 else math.inf


def ratio_error(sums: Floats, counts: NDArray[np.int64]) -> float:
    """Return the standard error of the mean difference of rooms with (rooms,) sums of so many differences, by its linear approximation.

    Differences that are all the same have none.  That of a single room which is not zero is not known, and counts as 1.
    """
    if len(sums) == 1:
        return float(sums.any())
    mean = sums.sum() / counts.sum()
    if np.ptp(sums / counts) <= ROUNDING * np.abs(sums / counts).max():
        return 0.0
    apart = (sums - mean * counts) / counts.mean()
    return float(np.sqrt((apart**2).sum() / (len(sums) - 1) / len(sums)))


class _Test(NamedTuple):
    """A group of rooms, the means of a metric in it, and the chance that it is so much worse than the others if it is as they are."""

    where: str
    baseline: float
    new: float
    chance: float


def _tests(metric: MetricRow, pairs: list[_Pair]) -> Iterator[_Test]:
    """Yield the test of each room, room type and value of a factor beside the others."""
    rooms: dict[tuple[str, int, int], list[_Pair]] = defaultdict(list)
    for pair in pairs:
        rooms[pair.room].append(pair)
    changes = _changes(metric, list(rooms.values()))
    types = {room[0] for room in rooms}
    for name in sorted(types) if len(types) > 1 else ():
        inside = np.array([room[0] == name for room in rooms])
        chosen = [pair for pair in pairs if pair.frame.room_type == name]
        yield _test(name, chosen, [(change[inside], change[~inside]) for change in changes])
    for k, (room, chosen) in enumerate(rooms.items() if len(rooms) > 1 else ()):
        yield _test(f"{room[0]} {room[2]} (seed {room[1]})", chosen, [(change[k : k + 1], np.delete(change, k)) for change in changes])
    for factor in dict.fromkeys(name for pair in pairs for name in pair.factors):
        for value in dict.fromkeys(pair.factors.get(factor) for pair in pairs):
            halves = [
                [[pair for pair in room if (pair.factors.get(factor) == value) == has] for has in (True, False)] for room in rooms.values()
            ]
            both = [half for half in halves if half[0] and half[1]]
            if both:
                with_value, without = (_changes(metric, [half[side] for half in both]) for side in (0, 1))
                apart = [(a - b, np.zeros(0)) for a, b in zip(with_value, without, strict=False)]
                yield _test(f"{factor} {value}", [pair for half in both for pair in half[0]], apart)


def _test(where: str, pairs: list[_Pair], samples: list[tuple[Floats, Floats]]) -> _Test:
    """Return the test of a group: however a change is measured, the group has to stand out."""
    chance = max(group_chance(inside, outside) for inside, outside in samples)
    return _Test(where, float(np.mean([pair.baseline for pair in pairs])), float(np.mean([pair.new for pair in pairs])), chance)


def _changes(metric: MetricRow, rooms: list[list[_Pair]]) -> list[Floats]:
    """Return (rooms,) how much worse a metric is in each room: the difference of the means and, of positive ones, of their logarithms.

    Noise that grows with the error lets rooms with large errors stand out in the one, other noise those with small ones in the other.
    """
    before, after = (np.array([np.mean([getattr(pair, side) for pair in room]) for room in rooms]) for side in ("baseline", "new"))
    sign = 1.0 if metric.better == "lower" else -1.0
    changes = [sign * (after - before)]
    return [*changes, sign * np.log(after / before)] if min(before.min(), after.min()) > 0.0 else changes


def group_chance(inside: Floats, outside: Floats) -> float:
    """Return the chance of a mean so far above that of the others, or above zero, by the two-sample t test with one variance."""
    apart = float(inside.mean() - (outside.mean() if len(outside) else 0.0))
    samples = [sample for sample in (inside, outside) if len(sample)]
    freedom = sum(len(sample) - 1 for sample in samples)
    if apart <= 0.0 or freedom < 1:
        return 1.0
    variance = sum(float(((sample - sample.mean()) ** 2).sum()) for sample in samples) / freedom
    error = math.sqrt(variance * sum(1.0 / len(sample) for sample in samples))
    return float(stdtr(freedom, -apart / error)) if error > ROUNDING * apart else 0.0


def gate_table(report: GateReport) -> str:
    """Return what a terminal shows, in lines: what is lost, groups that are worse, then every metric, and how many are what."""
    shown = [f"lost      {loss}" for loss in report.losses]
    for group in report.groups:
        unit = f" {group.unit}" if group.unit else ""
        shown.append(
            f"worse     {group.task}.{group.metric} in {group.where}: {group.baseline:.4g} -> {group.new:.4g}{unit}, others are not"
        )
    for verdict in report.verdicts:
        unit = f" {verdict.unit}" if verdict.unit else ""
        change = f"{verdict.task}.{verdict.metric}: {verdict.baseline:.4g} -> {verdict.new:.4g}{unit}"
        if math.isinf(verdict.high):
            shown.append(f"unsure    {change}; one room tells nothing of the spread")
            continue
        interval = f"{verdict.difference:+.3g} [{verdict.low:+.3g}, {verdict.high:+.3g}]"
        shown.append(f"{verdict.verdict:<9} {change}, {interval} over {verdict.rooms} rooms, detectable {verdict.detectable:.2g}")
    counts = Counter(verdict.verdict for verdict in report.verdicts)
    told = f"{len(report.verdicts)} metrics: {', '.join(f'{counts[word]} {word}' for word in get_args(Word) if counts[word])}"
    return "\n".join([*shown, f"{told}; {len(report.groups)} worse in one room, room type or value" if report.groups else told])
