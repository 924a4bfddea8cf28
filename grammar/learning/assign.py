"""Matching observed objects with objects of the grammar, and finding their supporters and cores."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from grammar.layout.assemble import around_target
from grammar.learning.observed import ObservedObject, ObservedRoom, box_gap, is_supported_by, relative_pose, size_log_density
from grammar.spec.object_rules import NONE, AroundMode, ObjectRule
from grammar.spec.rules import Grammar

_SPREAD = 2.0
_NO_TARGET = math.log(1e-3)
_BOUNDS_FACTOR, _ABSURD_FACTOR = 1.6, 3.0
"""An object that is of no symbol's size by the first factor goes to the likeliest symbol of its category by the second."""

_GROUP_GAP_M = 1.0
_NEAR_PLACE_M = 0.3
_ALONE = 2.0
"""Cost of what stands for itself though a symbol of its category belongs to a core: less than what is 0.6 m off its place there."""

_RAISED_M = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class AssignedObject:
    """An observed object as object ``symbol`` of the grammar.

    ``on`` and ``core`` are indices into the room's list.  ``core`` is the nearest object that the symbol can belong to, at most a metre
    away (the threshold of Jiang et al., IJCV 2018, section 3.1) or beyond the symbol's places.  ``core_offered``: the room
    holds such an object, however far away.
    """

    symbol: str
    seen: ObservedObject
    on: int | None
    core: int | None
    core_offered: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class AssignedRoom:
    """A room with its objects that match objects of the grammar, and those ``left_over``, each with the index of what it stands on."""

    room: ObservedRoom
    objects: tuple[AssignedObject, ...]
    left_over: tuple[tuple[ObservedObject, int | None], ...]


def assign(grammar: Grammar, room: ObservedRoom, any_size: bool = False) -> AssignedRoom:
    """Match the objects of a room with the grammar's by category, size and supporter.

    ``any_size``: accept every size; otherwise objects far outside a rule's bounds do not match it.
    """
    symbols: list[str | None] = [None] * len(room.objects)
    on = [item.on if item.on is not None else _below(room.objects, i) for i, item in enumerate(room.objects)]
    for i in sorted(range(len(room.objects)), key=lambda i: (on[i] is not None, i)):
        below = on[i]
        symbols[i] = _symbol(grammar, room.objects[i], symbols[below] if below is not None else None, any_size, others=room.objects)
    _move_surplus(grammar, room.objects, symbols, on, any_size)
    kept = [i for i, symbol in enumerate(symbols) if symbol is not None]
    place = {i: k for k, i in enumerate(kept)}
    items: list[AssignedObject] = []
    for i in kept:
        symbol = symbols[i] or ""
        rule = grammar.objects[symbol]
        offered = [j for j in kept if j != i and rule.cores and (symbols[j] or "") in rule.cores]
        nearest = min(offered, key=lambda j: (box_gap(room.objects[i], room.objects[j]), j), default=None)
        near = nearest is not None and box_gap(room.objects[i], room.objects[nearest]) <= _GROUP_GAP_M + _furthest_place(rule)
        below = on[i]
        items.append(
            AssignedObject(
                symbol=symbol,
                seen=room.objects[i],
                on=place.get(below) if below is not None else None,
                core=place[nearest] if near and nearest is not None else None,
                core_offered=bool(offered),
            )
        )
    left_over = tuple((room.objects[i], on[i]) for i, symbol in enumerate(symbols) if symbol is None)
    return AssignedRoom(room=room, objects=tuple(items), left_over=left_over)


def _furthest_place(rule: ObjectRule) -> float:
    """Return the greatest gap in metres of the places around a core: what stands opposite belongs to it across the room."""
    return max((max(mode.gap_m, 0.0) for mode in rule.around), default=0.0)


