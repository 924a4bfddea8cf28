"""Addresses of a derivation: what belongs to what, what may stand on what, which place is whose, and sizes that follow another object's.

An address terminal draws its target among what this room holds; ``within`` narrows that to one copy of a unit.  A corner of the room is a
target like a door or a window.  Everything here is drawn once, before the layout; only supporters are left to the chain.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, TypeVar

import numpy as np

from grammar.derivation.densities import cut_normal_log_density, draw_cut_normal, draw_index, size_log_density
from grammar.derivation.fixed import Pinned
from grammar.derivation.openings import Attribute
from grammar.derivation.parse_tree import Thing
from grammar.derivation.structure import Choice
from grammar.geometry.solids import surface_top
from grammar.geometry.walls import REFLEX, WALL_YAW, wall_lengths, wall_rows
from grammar.spec.categories import Categories
from grammar.spec.rules import CORNER, NONE, AroundMode, ObjectRule, PlaceMode, Tie
from scene_description import Opening, ParseNode, Room

Size = tuple[float, float, float]
_Mode = TypeVar("_Mode", AroundMode, PlaceMode)
_Sharing = tuple[int, tuple[AroundMode, ...]]
"""What things around one core have in common whose places are their own: the core's id and the list of places."""

_SIDES = {"depth": 0, "width": 1, "height": 2}
_SQUARE = 0.5
_CORNER_MARGIN_M = 0.15


class RejectedError(Exception):
    """The derivation breaks the constraint that the text names."""


class Corner(NamedTuple):
    """A corner of the room that points outwards: number of its vertex, place, yaw of the wall that begins there."""

    vertex: int
    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(slots=True, kw_only=True)
class Draft:
    """One thing while its addresses are drawn."""

    id: int
    symbol: str
    rule: ObjectRule
    size_m: Size
    units: Mapping[str, int]
    """Symbols of the nodes above it -> the nearest vertex of that name."""
    pinned: Pinned | None = None
    bottom_m: float = 0.0
    core: int | None = None
    mode: int | None = None
    drawn_axes: tuple[int, ...] = (0, 1, 2)
    settled: bool = False
    below: list[ParseNode] = field(default_factory=list)


class _Room(NamedTuple):
    """What addresses can point to."""

    categories: Categories
    room: Room
    things: Mapping[int, Draft]
    openings: Mapping[int, Opening]
    corners: tuple[Corner, ...]
    first_corner: int


def units_above(structure: Sequence[Choice], index: int) -> dict[str, int]:
    """Return the symbols of the nodes above a vertex and the nearest vertex of each."""
    found: dict[str, int] = {}
    parent = structure[index].parent
    while parent >= 0:
        found.setdefault(structure[parent].symbol, parent)
        parent = structure[parent].parent
    return found


def corners_of(room: Room) -> tuple[Corner, ...]:
    """Return the corners in which something can stand: those that point outwards and are nearly square."""
    wall = wall_rows(room.polygon_m)
    before = np.roll(wall, 1, 0)
    turn = before[:, 2] * wall[:, 2] + before[:, 3] * wall[:, 3]
    return tuple(
        Corner(w, float(wall[w, 0]), float(wall[w, 1]), float(wall[w, WALL_YAW]))
        for w in range(len(wall))
        if not wall[w, REFLEX] and abs(turn[w]) < _SQUARE
    )


def address_things(
    categories: Categories, room: Room, drafts: Sequence[Draft], rng: np.random.Generator
) -> tuple[list[tuple[Thing, list[ParseNode]]], tuple[Corner, ...]]:
    """Draw all addresses.

    Returns:
        things with the nodes below their terminals, neither yet with their places in the list of nodes; the corners that cores point to,
        with ids that follow those of the things.

    Raises:
        RejectedError: an address has no target, or a place is taken.
    """
    first = 1 + len(room.openings) + len(drafts)
    context = _Room(categories, room, {d.id: d for d in drafts}, {o.id: o for o in room.openings}, corners_of(room), first)
    for draft in drafts:
        _draw_core(draft, context, rng)
    for draft in drafts:
        _settle(draft, context, rng)
    _draw_places(drafts, context, rng)
    used = sorted({d.core for d in drafts if d.core is not None and d.core >= first})
    renamed = {old: first + k for k, old in enumerate(used)}
    things = [_finish(draft, context, renamed) for draft in drafts]
    return things, tuple(context.corners[old - first] for old in used)


