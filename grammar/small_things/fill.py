"""Filling a room with small things, one after the other in the order in which growing clutter brings them.

The things of a site are the events of a Poisson process whose time is the clutter, so every clutter contains what smaller ones have.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from grammar.derivation.constraints import numbers_asked
from grammar.derivation.densities import draw_index
from grammar.geometry.boxes import box_rows
from grammar.geometry.solids import local_solids
from grammar.small_things.groups import members
from grammar.small_things.place import Newcomer, Top, draw_thing_size, kept_free, tops_of
from grammar.small_things.rules import SmallThings, Stock
from grammar.small_things.sites import HookSite, Site, Surroundings, TopSite, floor_site, opening_boxes, wall_site
from grammar.spec.categories import Categories
from grammar.spec.request import SceneRequest
from grammar.spec.rules import Grammar
from scene_description import ModelReference, Room, SceneObject, Support
from scene_description.polygons import signed_area_m2

BARE_SHARE = 0.25
"""Least share of a support's count that comes up to clutter 1, however much the grammar stands there itself."""

TIDY = 1.0
"""Clutter up to which rooms are in order."""

_MESSY = 3.0


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
        need, first = float(rng.standard_exponential()), early * max(TIDY - level, 0.0)
        if need < first:
            level += need / early
        elif late > 0.0:
            level = max(level, TIDY) + (need - first) / late
        else:
            return
        if level > until:
            return
        yield level


def mean_arrivals(early: float, late: float, until: float) -> float:
    """Return the mean number of things that come up to the level ``until``; the arguments are those of :func:`arrival_levels`."""
    return early * min(until, TIDY) + late * max(until - TIDY, 0.0)


def disorder(level: float) -> float:
    """Return how far from its tidy place a thing lies that comes at a level of clutter: 0 up to clutter 1, 1 from clutter 3."""
    return min(max((level - TIDY) / (_MESSY - TIDY), 0.0), 1.0)


class Key(NamedTuple):
    """Names a site: its kind, and the object that it belongs to, whose ids count from 1; 0 for the room's own."""

    kind: int
    owner: int = 0


_TOP, _WALL, _HOOK, _FITTING = 1, 2, 3, 4
FLOOR, WALLS, FITTINGS = Key(_TOP), Key(_WALL), Key(_FITTING)

