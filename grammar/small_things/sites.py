"""Where small things find places: tops and boards of furniture, the floor, walls, hooks; one kind of site each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import HALF_DEPTH, HALF_WIDTH, Z_HIGH, Z_LOW, box_rows
from grammar.geometry.slopes import above_slopes, slope_rows
from grammar.geometry.solids import object_solids, whole_box
from grammar.geometry.walls import rectangle_outside, wall_rows
from grammar.geometry.zones import SWING, opening_frame, opening_zones, placed_zones
from grammar.small_things.place import Newcomer, Obstacles, Top, by_wall, on_floor, on_top, use_strips, world_box
from grammar.small_things.rules import SmallThings
from grammar.small_things.walls import below_hooks, on_wall
from grammar.spec.categories import Categories, Role
from grammar.spec.rules import Grammar
from scene_description import Room, SceneObject
from scene_description.types import Point2

Odds = Mapping[str, float]

_WALL_M = 0.01

_SEEN_M = 0.4
"""Space that stays free before what hangs to be seen."""

_LEANS_M = 1.0
"""What is higher, as a broom or garden tools, leans at a wall and does not stand free."""

_OPENED: tuple[Role, ...] = ("store", "shelf", "wardrobe", "fridge", "wall_unit")


class Surroundings:
    """A furnished room as what comes into it finds it: walls, ceiling, and the solids that are in the way, which grow in number."""

    def __init__(self, categories: Categories, room: Room, objects: Sequence[SceneObject]) -> None:
        self.categories, self.room, self.wall = categories, room, wall_rows(room.polygon_m)
        self.taken = Obstacles(*object_solids(categories, objects))
        self._slope = None if room.slopes is None else slope_rows(room)

    def add(self, item: SceneObject) -> None:
        """Put a thing in the way of those that come after it."""
        self.taken = self.taken.with_more(*object_solids(self.categories, [item]))
        if "shown" in self.categories[item.category].roles and item.support.kind == "wall":
            depth = _SEEN_M + item.size_m[0]
            self.taken = self.taken.with_more(box_rows([world_box(item, 0.5 * _SEEN_M, 0.0, 0.0, (depth, *item.size_m[1:]), 0.0)]))

    def fits(self, item: SceneObject) -> bool:
        """Return whether a thing is inside the room, clear of its walls but for that on which it hangs, and below the ceiling."""
        x, y, z = item.position_m
        if z + item.size_m[2] > self.room.height_m:
            return False
        if self._slope is not None and above_slopes(self._slope, whole_box(item)[None], 0) > 0.0:
            return False
        gap = 0.0 if item.support.kind == "wall" else _WALL_M
        c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        half = 0.5 * item.size_m[0] + gap, 0.5 * item.size_m[1] + gap
        return bool(rectangle_outside(self.wall, x, y, c, s, *half) <= 1e-6)


class Carrier(NamedTuple):
    """What carries the core of a group: an object with its surfaces, None for floor and walls; (n, 8) boxes that stay free there."""

    item: SceneObject | None
    tops: Sequence[Top]
    free: Boxes


class Site(Protocol):
    """A place that things come to."""

    def odds(self, mess: float) -> Odds:
        """Return the odds of what comes to it, tidy (``mess`` 0) or not."""

    def place(self, rng: np.random.Generator, new: Newcomer, mess: float, around: Surroundings) -> SceneObject | None:
        """Return a newcomer in its place, None where no drawn pose is free."""

    def carrier(self) -> Carrier:
        """Return what carries those that join it there."""


@dataclass(frozen=True, slots=True)
class TopSite:
    """Surfaces of an object, what is tidy there and what comes beyond that, and (n, 8) boxes over them that stay free."""

    item: SceneObject
    surfaces: tuple[Top, ...]
    tidy: Odds
    late: Odds
    free: Boxes

    def odds(self, mess: float) -> Odds:
        """Return the odds of what comes to it."""
        return self.late if mess > 0.0 else self.tidy

    def place(self, rng: np.random.Generator, new: Newcomer, mess: float, around: Surroundings) -> SceneObject | None:
        """Return a newcomer on one of the surfaces."""
        return on_top(rng, new, self.item, self.surfaces, mess, around.fits, around.taken.with_more(self.free))

    def carrier(self) -> Carrier:
        """Return the object with its surfaces."""
        return Carrier(self.item, self.surfaces, self.free)


@dataclass(frozen=True, slots=True)
class FloorSite:
    """The floor: tidy things stand beside walls, doors or furniture, the others lie beside furniture that is not opened there."""

    tidy: Odds
    late: Odds
    beside: str
    anchors: Sequence[SceneObject]
    doors: Sequence[Point2]
    free: Boxes
    used: Boxes

    def odds(self, mess: float) -> Odds:
        """Return the odds of what comes to it."""
        return self.late if mess > 0.0 else self.tidy

    def place(self, rng: np.random.Generator, new: Newcomer, mess: float, around: Surroundings) -> SceneObject | None:
        """Return a newcomer on the floor, where doors do not swing and off rugs."""
        taken = around.taken.with_more(self.free)
        if mess > 0.0:
            return on_floor(rng, new, self.anchors, mess, around.fits, taken)
        taken = taken.with_more(self.used)
        if self.beside == "furniture":
            return on_floor(rng, new, self.anchors, 0.0, around.fits, taken)
        stood = by_wall(rng, new, around.wall, self.doors if self.beside == "door" else (), around.fits, taken)
        if stood or new.item.size_m[2] > _LEANS_M:
            return stood
        return on_floor(rng, new, self.anchors, 0.0, around.fits, taken)

    def carrier(self) -> Carrier:
        """Return the floor with what stays free of it."""
        return Carrier(None, (), np.concatenate([self.free, self.used]))


@dataclass(frozen=True, slots=True)
class _OnWall:
    """What comes to walls, tidy or not, and what openings need free."""

    things: Odds
    free: Boxes

    def odds(self, mess: float) -> Odds:
        """Return the odds of what comes to it."""
        del mess
        return self.things

    def carrier(self) -> Carrier:
        """Return the walls with what stays free of them."""
        return Carrier(None, (), self.free)


@dataclass(frozen=True, slots=True)
class WallSite(_OnWall):
    """The walls of the room, and the furniture that some things belong above."""

    below: Mapping[str, Sequence[SceneObject]]

    def place(self, rng: np.random.Generator, new: Newcomer, mess: float, around: Surroundings) -> SceneObject | None:
        """Return a newcomer flat on a wall."""
        del mess
        return on_wall(rng, new, around.wall, self.below.get(new.item.category, ()), around.fits, around.taken.with_more(self.free))


@dataclass(frozen=True, slots=True)
class HookSite(_OnWall):
    """Hooks on a wall."""

    item: SceneObject

    def place(self, rng: np.random.Generator, new: Newcomer, mess: float, around: Surroundings) -> SceneObject | None:
        """Return a newcomer below the hooks."""
        del mess
        return below_hooks(rng, new, self.item, around.fits, around.taken.with_more(self.free))


def floor_site(rules: SmallThings, grammar: Grammar, categories: Categories, room: Room, objects: Sequence[SceneObject]) -> FloorSite:
    """Return the floor of a furnished room as a site."""
    rows = rules.rows_of(grammar)
    tidy = rules.tidy_floor(rows)
    rugs = [whole_box(item) for item in objects if categories[item.category].underlay]
    standing = [item for item in objects if item.support.kind == "floor" and not categories[item.category].underlay]
    return FloorSite(
        tidy=tidy.things,
        late=rules.strewn(rows),
        beside=tidy.beside,
        anchors=[item for item in standing if not set(_OPENED) & set(categories[item.category].roles)],
        doors=[opening_frame(room, opening)[:2] for opening in room.openings if opening.category == "door"],
        free=np.concatenate([opening_boxes(grammar, room, swings=True), box_rows(rugs)]),
        used=use_strips(categories, objects),
    )


def wall_site(
    rules: SmallThings, things: Odds, grammar: Grammar, categories: Categories, room: Room, objects: Sequence[SceneObject]
) -> WallSite:
    """Return the walls of a furnished room as a site."""
    cores = {rules.groups[name].core if name in rules.groups else name for name in things}
    above = {name: rules.things[name].above for name in cores}
    below = {name: [item for item in objects if item.category in wanted] for name, wanted in above.items() if wanted}
    heaters = [whole_box(item) for item in objects if "heater" in categories[item.category].roles]
    for box in heaters:
        box[Z_HIGH] = room.height_m
    return WallSite(things, np.concatenate([opening_boxes(grammar, room, swings=False), box_rows(heaters)]), below)


def opening_boxes(grammar: Grammar, room: Room, *, swings: bool) -> Floats:
    """Return the (n, 8) boxes that openings need free: where doors swing, or all, and the wall from floor to ceiling, for curtains."""
    rows = [np.empty((0, 8))]
    for opening in room.openings:
        x, y, yaw = opening_frame(room, opening)
        zones = opening_zones(opening, grammar.openings[opening.category])
        placed = placed_zones([zone for zone in zones if not swings or zone.kind == SWING], x, y, opening.sill_m, yaw)
        if not swings:
            placed[:, [HALF_DEPTH, HALF_WIDTH]] += 0.08
            placed[:, [Z_LOW, Z_HIGH]] = 0.0, room.height_m
        rows.append(placed)
    return np.concatenate(rows)
