"""Filling supports and floor with small things, one after the other in the order in which growing clutter brings them.

The things of a support are the events of a Poisson process whose time is the clutter, so every clutter contains what smaller ones have.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from grammar.derivation.constraints import numbers_asked
from grammar.derivation.densities import draw_index
from grammar.geometry.boxes import Z_HIGH, X, Y, box_rows
from grammar.geometry.solids import object_solids, whole_box
from grammar.geometry.walls import rectangle_outside, wall_rows
from grammar.geometry.zones import SWING, opening_frame, opening_zones, placed_zones
from grammar.small_things.place import Newcomer, Obstacles, Top, by_wall, draw_thing_size, kept_free, on_floor, on_top, tops_of, use_strips
from grammar.small_things.rules import SmallThings
from grammar.spec.categories import Categories, Role
from grammar.spec.request import SceneRequest
from grammar.spec.rules import Grammar
from scene_description import ModelReference, Room, SceneObject, Support
from scene_description.polygons import signed_area_m2

BARE_SHARE = 0.25
"""Least share of a support's count that comes up to clutter 1, however much the grammar stands there itself."""

_TIDY, _MESSY = 1.0, 3.0


def early_rate(count: float, there: float) -> float:
    """Return the mean number of things that come up to clutter 1 where ``count`` belong and the grammar stands ``there`` already."""
    return max(count - there, BARE_SHARE * count)


def arrival_levels(rng: np.random.Generator, early: float, late: float, until: float) -> Iterator[float]:
    """Yield the levels of clutter at which things come, in rising order.

    Args:
        rng: source of randomness; the levels up to ``until`` do not depend on ``until``.
        early: mean number of things that come up to clutter 1.
        late: mean number that come for each unit above that.
        until: the last level.
    """
    level = 0.0
    while True:
        need, first = float(rng.standard_exponential()), early * max(_TIDY - level, 0.0)
        if need < first:
            level += need / early
        elif late > 0.0:
            level = max(level, _TIDY) + (need - first) / late
        else:
            return
        if level > until:
            return
        yield level


def mean_arrivals(early: float, late: float, until: float) -> float:
    """Return the mean number of things that come up to the level ``until``; the arguments are those of :func:`arrival_levels`."""
    return early * min(until, _TIDY) + late * max(until - _TIDY, 0.0)


def disorder(level: float) -> float:
    """Return how far from its tidy place a thing lies that comes at a level of clutter: 0 up to clutter 1, 1 from clutter 3."""
    return min(max((level - _TIDY) / (_MESSY - _TIDY), 0.0), 1.0)


FLOOR = 0
"""Stands for the floor where supports go by their ids, which count from 1."""