def _move_surplus(
    grammar: Grammar, objects: Sequence[ObservedObject], symbols: list[str | None], on: Sequence[int | None], any_size: bool
) -> None:
    """Give objects beyond the exclusive places around a core their next likely symbol, if there is one, the furthest objects first."""
    taken: Counter[tuple[int, tuple[AroundMode, ...]]] = Counter()
    nearest: list[tuple[float, int, int, str]] = []
    for i, symbol in enumerate(symbols):
        rule = grammar.objects[symbol] if symbol is not None else None
        if symbol is not None and rule is not None and rule.one_each == "place":
            gaps = [(box_gap(objects[i], objects[j]), j) for j, other in enumerate(symbols) if j != i and other in (rule.cores or ())]
            nearest.extend((gap, i, j, symbol) for gap, j in sorted(gaps)[:1])
    for _, i, j, symbol in sorted(nearest):
        around = grammar.objects[symbol].around
        taken[j, around] += 1
        if taken[j, around] > len(around):
            below = on[i]
            symbols[i] = _symbol(grammar, objects[i], symbols[below] if below is not None else None, any_size, symbol, objects) or symbol


def _below(objects: Sequence[ObservedObject], i: int) -> int | None:
    """Return the index of the object with the highest top among those that an object stands on."""
    found = [j for j in range(len(objects)) if j != i and is_supported_by(objects[i], objects[j])]
    return max(found, key=lambda j: (objects[j].position_m[2] + objects[j].size_m[2], -j), default=None)


def _symbol(
    grammar: Grammar,
    item: ObservedObject,
    below: str | None,
    any_size: bool,
    other_than: str | None = None,
    others: Sequence[ObservedObject] = (),
) -> str | None:
    """Return the most likely symbol of an object, or None if no rule of its category is near its size.

    ``below`` is the symbol of its supporter; ``other_than`` a symbol that does not count; ``others`` the objects of the room.
    """
    known = [(symbol, rule) for symbol, rule in grammar.objects.items() if symbol != other_than and is_of(symbol, rule, item)]
    rivals = [(symbol, rule) for symbol, rule in known if _plausible(rule, item.size_m, _BOUNDS_FACTOR)]
    rivals = rivals or [(symbol, rule) for symbol, rule in known if any_size or _plausible(rule, item.size_m, _ABSURD_FACTOR)]
    if len(rivals) < 2:
        return rivals[0][0] if rivals else None
    scores: list[tuple[float, str]] = []
    for symbol, rule in rivals:
        score = size_log_density(item.size_m, rule.sizes, _SPREAD) - _place_cost(grammar, rule, item, others)
        if rule.mount == "object":
            share = (rule.supporters or {}).get(below or NONE, 0.0)
            score += math.log(share) if share > 0.0 else _NO_TARGET
        elif below is not None or (rule.mount == "wall") != (item.position_m[2] > _RAISED_M):
            score += _NO_TARGET
        scores.append((score, symbol))
    return max(scores, key=lambda scored: scored[0])[1]


def is_of(symbol: str, rule: ObjectRule, item: ObservedObject) -> bool:
    """Return whether an object can be of a symbol: of its category, and of its name where the category is one of many unknown names."""
    return rule.category == item.category and (not item.name or item.name == symbol)


def _place_cost(grammar: Grammar, rule: ObjectRule, item: ObservedObject, others: Sequence[ObservedObject]) -> float:
    """Return what it costs a symbol that an object is far from all places around the cores in the room, or stands for itself."""
    if not rule.cores or not rule.around:
        return _ALONE
    categories = {grammar.objects[core].category for core in rule.cores if core in grammar.objects}
    if not categories:
        return 0.0
    least = _ALONE if NONE in rule.cores else -_NO_TARGET
    for other in others:
        if other is not item and other.category in categories:
            place = relative_pose(item, other)
            for mode in rule.around:
                x, y, _ = around_target(mode, item.size_m, other.size_m)
                x = place.x_m if rule.mount == "wall" else x
                least = min(least, math.hypot(place.x_m - x, place.y_m - y) / _NEAR_PLACE_M)
    return least


def _plausible(rule: ObjectRule, size_m: Sequence[float], factor: float) -> bool:
    """Return whether no side is beyond the rule's bounds by more than a factor; thin sides get an absolute tolerance."""
    axes = zip(size_m, rule.low_m, rule.high_m, strict=True)
    return all(low / factor - 0.05 <= side <= high * factor + 0.05 for side, low, high in axes)
