"""The factors of the evaluations that a report shows, their values as columns, and how the values were combined."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeGuard

import numpy as np

from evaluation.evaluation_file import FactorValue, FrameRow
from scene_synth_ros.report.sweep_file import Sweep, SweepFactor

MOST_VALUES = 12
"""Numeric factors with more values are put into bins."""
MOST_BINS = 6
MIXED = "mixed"

HOW = {
    "one_at_a_time": "each factor by itself, all others at their base",
    "grid": "mean over all values of the other factors",
    "latin_hypercube": "means of bins of about equal count, over all values of the other factors; dots are single variants, their room"
    " brought to the mean of all",
    MIXED: "mean over the other factors; not all combinations of values were evaluated, so factors may share an effect",
}
"""Design -> how a response curve treats the other factors."""


class Factor(NamedTuple):
    """A factor that has at least two values.

    Attributes:
        name, label, unit: of the sweep; the unit is "" for none.
        columns: texts of its values, or of bins of them.
        places: the number of each column, empty for a factor of names.
        base: column of the base, None where there is none.
        base_value: the base itself, where it lies in no column of its own.
        column_of: value -> column.
    """

    name: str
    label: str
    unit: str
    columns: tuple[str, ...]
    places: tuple[float, ...]
    base: int | None
    base_value: float | None
    column_of: Mapping[FactorValue, int]

    @property
    def binned(self) -> bool:
        """Whether columns are bins."""
        return len(self.column_of) > len(self.columns)


class Design(NamedTuple):
    """The factors, and how their values were combined: a key of ``HOW``."""

    name: str
    factors: tuple[Factor, ...]


def find_design(frames: Collection[FrameRow], sweeps: Iterable[Sweep]) -> Design:
    """Return the design of what was evaluated; what no sweep says is read off the combinations of values."""
    told: dict[str, SweepFactor] = {}
    name = ""
    for sweep in sweeps:
        told = {**dict(sweep.factors), **told}
        name = name or sweep.design
    values: dict[str, dict[FactorValue, None]] = {}
    for frame in frames:
        for factor, value in frame.key.factors.items():
            values.setdefault(factor, {})[value] = None
    several = [factor for factor, found in values.items() if len(found) > 1]
    combinations = {tuple(frame.key.factors.get(factor) for factor in several) for frame in frames}
    centre = _centre(combinations)
    name = name or _guess(several, values, combinations, centre)
    bases = dict(zip(several, centre or (), strict=False)) if name == "one_at_a_time" else {}
    factors = [_factor(factor, list(values[factor]), told.get(factor), bases.get(factor), name == "latin_hypercube") for factor in several]
    return Design(name, tuple(factors))


def value_text(value: FactorValue) -> str:
    """Return a value for people."""
    if value is None or isinstance(value, bool):
        return {None: "none", True: "on", False: "off"}[value]
    return value if isinstance(value, str) else f"{value:.4g}"


def is_number(value: FactorValue) -> TypeGuard[float]:
    """Return whether a value is a number, and no switch."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _factor(name: str, found: Sequence[FactorValue], told: SweepFactor | None, centre: FactorValue, spread_out: bool) -> Factor:
    label, unit, order, base = (told.label, told.unit, told.values, told.base) if told else (name, "", (), None)
    base = centre if base is None else base
    numbers = sorted(float(value) for value in found if is_number(value))
    if len(numbers) < len(found):
        ranks = {value: k for k, value in enumerate(order)}
        columns = sorted(found, key=lambda value: ranks.get(value, len(ranks)))
        column_of = {value: k for k, value in enumerate(columns)}
        return Factor(name, label, unit, tuple(map(value_text, columns)), (), column_of.get(base), None, column_of)
    base_value = float(base) if is_number(base) else None
    if len(numbers) <= MOST_VALUES and not (spread_out and len(numbers) > MOST_BINS):
        column_of = {value: k for k, value in enumerate(numbers)}
        return Factor(name, label, unit, tuple(map(value_text, numbers)), tuple(numbers), column_of.get(base), base_value, column_of)
    bins = np.array_split(np.array(numbers), max(2, min(MOST_BINS, len(numbers) // 3)))
    texts = tuple(f"{value_text(float(part[0]))} to {value_text(float(part[-1]))}" for part in bins)
    column_of = {float(value): k for k, part in enumerate(bins) for value in part}
    return Factor(name, label, unit, texts, tuple(float(part.mean()) for part in bins), None, base_value, column_of)


def _centre(combinations: Collection[tuple[FactorValue, ...]]) -> tuple[FactorValue, ...] | None:
    """Return the combination that all others differ from in one factor at most, None where there is none."""
    if not combinations:
        return None
    usual = tuple(Counter(column).most_common(1)[0][0] for column in zip(*combinations, strict=True))
    single = all(sum(a != b for a, b in zip(usual, one, strict=True)) <= 1 for one in combinations)
    return usual if single and usual in combinations else None


def _guess(
    names: Sequence[str],
    values: Mapping[str, Mapping[FactorValue, None]],
    combinations: Collection[tuple[FactorValue, ...]],
    centre: tuple[FactorValue, ...] | None,
) -> str:
    if len(combinations) == math.prod(len(values[name]) for name in names):
        return "grid"
    if centre is not None:
        return "one_at_a_time"
    numeric = [name for name in names if all(is_number(value) for value in values[name])]
    if any(2 * len(values[name]) > len(combinations) for name in numeric):
        return "latin_hypercube"
    return MIXED
