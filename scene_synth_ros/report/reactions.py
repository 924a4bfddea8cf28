"""How each metric reacts to each factor, as JSON values of the page: response curves, single variants, and the ranking of the factors."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evaluation.confidence import LEVEL, SCALES, Interval
from evaluation.effects import contrast, room_means, standardised_regression
from evaluation.evaluation_file import Evaluation, FactorValue, SummaryRow, TaskRow
from scene_synth_ros.report.design import Design, Factor, is_number, value_text
from scene_synth_ros.report.samples import Array, Integers, Samples, room_matrix, shown_frames

MOST_DOTS = 300
"""Single variants in a chart."""
DIGITS = 6
Points = list[list[float | None] | None]


class Part(NamedTuple):
    """What a report knows of one task of one evaluation."""

    evaluation: Evaluation
    task: TaskRow
    samples: Samples


def rounded(value: float | None) -> float | None:
    """Return a number with the digits that a page keeps."""
    return None if value is None else float(f"{value:.{DIGITS}g}")


def interval(value: Interval) -> list[float | None]:
    """Return value, low, high."""
    return [rounded(part) for part in (value.value, value.low, value.high)]


def response_curves(part: Part, design: Design, rooms: int) -> dict[str, dict[str, Any]]:
    """Return metric -> factor -> points and dots.

    ``points`` has for each column of the factor the mean over rooms with its interval, and the numbers of rooms and frames, or None;
    ``dots`` has (value, mean of the frames) of single variants where the columns are bins.
    """
    found: dict[str, dict[str, Any]] = {}
    for m, metric in enumerate(part.task.metrics):
        for f, factor in enumerate(design.factors):
            values, counts = _matrix(part.samples, design, f, m, rooms)
            points: Points = [
                None if mean is None else [*interval(mean), int((counts[:, column] > 0).sum()), int(counts[:, column].sum())]
                for column, mean in enumerate(room_means(values, SCALES[metric.better]))
            ]
            if not any(points):
                points = _told(part.evaluation.summary, part.task.name, metric.name, factor)
            if any(points):
                dots = _dots(part.samples, factor, m) if factor.binned else []
                found.setdefault(metric.name, {})[factor.name] = {"points": points, "dots": dots}
    return found


def ranking(part: Part, design: Design, rooms: int) -> dict[str, dict[str, Any]]:
    """Return metric -> rows of factors, the largest effect first, with ``explained``, the share of variance of a regression, else None.

    A row has the factor's name, the effect with its interval, and the columns where the metric is smallest and largest; with a Latin
    hypercube the effect is a standardised regression coefficient, and there are no such columns.
    """
    if design.name == "latin_hypercube":
        return {metric.name: found for m, metric in enumerate(part.task.metrics) if (found := _regression(part, design, m))}
    result = {}
    for m, metric in enumerate(part.task.metrics):
        rows = []
        for f, factor in enumerate(design.factors):
            values, _ = _matrix(part.samples, design, f, m, rooms)
            effect = contrast(values, factor.base, level=_family_level(design, len(part.task.metrics)))
            if effect is not None:
                base = values[:, factor.base][np.isfinite(values[:, factor.base])] if factor.base is not None else np.empty(0)
                rows.append(
                    {
                        "factor": factor.name,
                        "effect": interval(effect.range),
                        "least": factor.columns[effect.least],
                        "most": factor.columns[effect.most],
                        "share": rounded((effect.range.value or 0.0) / abs(float(base.mean()))) if base.size and base.mean() else None,
                    }
                )
        if rows:
            result[metric.name] = {"rows": _sorted(rows), "explained": None}
    return result


def _matrix(samples: Samples, design: Design, factor: int, metric: int, rooms: int) -> tuple[Array, Integers]:
    """Return the mean of each room at each column of a factor, and how many frames it has; rooms without frames are left out."""
    shown = shown_frames(samples, design, factor)
    shape = rooms, len(design.factors[factor].columns)
    values, counts = room_matrix(samples.rooms[shown], samples.columns[shown, factor], samples.values[shown, metric], shape)
    present = counts.any(axis=1)
    return values[present], counts[present]


def _sorted(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(rows, key=lambda row: -abs(row["effect"][0]))


def _family_level(design: Design, metrics: int) -> float:
    """Return the level at which all effects of a task's factors on its metrics hold the truth together (Bonferroni)."""
    return 1.0 - (1.0 - LEVEL) / (len(design.factors) * metrics)


def _regression(part: Part, design: Design, metric: int) -> dict[str, Any] | None:
    samples, level = part.samples, _family_level(design, len(part.task.metrics))
    known = np.isfinite(samples.values[:, metric]) & (samples.columns >= 0).all(axis=1)
    for factor in design.factors:
        known &= [not factor.has_numbers or is_number(values[factor.name]) for values in samples.factors]
    if not known.any():
        return None
    _, first, place = np.unique(samples.variants[known], return_index=True, return_inverse=True)
    counts = np.bincount(place)
    response = np.bincount(place, samples.values[known, metric]) / counts
    chosen = np.flatnonzero(known)[first]
    matrices = [_coding(samples, factor, f, chosen) for f, factor in enumerate(design.factors)]
    fit = standardised_regression(response, matrices, samples.rooms[chosen], level=level)
    if fit is None:
        return None
    rows = [
        {"factor": factor.name, "effect": interval(effect), "least": None, "most": None, "share": None}
        for factor, effect in zip(design.factors, fit.coefficients, strict=True)
    ]
    return {"rows": _sorted(rows), "explained": rounded(fit.r_squared)}


