"""What a check has found."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

_NO_STAMP = -1


class Verdict(NamedTuple):
    """One measure of one topic against its limit.

    Attributes:
        check: name of the check.
        topic: that it is about.
        good: whether it is within the limit.
        worst: the measure, in ``unit``.
        limit: the most of it that is right.
        unit: of both; empty for a plain number.
        checked: how many values went in.
        detail: what is measured, in words.
        stamp_ns: where it is worst; -1 where that is no one place.
    """

    check: str
    topic: str
    good: bool
    worst: float
    limit: float
    unit: str
    checked: int
    detail: str
    stamp_ns: int = _NO_STAMP


def at_most(
    check: str, topic: str, detail: str, values: ArrayLike, limit: float, unit: str = "", stamps: ArrayLike | None = None
) -> Verdict:
    """Return whether no value (n,), each with its stamp where that is known, is above a limit; what is not a number is."""
    found = np.asarray(values, np.float64).ravel()
    if not len(found):
        return Verdict(check, topic, True, 0.0, limit, unit, 0, detail)
    found = np.where(np.isnan(found), np.inf, found)
    place = int(np.argmax(found))
    of = np.asarray([] if stamps is None else stamps).ravel()
    stamp = int(of[place]) if place < len(of) else _NO_STAMP
    worst = float(found[place])
    return Verdict(check, topic, worst <= limit, worst, limit, unit, len(found), detail, stamp)


_MOST_OF_ALL, _MOST_OF_FRAME = 0.01, 0.2
_FEWEST = 12
"""Values of a frame from which on a share says something."""


def share_off(check: str, topic: str, detail: str, off: ArrayLike, stamps: ArrayLike) -> Iterator[Verdict]:
    """Yield whether at most a hundredth of all values, or one, and a fifth of any frame's, are off: rays that graze an edge may be.

    ``off``: (n,) bool; ``stamps``: (n,) of the frame of each.
    """
    wrong, of = np.asarray(off, bool).ravel(), np.asarray(stamps, np.int64).ravel()
    if not len(wrong):
        return
    share, most = float(wrong.mean()), max(_MOST_OF_ALL, 1.0 / len(wrong))
    yield Verdict(check, topic, share <= most, share, most, "", len(wrong), f"share of {detail}")
    frames, number = np.unique(of, return_inverse=True)
    counts = np.bincount(number)
    shares = np.where(counts >= _FEWEST, np.bincount(number, wrong) / counts, 0.0)
    worst = int(np.argmax(shares))
    if shares[worst] > _MOST_OF_FRAME:
        detail = f"share of {detail}, in one frame"
        yield Verdict(check, topic, False, float(shares[worst]), _MOST_OF_FRAME, "", int(counts[worst]), detail, int(frames[worst]))