def _targets(symbol: str, draft: Draft, context: _Room) -> list[int | None]:
    """Return the ids of what an address of a thing can point to under one symbol."""
    if symbol == NONE:
        return [None]
    if symbol in ("door", "window"):
        return [key for key, opening in context.openings.items() if opening.category == symbol]
    if symbol == CORNER:
        return [context.first_corner + k for k, corner in enumerate(context.corners) if _is_free(corner, draft, context)]
    found = [key for key, other in context.things.items() if other.symbol == symbol]
    unit = draft.rule.within
    if unit is not None:
        own = [key for key in found if context.things[key].units.get(unit) == draft.units.get(unit)]
        return list(own or found)
    return list(found)


def _is_free(corner: Corner, draft: Draft, context: _Room) -> bool:
    """Return whether nothing else was given a corner and no door, nor a window that the thing would cover, comes close to it."""
    if any(other.core == context.first_corner + context.corners.index(corner) for other in context.things.values()):
        return False
    lengths, reach = wall_lengths(context.room.polygon_m), max(draft.size_m[:2]) + _CORNER_MARGIN_M
    for opening in context.room.openings:
        if opening.category == "window" and draft.size_m[2] <= opening.sill_m:
            continue
        end = lengths[opening.wall] - opening.offset_m - opening.width_m
        following = (opening.wall + 1) % len(lengths)
        if (opening.wall == corner.vertex and opening.offset_m < reach) or (following == corner.vertex and end < reach):
            return False
    return True


def _draw_core(draft: Draft, context: _Room, rng: np.random.Generator) -> None:
    if draft.rule.cores is None or draft.pinned is not None:
        return
    targets, odds = _shared(draft.rule.cores, draft, context, None)
    if not targets:
        raise RejectedError(f"an object that {draft.symbol} belongs to")
    chosen = draw_index(rng, odds)
    draft.core = targets[chosen]
    name = NONE if draft.core is None else str(draft.core)
    if draft.core is not None and draft.core >= context.first_corner:
        name = f"{CORNER} {context.corners[draft.core - context.first_corner].vertex}"
    draft.below.append(ParseNode(symbol="core", kind="address", choice=name, log_probability=math.log(odds[chosen]), object=draft.id))


def _shared(
    weights: Mapping[str, float], draft: Draft, context: _Room, allowed: Sequence[int] | None
) -> tuple[list[int | None], list[float]]:
    """Return targets and their probabilities over what this room holds: a symbol's weight is shared evenly by its objects."""
    targets: list[int | None] = []
    shares: list[float] = []
    for symbol, weight in weights.items():
        found = [key for key in _targets(symbol, draft, context) if allowed is None or key in allowed]
        if weight > 0.0:
            targets.extend(found)
            shares.extend(weight / len(found) for _ in found)
    return targets, [share / sum(shares) for share in shares]


def _settle(draft: Draft, context: _Room, rng: np.random.Generator) -> None:
    """Give a thing the size and height that follow another one's, after that one's."""
    if draft.settled:
        return
    draft.settled = True
    rule, size, middle = draft.rule, list(draft.size_m), rule_middle(draft.rule)
    for tie in rule.tied if draft.pinned is None else ():
        key = _tied_to(tie, draft, context)
        if key is None:
            continue
        if key in context.things:
            _settle(context.things[key], context, rng)
        mean = tie.factor * _measure(tie, key, context) + tie.add_m
        if tie.axis == "middle":
            assert rule.centre_height_m is not None
            middle = (mean, tie.sd_m, rule.centre_height_m.low, rule.centre_height_m.high)
            continue
        side = _SIDES[tie.axis]
        size[side], log = _follow(rng, mean, tie.sd_m, rule.low_m[side], rule.high_m[side])
        draft.drawn_axes = tuple(axis for axis in draft.drawn_axes if axis != side)
        draft.below.append(_attribute(Attribute(f"{tie.axis}_of_{tie.to}", f"{size[side]:.3f} m", log), draft.id))
    draft.size_m = size[0], size[1], size[2]
    if rule.mount == "wall" and draft.size_m[1] >= max(wall_lengths(context.room.polygon_m)):
        raise RejectedError(f"a wall as wide as {draft.symbol}")
    if draft.pinned is None:
        _set_bottom(draft, middle, context.room, rng)