_STREAM = 1
_MAX_SEED = 2**63 - 1
_WALL_M = 0.01
_KINDS_TRIED = 2
_LEAST_GROWTH, _MOST_GROWTH = 0.5, 2.0
_OPENED: tuple[Role, ...] = ("store", "shelf", "wardrobe", "fridge", "wall_unit")


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What small things are drawn from: their rules, grammar and categories of the room, the request, and sizes that models fix."""

    rules: SmallThings
    grammar: Grammar
    categories: Categories
    request: SceneRequest
    sizes_m: Mapping[str, tuple[float, float, float]]


class Placed(NamedTuple):
    """A small thing in its place: the level of clutter at which it comes, and the log-probability of its category there."""

    item: SceneObject
    level: float
    log_probability: float


class _Arrival(NamedTuple):
    level: float
    support: int
    number: int


@dataclass(slots=True)
class _Surface:
    """A support that is being filled: its rectangles, what is in the way near it, and the odds of what it carries."""

    item: SceneObject
    tops: list[Top]
    obstacles: Obstacles
    odds: Mapping[str, float]


class Filling:
    """Supports and floor of a room while small things come.

    ``objects``: what stands in it at clutter 1, before small things are taken away or added; ``root``: seed of all that is drawn; every
    thing has a stream of its own.
    """

    def __init__(self, source: Source, room: Room, objects: Sequence[SceneObject], root: int) -> None:
        self._source, self._room, self._objects, self._root = source, room, objects, root
        self._boxes, self._owners = object_solids(source.categories, objects)
        self._surfaces: dict[int, _Surface] = {}
        self._means: dict[int, float] = {}
        self._floor = self._floor_obstacles()
        self._used = use_strips(source.categories, objects)
        self._wall = wall_rows(room.polygon_m)
        self._doors = [opening_frame(room, opening)[:2] for opening in room.openings if opening.category == "door"]
        # what lies on the floor lies beside furniture that is not opened there, and not on rugs
        self._anchors = [
            item
            for item in objects
            if item.support.kind == "floor"
            and not source.categories[item.category].underlay
            and not set(_OPENED) & set(source.categories[item.category].roles)
        ]

    def things(self, there: Sequence[SceneObject], since: float = 0.0) -> Iterator[Placed]:
        """Yield the small things that come up to the clutter asked for, in that order, with ids after all others.

        ``there``: the objects that count for what a request allows at most; ``since``: level after which things come.
        """
        request = self._source.request
        most: dict[str, int] = {}
        for name, _, high, _ in numbers_asked(request, self._source.categories):
            most[name] = min(high, most.get(name, high))
        count, total = Counter(item.category for item in there), len(there)
        first = max((item.id for item in self._objects), default=len(self._room.openings)) + 1
        for number, arrival in enumerate(sorted(arrival for arrival in self._arrivals() if arrival.level > since)):
            if total >= request.max_objects:
                return
            rng = np.random.default_rng([self._root, _STREAM, arrival.support, arrival.number])
            placed = self._place(rng, arrival, first + number)
            if placed is None or count[placed.item.category] >= most.get(placed.item.category, math.inf):
                continue
            self._occupy(arrival.support, placed.item)
            count[placed.item.category] += 1
            total += 1
            yield placed

    def mean(self, support: int) -> float:
        """Return the mean number of things that come to a support up to the clutter asked for."""
        return self._means[support]

    def _arrivals(self) -> Iterator[_Arrival]:
        """Yield what comes to each support and to the floor; supports to which something comes are prepared."""
        source, clutter = self._source, self._source.request.clutter
        for item in self._objects:
            support, stock = source.rules.supports.get(item.category), source.rules.stock(item.category, source.grammar.looks_like)
            if support is None or stock is None or clutter <= float(support.seat):
                continue
            tops = tops_of(source.categories[item.category], item, seat=support.seat)
            area = sum(top.area_m2 for top in tops)
            count = stock.count * min(max(area / support.area_m2, _LEAST_GROWTH), _MOST_GROWTH) if area > 0.0 else 0.0
            carried = sum(other.support.id == item.id for other in self._objects)
            levels = self._levels(item.id, 0.0 if support.seat else early_rate(count, carried), count)
            if levels:
                self._surfaces[item.id] = self._surface(item, tops, stock.things)
            yield from (_Arrival(level, item.id, k) for k, level in enumerate(levels))
        tidy, strewn = source.rules.tidy_floor(source.grammar.looks_like), source.rules.floor.per_m2 * signed_area_m2(self._room.polygon_m)
        yield from (_Arrival(level, FLOOR, k) for k, level in enumerate(self._levels(FLOOR, tidy.count, strewn)))

    def _levels(self, support: int, early: float, late: float) -> list[float]:
        rng, clutter = np.random.default_rng([self._root, _STREAM, support]), self._source.request.clutter
        self._means[support] = mean_arrivals(early, late, clutter)
        return list(arrival_levels(rng, early, late, clutter))

    def _surface(self, item: SceneObject, tops: list[Top], odds: Mapping[str, float]) -> _Surface:
        """Return a support with the solids that are near it, and the strips of it that stay free."""
        low = item.position_m[2] + min(top.z for top in tops)
        reach = 0.5 * math.hypot(*item.size_m[:2]) + 1.0
        boxes = self._boxes
        near = (boxes[:, Z_HIGH] > low + 1e-6) & (np.hypot(boxes[:, X] - item.position_m[0], boxes[:, Y] - item.position_m[1]) < reach)
        on_it = [other for other in self._objects if other.support.id == item.id and other.category in self._source.rules.front_free]
        free = [kept_free(item, tops[0], other) for other in on_it]
        return _Surface(
            item,
            tops,
            Obstacles(boxes[near], self._owners[near]).with_more(box_rows(free)),
            odds,
        )

    def _place(self, rng: np.random.Generator, arrival: _Arrival, identifier: int) -> Placed | None:
        """Return the thing of an arrival, None where no place is free for it, nor for a second one that is tried then."""
        surface = self._surfaces.get(arrival.support)
        odds = self._floor_odds(disorder(arrival.level)) if surface is None else surface.odds
        names, shares = list(odds), [share / sum(odds.values()) for share in odds.values()]
        for _ in range(_KINDS_TRIED):
            chosen = draw_index(rng, shares)
            found = self._placed(rng, names[chosen], identifier, surface, disorder(arrival.level))
            if found is not None:
                return Placed(found, arrival.level, math.log(shares[chosen]))
        return None

    def _placed(self, rng: np.random.Generator, name: str, identifier: int, surface: _Surface | None, mess: float) -> SceneObject | None:
        """Return a thing of a category on a support, or on the floor where that is None, if a place is free."""
        thing, category = self._source.rules.things[name], self._source.categories[name]
        drawn = draw_thing_size(rng, thing)
        item = SceneObject(
            id=identifier,
            category=name,
            label=category.label_id,
            size_m=self._source.sizes_m.get(name, drawn),
            position_m=(0.0, 0.0, 0.0),
            yaw_rad=0.0,
            support=Support(kind="floor"),
            model=ModelReference(generator=name, seed=int(rng.integers(_MAX_SEED))),
            parts=(),
        )
        new = Newcomer(thing, category, item)
        if surface is None and mess == 0.0:
            return self._tidy_place(rng, new)
        if surface is None:
            return on_floor(rng, new, self._anchors, mess, self._inside, self._floor)
        return on_top(rng, new, surface.item, surface.tops, mess, surface.obstacles)

    def _tidy_place(self, rng: np.random.Generator, new: Newcomer) -> SceneObject | None:
        """Return a thing on the floor where a tidy person puts it, None where no place is free."""
        beside = self._source.rules.tidy_floor(self._source.grammar.looks_like).beside
        obstacles = self._floor.with_more(self._used)
        if beside == "furniture":
            return on_floor(rng, new, self._anchors, 0.0, self._inside, obstacles)
        return by_wall(rng, new, self._wall, self._doors if beside == "door" else (), self._inside, obstacles)

    def _floor_odds(self, mess: float) -> Mapping[str, float]:
        """Return the odds of what comes to the floor."""
        rules, room_type = self._source.rules, self._source.grammar.looks_like
        return rules.strewn(room_type) if mess > 0.0 else rules.tidy_floor(room_type).things

    def _occupy(self, support: int, item: SceneObject) -> None:
        """Put a thing in the way of those that come after it."""
        boxes, owners = object_solids(self._source.categories, [item])
        if support == FLOOR:
            self._floor = self._floor.with_more(boxes, owners)
        else:
            self._surfaces[support].obstacles = self._surfaces[support].obstacles.with_more(boxes, owners)

    def _inside(self, item: SceneObject) -> bool:
        x, y, _ = item.position_m
        c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        return bool(rectangle_outside(self._wall, x, y, c, s, 0.5 * item.size_m[0] + _WALL_M, 0.5 * item.size_m[1] + _WALL_M) <= 0.0)

    def _floor_obstacles(self) -> Obstacles:
        """Return what things on the floor keep off: solids, rugs, and where doors swing."""
        found = Obstacles(self._boxes, self._owners)
        for opening in self._room.openings:
            x, y, yaw = opening_frame(self._room, opening)
            zones = [zone for zone in opening_zones(opening, self._source.grammar.openings[opening.category]) if zone.kind == SWING]
            found = found.with_more(placed_zones(zones, x, y, opening.sill_m, yaw))
        return found.with_more(box_rows(whole_box(item) for item in self._objects if self._source.categories[item.category].underlay))
