"""Which frames stay: one row of a table for each thing that is asked of a frame."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from scene_synth_ros.splits.assignment import SplitError
from scene_synth_ros.splits.frame_facts import FrameFacts, Need, SeenObject

Interval = tuple[float, float]
EVERYTHING: Interval = (-math.inf, math.inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What is asked of frames; the defaults ask for nothing.

    Attributes:
        room_types: of which the room's is one; empty: any.
        sees: groups of categories; of each group at least one object is seen.
        image_share: of the image that an object covers at least, to be seen.
        visible_fraction: of an object that nothing hides at least, for it to be seen.
        objects: how many are seen, least and most.
        brightness: mean luma, 0 to 1, least and most.
        exposure_ev100: least and most.
    """

    room_types: tuple[str, ...] = ()
    sees: tuple[tuple[str, ...], ...] = ()
    image_share: float = 0.0
    visible_fraction: float = 0.0
    objects: Interval = EVERYTHING
    brightness: Interval = EVERYTHING
    exposure_ev100: Interval = EVERYTHING


class Filter(NamedTuple):
    """A row.

    Attributes:
        asked: whether anything is asked of it.
        keeps: whether a frame stays.
        needs: what of a frame must be recorded.
        words: what it asks for.
    """

    asked: Callable[[Asked], bool]
    keeps: Callable[[FrameFacts, Asked], bool]
    needs: tuple[Need, ...]
    words: Callable[[Asked], str]


def _counted(seen: SeenObject, asked: Asked) -> bool:
    fraction = 1.0 if seen.visible_fraction is None else seen.visible_fraction
    return seen.image_share >= asked.image_share and fraction >= asked.visible_fraction


def seen_categories(facts: FrameFacts, asked: Asked) -> list[str]:
    """Return the category of each object that counts as seen."""
    return [seen.category for seen in facts.objects or () if _counted(seen, asked)]


def _sees(facts: FrameFacts, asked: Asked) -> bool:
    there = set(seen_categories(facts, asked))
    return all(there & set(group) for group in asked.sees)


def _within(value: float | None, interval: Interval) -> bool:
    return value is not None and interval[0] <= value <= interval[1]


def _span(interval: Interval) -> str:
    return f"{interval[0]:g} to {interval[1]:g}"


FILTERS: dict[str, Filter] = {
    "sees": Filter(
        lambda asked: bool(asked.sees),
        _sees,
        ("instance",),
        lambda asked: " and ".join(" or ".join(group) for group in asked.sees),
    ),
    "objects": Filter(
        lambda asked: asked.objects != EVERYTHING,
        lambda facts, asked: _within(len(seen_categories(facts, asked)), asked.objects),
        ("instance",),
        lambda asked: f"{_span(asked.objects)} objects",
    ),
    "brightness": Filter(
        lambda asked: asked.brightness != EVERYTHING,
        lambda facts, asked: _within(facts.brightness, asked.brightness),
        ("color",),
        lambda asked: _span(asked.brightness),
    ),
    "ev100": Filter(
        lambda asked: asked.exposure_ev100 != EVERYTHING,
        lambda facts, asked: _within(facts.exposure_ev100, asked.exposure_ev100),
        ("settings",),
        lambda asked: f"EV {_span(asked.exposure_ev100)}",
    ),
}
"""Name, as in the report -> filter of frames, in the order of the report; ``room_types`` is asked of rooms before any frame is read."""


def needs_of(asked: Asked) -> set[Need]:
    """Return what must be recorded for what is asked."""
    needs = {need for row in FILTERS.values() if row.asked(asked) for need in row.needs}
    if asked.visible_fraction > 0.0 and "instance" in needs:
        needs.add("annotations")
    return needs


def refused_by(facts: FrameFacts, asked: Asked) -> list[str]:
    """Return the names of the filters that leave a frame out, in their order; empty if it stays."""
    return [name for name, row in FILTERS.items() if row.asked(asked) and not row.keeps(facts, asked)]


def read_interval(option: str, words: str, lowest: float = -math.inf, highest: float = math.inf) -> Interval:
    """Read ``LOW:HIGH``, either of which may be left out.

    Raises:
        SplitError: it is none, or lies outside what the option can be.
    """
    low, colon, high = words.partition(":")
    try:
        bounds = float(low or lowest), float(high or highest)
    except ValueError:
        bounds = (math.nan, math.nan)
    if not colon or not low + high or not lowest <= bounds[0] <= bounds[1] <= highest:
        limits = f" within {lowest:g} to {highest:g}" if math.isfinite(lowest) or math.isfinite(highest) else ""
        raise SplitError(f"{option} {words}: expected LOW:HIGH, numbers of which one may be left out{limits}")
    return bounds
