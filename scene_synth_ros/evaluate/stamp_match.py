"""How the stamps of truth and estimates in bags fit, known before a single image is decoded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class StampMatch:
    """The stamps of one task.

    Attributes:
        paired: in both, ascending.
        missing: of truth without an estimate, ascending.
        foreign: of estimates whose stamp no truth has, ascending.
        repeated: messages beyond the first of a stamp of the estimates.
    """

    paired: tuple[int, ...]
    missing: tuple[int, ...]
    foreign: tuple[int, ...]
    repeated: int


def match_stamps(truth: Mapping[int, int], estimates: Mapping[int, int]) -> StampMatch:
    """Compare two topics.

    Args:
        truth: stamp -> how many messages have it.
        estimates: the same.
    """
    return StampMatch(
        paired=tuple(sorted(truth.keys() & estimates.keys())),
        missing=tuple(sorted(truth.keys() - estimates.keys())),
        foreign=tuple(sorted(estimates.keys() - truth.keys())),
        repeated=sum(count - 1 for count in estimates.values()),
    )


def stamp_notes(task: str, topic: str, match: StampMatch) -> list[str]:
    """Return a line for each way in which the stamps do not fit."""
    lines = []
    if match.foreign:
        shown = (
            f"{len(match.foreign)} of {len(match.foreign) + len(match.paired)} stamps that no truth has, the first {match.foreign[0]} ns"
        )
        lines.append(f"{task}: {topic}: expected estimates at the stamps of the truth, got {shown}; copy the stamp of the image")
    if match.repeated:
        lines.append(f"{task}: {topic}: {match.repeated} messages repeat a stamp; the first of each stamp counts")
    return lines