def rule_middle(rule: ObjectRule) -> tuple[float, float, float, float] | None:
    """Return mean, standard deviation and bounds of the height of what hangs."""
    height = rule.centre_height_m
    return None if height is None else (height.mean, height.sd, height.low, height.high)


def _set_bottom(draft: Draft, middle: tuple[float, float, float, float] | None, room: Room, rng: np.random.Generator) -> None:
    if draft.rule.mount == "ceiling":
        draft.bottom_m = room.height_m - draft.size_m[2]
    if middle is None:
        return
    centre, log = _follow(rng, *middle)
    draft.bottom_m = centre - 0.5 * draft.size_m[2]
    if draft.bottom_m < 0.0 or draft.bottom_m + draft.size_m[2] > room.height_m:
        raise RejectedError("things on walls between floor and ceiling")
    draft.below.append(_attribute(Attribute("centre_height", f"{centre:.3f} m", log), draft.id))


def _follow(rng: np.random.Generator, mean: float, sd: float, low: float, high: float) -> tuple[float, float]:
    if sd <= 0.0:
        return min(max(mean, low), high), 0.0
    value = draw_cut_normal(rng, mean, sd, low, high)
    return value, cut_normal_log_density(value, mean, sd, low, high)


def _tied_to(tie: Tie, draft: Draft, context: _Room) -> int | None:
    """Return what a size follows: the core if it is of that name, else the first of that name within the unit."""
    found = _targets(tie.to, draft, context)
    return draft.core if draft.core in found else next(iter(found), None)


def _measure(tie: Tie, key: int, context: _Room) -> float:
    if key in context.openings:
        opening = context.openings[key]
        size, bottom = (0.0, opening.width_m, opening.height_m), opening.sill_m
    else:
        size, bottom = context.things[key].size_m, context.things[key].bottom_m
    return {"bottom": bottom, "top": bottom + size[2]}.get(tie.of, size[_SIDES.get(tie.of, 0)])


def _draw_places(drafts: Sequence[Draft], context: _Room, rng: np.random.Generator) -> None:
    """Leave each thing the places around its core that are meant for that, and of these its own where every thing has its own."""
    taken: dict[_Sharing, set[int | str]] = {}
    sharing = Counter((draft.core, draft.rule.around) for draft in drafts if draft.core is not None)
    for draft in drafts:
        if draft.core is None:
            continue
        name = _name_of(draft.core, context)
        allowed = [k for k, mode in enumerate(draft.rule.around) if not mode.of or name in mode.of]
        if not allowed:
            raise RejectedError(f"a place for {draft.symbol} at {name}")
        shared = draft.core, draft.rule.around
        if draft.rule.one_each == "place" or (draft.rule.one_each == "side" and sharing[shared] > 1):
            allowed = _own_places(draft, draft.rule.one_each, name, allowed, taken.setdefault(shared, set()), rng)
        if len(allowed) < len(draft.rule.around):
            draft.rule = replace(draft.rule, around=_only(draft.rule.around, allowed))
    for draft in drafts:
        if draft.rule.same_place_as is None or draft.pinned is not None:
            continue
        like = next((context.things[key] for key in _targets(draft.rule.same_place_as, draft, context) if key is not None), None)
        if like is None or like.mode is None:
            raise RejectedError(f"a {draft.rule.same_place_as} whose place {draft.symbol} takes")
        draft.rule = replace(draft.rule, placements=_only(draft.rule.placements, [like.mode]))


