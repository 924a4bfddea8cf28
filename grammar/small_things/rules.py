"""What small things there are, how many of them a support carries, and how people put them there, as frozen data.

The numbers are in ``config/small_things.yaml``, one file for all room types.  What stands on a nightstand depends on the nightstand more
than on the grammar that put it into the room, so grammars learned from data need no copy of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from grammar.spec.categories import Categories
from grammar.spec.rules import GrammarError
from grammar.spec.values import Extent, Radians, Spread
from scene_description import FieldError, Limits, from_mapping
from scene_description.yaml_text import read_yaml

Odds = Annotated[float, Limits(ge=0.0, le=1e6)]
Count = Annotated[float, Limits(ge=0.0, le=100.0)]
Depth = Literal["back", "middle", "front", "any"]
Beside = Literal["wall", "door", "furniture"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """A kind of small thing, by its category.

    Sizes are normal about ``size_m`` (depth, width, height) with ``sd_m``, cut at two deviations.  ``at`` is the part of a support's depth
    that it keeps to where things are tidy, ``turns`` the yaws against the supporter that people give it, the first one most often; none:
    it is round, so any.
    """

    size_m: tuple[Extent, Extent, Extent]
    sd_m: tuple[Spread, Spread, Spread]
    at: Depth = "any"
    hangs_m: tuple[Extent, Extent] | None = None
    turns: Annotated[tuple[Radians, ...], Limits(max_length=8)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Stock:
    """What a support carries: the mean number of things at clutter 1, what stands there by the grammar counted, and odds by category."""

    count: Count
    things: Mapping[str, Odds]


@dataclass(frozen=True, slots=True, kw_only=True)
class TidyFloor:
    """What stands on the floor of a tidy room: mean number at clutter 1, odds by category, and where.

    ``beside`` walls, walls by a door, or furniture; nowhere in the way of what is used.
    """

    count: Count
    things: Mapping[str, Odds]
    beside: Beside = "wall"


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """What a category of furniture carries.

    The count holds for a surface of ``area_m2`` and grows with the surface, from half to twice.  ``rooms`` take the place of the stock in
    rooms of a type.  On a ``seat`` things lie only beyond clutter 1: ``count`` is then their mean number for each unit above that.
    """

    area_m2: Annotated[float, Limits(ge=0.001, le=100.0, unit="m2")]
    stock: Stock
    rooms: Mapping[str, Stock] = field(default_factory=dict)
    seat: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Strewn:
    """What is on the floor: ``tidy`` by room type up to clutter 1; beyond it a mean number for each square metre and unit above 1."""

    tidy: Mapping[str, TidyFloor] = field(default_factory=dict)
    per_m2: Annotated[float, Limits(ge=0.0, le=10.0)]
    things: Mapping[str, Odds]
    rooms: Mapping[str, Mapping[str, Odds]] = field(default_factory=dict)


_NOTHING = TidyFloor(count=0.0, things={})


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallThings:
    """All rules of small things: the kinds, the supports by category, the floor, and what needs the surface before it free."""

    things: Mapping[str, Thing]
    supports: Mapping[str, Support]
    floor: Strewn
    front_free: tuple[str, ...] = ()

    def stock(self, category: str, room_type: str) -> Stock | None:
        """Return what furniture of a category carries in rooms of a type, None if nothing."""
        support = self.supports.get(category)
        return None if support is None else support.rooms.get(room_type, support.stock)

    def tidy_floor(self, room_type: str) -> TidyFloor:
        """Return what stands on the floor of rooms of a type up to clutter 1."""
        return self.floor.tidy.get(room_type, _NOTHING)

    def strewn(self, room_type: str) -> Mapping[str, Odds]:
        """Return the odds of what lies on the floor of rooms of a type."""
        return self.floor.rooms.get(room_type, self.floor.things)


NO_SMALL_THINGS = SmallThings(things={}, supports={}, floor=Strewn(per_m2=0.0, things={}))


def read_small_things(path: Path, categories: Categories) -> SmallThings:
    """Read and check the rules, for example ``config_path("small_things.yaml")``.

    Raises:
        GrammarError: the file does not parse or a field does not fit; one line with file and field.
    """
    try:
        rules = from_mapping(SmallThings, read_yaml(path, GrammarError))
        for where, names, known in _names(rules, categories):
            unknown = sorted(set(names) - set(known))
            if unknown:
                raise FieldError(where, f"one of {', '.join(sorted(known))}", repr(unknown[0]))
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    return rules


def _names(rules: SmallThings, categories: Categories) -> list[tuple[str, list[str], list[str]]]:
    """Return for each part of the rules the names in it and those that are known there."""
    known, things = list(categories), list(rules.things)
    found = [("things", things, known), ("supports", list(rules.supports), known), ("front_free", list(rules.front_free), known)]
    for name, support in rules.supports.items():
        stocks = [support.stock, *support.rooms.values()]
        found.append((f"supports.{name}", [thing for stock in stocks for thing in stock.things], things))
    for odds in (rules.floor.things, *rules.floor.rooms.values(), *(stock.things for stock in rules.floor.tidy.values())):
        found.append(("floor", list(odds), things))
    return found
