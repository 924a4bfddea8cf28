"""What small things there are, how many of them a support carries, and how people put them there, as frozen data.

The numbers are in ``config/small_things.yaml``, one file for all room types.  What stands on a nightstand depends on the nightstand more
than on the grammar that put it into the room, so grammars learned from data need no copy of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from grammar.spec.categories import Categories
from grammar.spec.rules import Grammar, GrammarError
from grammar.spec.values import Extent, Radians, Spread
from scene_description import FieldError, Limits, from_mapping
from scene_description.yaml_text import read_yaml

Odds = Annotated[float, Limits(ge=0.0, le=1e6)]
Count = Annotated[float, Limits(ge=0.0, le=100.0)]
Depth = Literal["back", "middle", "front", "edge", "any"]
Beside = Literal["wall", "door", "furniture"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """A kind of small thing, by its category.

    Sizes are normal about ``size_m`` (depth, width, height) with ``sd_m``, cut at two deviations.  ``at`` is the part of a support's depth
    that it keeps to where things are tidy (edge: at the front one or the back one, looking out over it), ``turns`` the yaws against the
    supporter that people give it, the first one most often; none: it is round, so any.  On a wall its middle hangs between the heights
    ``hangs_m``, over the back of one of ``above`` where the room has one.  What is ``straight`` stands exactly along its wall.  A room that
    has ``most`` of it gets no more, but as members of groups.
    """

    size_m: tuple[Extent, Extent, Extent]
    sd_m: tuple[Spread, Spread, Spread]
    at: Depth = "any"
    hangs_m: tuple[Extent, Extent] | None = None
    above: tuple[str, ...] = ()
    straight: bool = False
    turns: Annotated[tuple[Radians, ...], Limits(max_length=8)] = ()
    most: Annotated[int, Limits(ge=1, le=1000)] = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """A branch of a group's Set node: a thing, and the probabilities of 0, 1, 2, ... of it (``multiplicity``).

    Its middle lies at ``at_m`` in the frame of the group's core, within ``sd_m``, turned by ``turn`` (none: any way); or it stands ``upon``
    a thing of the group that has come before it, which its address node draws; or it hangs ``below`` the core, which is on a wall.
    """

    thing: str
    multiplicity: Annotated[tuple[Annotated[float, Limits(ge=0.0, le=1.0)], ...], Limits(min_length=2, max_length=16)] = (0.0, 1.0)
    at_m: tuple[Annotated[float, Limits(ge=-3.0, le=3.0, unit="m")], Annotated[float, Limits(ge=-3.0, le=3.0, unit="m")]] = (0.0, 0.0)
    sd_m: Spread = 0.02
    turn: Radians | None = 0.0
    upon: str | None = None
    below: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Things that people leave together: a core, which finds its place as any thing does, and what lies around or on it."""

    core: str
    members: tuple[Member, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stock:
    """What a support carries: the mean number of things or groups at clutter 1, what the grammar stands there counted, and their odds."""

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
    rooms of a type.  On a ``seat`` the stock lies only beyond clutter 1: ``count`` is then its mean number for each unit above that; up to
    clutter 1 there is what is ``tidy`` there.
    """

    area_m2: Annotated[float, Limits(ge=0.001, le=100.0, unit="m2")]
    stock: Stock
    rooms: Mapping[str, Stock] = field(default_factory=dict)
    seat: bool = False
    tidy: Stock | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Strewn:
    """What is on the floor: ``tidy`` by room type up to clutter 1; beyond it a mean number for each square metre and unit above 1."""

    tidy: Mapping[str, TidyFloor] = field(default_factory=dict)
    per_m2: Annotated[float, Limits(ge=0.0, le=10.0)]
    things: Mapping[str, Odds]
    rooms: Mapping[str, Mapping[str, Odds]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Untidy:
    """What untidiness does to furniture, by category.

    ``reach_m``: how far a drawer or door reaches out where it is left ajar; ``posed``: ``ajar`` at the most of what moves within its box;
    ``turned``: seats that are pushed back, at most so far (m), and turned, at most so much (rad); ``shifted``: the same of rugs.
    """

    reach_m: Mapping[str, Extent] = field(default_factory=dict)
    posed: Mapping[str, Annotated[float, Limits(ge=0.0, le=1.0)]] = field(default_factory=dict)
    turned: Mapping[str, tuple[Spread, Spread]] = field(default_factory=dict)
    shifted: Mapping[str, tuple[Spread, Spread]] = field(default_factory=dict)


_NOTHING = TidyFloor(count=0.0, things={})


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallThings:
    """All rules of small things: the kinds, groups, supports by category, the floor, and what needs the surface before it free.

    ``walls``: by room type what hangs on its walls besides pictures; ``fittings``: what is built into them; ``hooks``: by category of what
    hangs what is hung below it.
    """

    things: Mapping[str, Thing]
    groups: Mapping[str, Group] = field(default_factory=dict)
    supports: Mapping[str, Support]
    floor: Strewn
    walls: Mapping[str, Stock] = field(default_factory=dict)
    fittings: Mapping[str, Stock] = field(default_factory=dict)
    hooks: Mapping[str, Stock] = field(default_factory=dict)
    untidy: Untidy = Untidy()
    front_free: tuple[str, ...] = ()

    def rows_of(self, grammar: Grammar) -> str:
        """Return the room type whose rows the rooms of a grammar take: their own if some are known, else that which they are like."""
        return grammar.room_type if grammar.room_type in self.floor.tidy else grammar.looks_like

    def stock(self, category: str, room_type: str) -> Stock | None:
        """Return what furniture of a category carries in rooms of a type, None if nothing."""
        support = self.supports.get(category)
        return None if support is None else support.rooms.get(room_type, support.stock)

    def tidy_floor(self, room_type: str) -> TidyFloor:
        """Return what stands on the floor of rooms of a type up to clutter 1."""
        return self.floor.tidy.get(room_type, _NOTHING)

    def categories(self) -> set[str]:
        """Return the categories of all that supports, floors, walls and hooks may bring."""
        supports = [stock for one in self.supports.values() for stock in (one.stock, one.tidy, *one.rooms.values())]
        names = set(_drawn(*supports, *self.walls.values(), *self.fittings.values(), *self.hooks.values()))
        floors = [self.floor.things, *self.floor.rooms.values(), *(tidy.things for tidy in self.floor.tidy.values())]
        names |= {name for odds in floors for name in odds}
        groups = [self.groups[name] for name in names & set(self.groups)]
        return (names - set(self.groups)) | {name for group in groups for name in (group.core, *(one.thing for one in group.members))}

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
    drawn = [*things, *rules.groups]
    found = [("things", things, known), ("supports", list(rules.supports), known), ("front_free", list(rules.front_free), known)]
    moved = rules.untidy
    found += [("untidy", [*moved.reach_m, *moved.posed, *moved.turned, *moved.shifted], known)]
    found += [("hooks", list(rules.hooks), known), *((f"things.{name}", list(thing.above), known) for name, thing in rules.things.items())]
    for name, group in rules.groups.items():
        found.append((f"groups.{name}", [group.core, *(member.thing for member in group.members)], things))
        before = [group.core]
        for member in group.members:
            found.append((f"groups.{name}", [member.upon] if member.upon else [], before))
            before = [*before, member.thing]
    for name, support in rules.supports.items():
        found.append((f"supports.{name}", _drawn(support.stock, *support.rooms.values(), support.tidy), drawn))
    hanging = [name for name, thing in rules.things.items() if thing.hangs_m]
    hanging += [name for name, group in rules.groups.items() if group.core in hanging]
    for odds in (rules.floor.things, *rules.floor.rooms.values(), *(stock.things for stock in rules.floor.tidy.values())):
        found.append(("floor", list(odds), [name for name in drawn if name not in hanging]))
    for where, stocks in (("walls", rules.walls), ("fittings", rules.fittings)):
        found += [(f"{where}.{name}", _drawn(stock), hanging) for name, stock in stocks.items()]
    found += [(f"hooks.{name}", _drawn(stock), things) for name, stock in rules.hooks.items()]
    return found


def _drawn(*stocks: Stock | None) -> list[str]:
    """Return the names of all that stocks draw from."""
    return [name for stock in stocks if stock is not None for name in stock.things]