def _own_places(
    draft: Draft, each: Literal["place", "side"], core: str, allowed: Sequence[int], used: set[int | str], rng: np.random.Generator
) -> list[int]:
    """Draw a place, or a side, that no other thing has and return the places that this leaves; it is added to ``used``."""
    around = draft.rule.around
    choices: dict[int | str, list[int]] = {}
    for k in allowed:
        choices.setdefault(k if each == "place" else around[k].side, []).append(k)
    free = [choice for choice in choices if choice not in used]
    if not free:
        raise RejectedError(f"a {each} of its own for every {draft.symbol} at {core}")
    odds = [sum(_odds(around[k]) for k in choices[choice]) for choice in free]
    shares = [p / sum(odds) for p in odds]
    drawn = draw_index(rng, shares)
    chosen = free[drawn]
    used.add(chosen)
    draft.mode = chosen if isinstance(chosen, int) else None
    draft.below.append(_attribute(Attribute(each, str(chosen), math.log(shares[drawn])), draft.id))
    return choices[chosen]


def _name_of(key: int, context: _Room) -> str:
    if key >= context.first_corner:
        return CORNER
    return context.openings[key].category if key in context.openings else context.things[key].symbol


def _odds(mode: AroundMode | PlaceMode) -> float:
    """Return a mode's probability, or the same for all where none is given."""
    return 1.0 if mode.probability is None else mode.probability


def _only(modes: Sequence[_Mode], places: Sequence[int]) -> tuple[_Mode, ...]:
    """Return some of an object's modes with their probabilities given that it is one of them."""
    kept = [modes[k] for k in places]
    if kept[0].probability is None:
        return tuple(kept)
    total = sum(map(_odds, kept))
    return tuple(replace(mode, probability=_odds(mode) / total) for mode in kept)


def _finish(draft: Draft, context: _Room, renamed: Mapping[int, int]) -> tuple[Thing, list[ParseNode]]:
    """Return one thing and the nodes below its terminal."""
    rule, pinned = draft.rule, draft.pinned
    asked = pinned is not None and pinned.sized
    size_log = 0.0 if asked else size_log_density(draft.size_m, rule, draft.drawn_axes)
    size_text = " x ".join(f"{side:.3f}" for side in draft.size_m) + f" m{' (requested)' if asked else ''}"
    below = [_attribute(Attribute("size", size_text, size_log), draft.id), *draft.below]
    stands: list[int] = []
    odds: list[float] = []
    if pinned is not None and pinned.on is not None:
        stands, odds = [pinned.on], [1.0]
    elif rule.supporters is not None:
        allowed = [key for key in context.things if _fits(context, key, draft.size_m)]
        found, odds = _shared(rule.supporters, draft, context, allowed)
        stands = [key for key in found if key is not None]
        if not stands:
            raise RejectedError(f"an object that {draft.symbol} can stand on")
    if stands:
        below.append(ParseNode(symbol="supporter", kind="address", object=draft.id))
    thing = Thing(
        id=draft.id,
        symbol=draft.symbol,
        rule=rule if pinned is None else replace(rule, wall=(), around=(), cores=None),
        size_m=draft.size_m,
        core=None if draft.core is None else renamed.get(draft.core, draft.core),
        supporters=tuple(stands),
        supporter_log_probability=tuple(math.log(p) for p in odds),
        bottom_m=draft.bottom_m if pinned is None else pinned.z_m,
        node=0,
        supporter_node=None,
        pinned=pinned,
    )
    return thing, below


def _fits(context: _Room, target: int, size: Size) -> bool:
    """Return whether a footprint fits on some top of a thing, turned by a quarter or not."""
    other = context.things[target]
    small, large = sorted(size[:2])
    tops = (sorted(surface_top(surface, other.size_m)[1:]) for surface in context.categories[other.rule.category].surfaces)
    return any(small <= 2.0 * top[0] and large <= 2.0 * top[1] for top in tops)


def _attribute(attribute: Attribute, identifier: int | None) -> ParseNode:
    return ParseNode(
        symbol=attribute.name, kind="attribute", choice=attribute.value, log_probability=attribute.log_probability, object=identifier
    )