_MAX_SEED = 2**63 - 1
_KINDS_TRIED = 4
_LEAST_GROWTH, _MOST_GROWTH = 0.5, 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What small things are drawn from: their rules, grammar and categories of the room, the request, and sizes that models fix.

    ``held``: categories whose models may be files, so that nothing of theirs opens.
    """

    rules: SmallThings
    grammar: Grammar
    categories: Categories
    request: SceneRequest
    sizes_m: Mapping[str, tuple[float, float, float]]
    held: frozenset[str] = frozenset()


class Placed(NamedTuple):
    """A small thing in its place: the level of clutter at which it comes, its site, and log-probabilities.

    ``group`` names the group that it belongs to, ``core`` whether it is its core.  The log-probabilities are those of what was drawn at its
    site (of a core its group), of the number of its kind in the group, and of the supporter in the group where it chose one.
    """

    item: SceneObject
    level: float
    site: Key
    log_probability: float
    group: str = ""
    core: bool = True
    log_address: float | None = None


class _Arrival(NamedTuple):
    level: float
    site: Key
    number: int


class Filling:
    """Sites of a room while small things come.

    ``objects``: what stands in it at clutter 1, before small things are taken away or added; ``blocked``: what else is in the way;
    ``still``: furniture that carries nothing; ``root``: seed of all that is drawn; every thing has a stream of its own.
    """

    def __init__(
        self,
        source: Source,
        room: Room,
        objects: Sequence[SceneObject],
        root: int,
        blocked: Sequence[SceneObject] = (),
        still: frozenset[int] = frozenset(),
    ) -> None:
        self._source, self._room, self._objects, self._root, self._still = source, room, objects, root, still
        self._around = Surroundings(source.categories, room, objects)
        for item in blocked:
            self._around.add(item)
        self._sites: dict[Key, Site] = {}
        self._means: dict[Key, float] = {}
        self._number = Counter(item.category for item in objects)
        self._next = max((item.id for item in objects), default=len(room.openings)) + 1

    def things(self, there: Sequence[SceneObject], since: float = 0.0) -> Iterator[Placed]:
        """Yield the small things that come up to the clutter asked for, in that order, with ids after all others.

        ``there``: the objects that count for what a request allows at most; ``since``: level after which things come.
        """
        request = self._source.request
        most: dict[str, int] = {}
        for name, _, high, _ in numbers_asked(request, self._source.categories):
            most[name] = min(high, most.get(name, high))
        count, total = Counter(item.category for item in there), len(there)

        def allowed(name: str) -> bool:
            return total < request.max_objects and count[name] < most.get(name, math.inf)

        for arrival in sorted(arrival for arrival in self._arrivals() if arrival.level > since):
            if total >= request.max_objects:
                return
            rng = np.random.default_rng([self._root, *arrival.site[:2], arrival.number])
            for placed in self._place(rng, arrival, allowed):
                count[placed.item.category] += 1
                total += 1
                yield placed

    def mean(self, site: Key) -> float:
        """Return the mean number of things and groups that come to a site up to the clutter asked for."""
        return self._means[site]

    def _arrivals(self) -> Iterator[_Arrival]:
        """Yield what comes to each site; those to which something comes are prepared."""
        rules, grammar = self._source.rules, self._source.grammar
        rows, openings = rules.rows_of(grammar), opening_boxes(grammar, self._room, swings=False)
        carried = Counter(item.support.id for item in self._objects if item.support.kind == "object")
        for item in self._objects:
            hung = rules.hooks.get(item.category)
            if hung is not None and item.support.kind == "wall":
                yield from self._levels(Key(_HOOK, item.id), hung.count, 0.5 * hung.count, partial(HookSite, hung.things, openings, item))
            stock = rules.stock(item.category, rows)
            if stock is not None and item.id not in self._still:
                yield from self._on_object(item, stock, carried[item.id])
        tidy, strewn = rules.tidy_floor(rows), rules.floor.per_m2 * signed_area_m2(self._room.polygon_m)
        args = (grammar, self._source.categories, self._room, self._objects)
        yield from self._levels(FLOOR, tidy.count, strewn, lambda: floor_site(rules, *args))
        for key, stocks, more in ((WALLS, rules.walls, 0.25), (FITTINGS, rules.fittings, 0.0)):
            stock = stocks.get(rows)
            if stock is not None:
                yield from self._levels(key, stock.count, more * stock.count, partial(wall_site, rules, stock.things, *args))

    def _on_object(self, item: SceneObject, stock: Stock, carried: int) -> Iterator[_Arrival]:
        """Yield what comes to the surfaces of furniture."""
        support = self._source.rules.supports[item.category]
        tops = tuple(tops_of(self._source.categories[item.category], item, seat=support.seat))
        area = sum(top.area_m2 for top in tops)
        growth = min(max(area / support.area_m2, _LEAST_GROWTH), _MOST_GROWTH) if area > 0.0 else 0.0
        early, tidy = early_rate(growth * stock.count, carried), stock.things
        if support.seat:
            early, tidy = (growth * support.tidy.count, support.tidy.things) if support.tidy else (0.0, {})
        yield from self._levels(Key(_TOP, item.id), early, growth * stock.count, lambda: self._top(item, tops, tidy, stock.things))

    def _levels(self, key: Key, early: float, late: float, site: Callable[[], Site]) -> Iterator[_Arrival]:
        rng, clutter = np.random.default_rng([self._root, *key]), self._source.request.clutter
        self._means[key] = mean_arrivals(early, late, clutter)
        levels = list(arrival_levels(rng, early, late, clutter))
        if levels:
            self._sites[key] = site()
        return (_Arrival(level, key, k) for k, level in enumerate(levels))

    def _top(self, item: SceneObject, tops: tuple[Top, ...], tidy: Mapping[str, float], late: Mapping[str, float]) -> TopSite:
        """Return a support with the strips of it that stay free."""
        wide = self._source.rules.front_free
        free = [kept_free(item, tops[0], other) for other in self._objects if other.support.id == item.id and other.category in wide]
        return TopSite(item, tops, tidy, late, box_rows(free))

    def _place(self, rng: np.random.Generator, arrival: _Arrival, allowed: Callable[[str], bool]) -> Iterator[Placed]:
        """Yield what an arrival brings, a thing or a group; nothing where no place is free for it, nor for others that are tried."""
        site, rules, mess = self._sites[arrival.site], self._source.rules, disorder(arrival.level)
        odds = site.odds(mess)
        names, shares = list(odds), [share / sum(odds.values()) for share in odds.values()]
        for _ in range(_KINDS_TRIED if names else 0):
            chosen = draw_index(rng, shares)
            group = rules.groups.get(names[chosen])
            name = group.core if group else names[chosen]
            if self._number[name] >= rules.things[name].most:
                continue
            found = site.place(rng, self._new(rng, name), mess, self._around)
            if found is None:
                continue
            if not allowed(name):
                return
            found = self._settled(found)
            yield Placed(found, arrival.level, arrival.site, math.log(shares[chosen]), names[chosen] if group else "")
            if group:
                carrier = site.carrier()
                make = lambda one: self._new(rng, one) if allowed(one) else None  # noqa: E731
                for joined in members(rng, group, found, carrier, mess, self._around, make):
                    item = self._settled(joined.item)
                    yield Placed(item, arrival.level, arrival.site, joined.log_count, names[chosen], False, joined.log_address)
            return

    def _settled(self, item: SceneObject) -> SceneObject:
        """Return a thing in its place after it is put in the way of those that come after it."""
        self._around.add(item)
        self._number[item.category] += 1
        self._next += 1
        return item

    def _new(self, rng: np.random.Generator, name: str) -> Newcomer:
        """Return a thing of a category without a place."""
        thing, category = self._source.rules.things[name], self._source.categories[name]
        drawn = draw_thing_size(rng, thing)
        item = SceneObject(
            id=self._next,
            category=name,
            label=category.label_id,
            size_m=self._source.sizes_m.get(name, drawn),
            position_m=(0.0, 0.0, 0.0),
            yaw_rad=0.0,
            support=Support(kind="floor"),
            model=ModelReference(generator=name, seed=int(rng.integers(_MAX_SEED))),
            parts=(),
        )
        return Newcomer(thing, item, local_solids(category, item.size_m))
