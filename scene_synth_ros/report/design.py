"""The factors of the evaluations that a report shows, their values as columns, and how the values were combined."""

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeGuard

import numpy as np
from numpy.typing import NDArray

from evaluation.evaluation_file import FactorValue, FrameRow
from scene_synth_ros.report.sweep_file import AS_IT_IS, Sweep, SweepFactor

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
        places: the number of each column, None for that of base rooms that differ in it; empty for a factor of names.
        base: column of the base, None where there is none.
        base_value: the base itself, where it lies in no column of its own.
        column_of: value -> column.
    """

    name: str
    label: str
    unit: str
    columns: tuple[str, ...]
    places: tuple[float | None, ...]
    base: int | None
    base_value: float | None
    column_of: Mapping[FactorValue, int]

    @property
    def binned(self) -> bool:
        """Whether columns are bins."""
        return len(self.column_of) > len(self.columns)

    @property
    def has_numbers(self) -> bool:
        """Whether the values are numbers."""
        return bool(self.places)


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
    own = AS_IT_IS in found
    base = AS_IT_IS if own else centre if base is None else base
    numbers = sorted(float(value) for value in found if is_number(value))
    if not numbers or len(numbers) + own < len(found):
        ranks = {value: k for k, value in enumerate((AS_IT_IS, *order))}
        columns = sorted(found, key=lambda value: ranks.get(value, len(ranks)))
        column_of = {value: k for k, value in enumerate(columns)}
        return Factor(name, label, unit, tuple(map(value_text, columns)), (), column_of.get(base), None, column_of)
    few = len(numbers) <= (MOST_BINS if spread_out else MOST_VALUES)
    bins = np.array_split(np.array(numbers), len(numbers) if few else max(2, min(MOST_BINS, len(numbers) // 3)))
    column_of = {float(value): k + own for k, part in enumerate(bins) for value in part} | ({AS_IT_IS: 0} if own else {})
    return Factor(
        name=name,
        label=label,
        unit=unit,
        columns=(*((AS_IT_IS,) if own else ()), *(_bin_text(part) for part in bins)),
        places=(*((None,) if own else ()), *(float(part.mean()) for part in bins)),
        base=column_of.get(base) if few or own else None,
        base_value=float(base) if is_number(base) else None,
        column_of=column_of,
    )


def _bin_text(values: NDArray[np.float64]) -> str:
    ends = [value_text(float(values[k])) for k in (0, -1)]
    return ends[0] if len(values) == 1 else " to ".join(ends)


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
    numeric = [name for name in names if all(is_number(value) or value == AS_IT_IS for value in values[name])]
    if any(2 * len(values[name]) > len(combinations) for name in numeric):
        return "latin_hypercube"
    return MIXED