def _coding(samples: Samples, factor: Factor, place: int, chosen: Integers) -> Array:
    """Return a factor's values as columns of a regression: a column of numbers, or one of 0 and 1 for each name but the first."""
    if factor.has_numbers:
        return np.array([[value if is_number(value := samples.factors[k][factor.name]) else np.nan] for k in chosen])
    names: Array = (samples.columns[chosen, place][:, None] == np.arange(1, len(factor.columns))).astype(np.float64)
    return names


def _dots(samples: Samples, factor: Factor, metric: int) -> list[list[float | None]]:
    """Return (value, mean of the frames) of single variants; rooms that have several are brought to the mean of all."""
    known = np.isfinite(samples.values[:, metric])
    _, first, place = np.unique(samples.variants[known], return_index=True, return_inverse=True)
    means = np.bincount(place, samples.values[known, metric]) / np.bincount(place)
    rooms = samples.rooms[known][first]
    sizes = np.bincount(rooms)
    means += means.mean() - (np.bincount(rooms, means) / np.maximum(sizes, 1))[rooms] if sizes.max(initial=0) > 1 else 0.0
    pairs = [(samples.factors[k].get(factor.name), mean) for k, mean in zip(np.flatnonzero(known)[first], means, strict=True)]
    dots = [[rounded(value), rounded(float(mean))] for value, mean in pairs if is_number(value)]
    return dots[:: -(-len(dots) // MOST_DOTS)] if dots else []


def _told(summary: Sequence[SummaryRow], task: str, metric: str, factor: Factor) -> Points:
    """Return the points that the evaluation itself tells, for a metric that single frames do not have."""
    points: Points = [None] * len(factor.columns)
    for row in summary:
        column = factor.column_of.get(row.key, -1)
        if row.task == task and row.by == factor.name and column >= 0 and _is_known(row, metric) and not factor.binned:
            points[column] = [*interval(row.metrics[metric]), row.rooms, row.frames]
    return points


def _is_known(row: SummaryRow, metric: str) -> bool:
    return metric in row.metrics and row.metrics[metric].value is not None


def comparison(parts: Mapping[int, Part], rooms: int) -> dict[str, Any]:
    """Return metric -> by the number of the evaluation, its score and its difference to the first, paired in rooms."""
    result: dict[str, Any] = {}
    first: dict[str, Array] = {}
    for number, part in parts.items():
        for m, metric in enumerate(part.task.metrics):
            zeros = np.zeros(len(part.samples.rooms), np.int64)
            values, counts = room_matrix(part.samples.rooms, zeros, part.samples.values[:, m], (rooms, 1))
            told = next((row for row in part.evaluation.summary if row.task == part.task.name and row.by == "all"), None)
            score = told.metrics[metric.name] if told is not None and _is_known(told, metric.name) else None
            mean = room_means(values[counts[:, 0] > 0], SCALES[metric.better])[0] if counts.any() else None
            shown = score or mean
            other = first.setdefault(metric.name, values)
            apart = contrast_of(other, values) if other is not values else None
            if shown:
                result.setdefault(metric.name, {})[str(number)] = {"score": interval(shown), "difference": apart and interval(apart)}
    return result


def contrast_of(first: Array, second: Array) -> Interval | None:
    """Return the mean difference, second minus first, over the rooms that both have; (rooms, 1) each."""
    apart = (second - first)[np.isfinite(second - first).all(axis=1)]
    return room_means(apart, "signed")[0] if len(apart) else None


KINDS = {"class": "class", "distance": "distance", "room_type": "room type"}
"""``by`` of a summary row -> heading; distances keep the order of the file, the others are sorted."""


def breakdowns(parts: Mapping[int, Part]) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Return metric -> kind -> rows with the key's text and, by the number of the evaluation, (value, low, high, rooms, frames)."""
    found: dict[str, dict[str, dict[FactorValue, dict[str, Any]]]] = {}
    better: dict[str, bool] = {}
    for number, part in parts.items():
        better.update((metric.name, metric.better == "lower") for metric in part.task.metrics)
        for row in part.evaluation.summary:
            if row.task != part.task.name or row.by not in KINDS:
                continue
            for metric, values in row.metrics.items():
                if values.value is None:
                    continue
                rows = found.setdefault(metric, {}).setdefault(row.by, {})
                rows.setdefault(row.key, {})[str(number)] = [*interval(values), row.rooms, row.frames]
    return {
        metric: {
            kind: [
                {"key": value_text(key).replace("_", " "), "values": values}
                for key, values in sorted(rows.items(), key=lambda item: _order(kind, item, better[metric]))
            ]
            for kind, rows in kinds.items()
        }
        for metric, kinds in found.items()
        if metric in better
    }


def _order(kind: str, item: tuple[FactorValue, dict[str, Any]], lower_is_better: bool) -> tuple[float, str]:
    key, values = item
    if kind == "distance":
        return 0.0, ""
    worst = next(iter(values.values()))[0]
    return (-worst if lower_is_better else worst), value_text(key)
