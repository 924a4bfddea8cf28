"""Address terminals of a derivation: which core an object belongs to, and what it may stand on (Jiang et al., IJCV 2018, section 2).

Cores, ties and places are drawn here once, before the layout.  Supporters are only listed with their probabilities: the chain chooses.
"""

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal, TypeVar

import numpy as np

from grammar.derivation.densities import draw_height, draw_index, draw_truncated_normal, size_log_density, truncated_normal_log_density
from grammar.derivation.drafts import Context, Corner, Draft, Size, corners_of, target_probabilities, targets_of
from grammar.derivation.parse_tree import Attribute, Item, RejectedError, attribute_node
from grammar.geometry.solids import surface_top
from grammar.geometry.walls import wall_lengths
from grammar.spec.categories import Categories
from grammar.spec.object_rules import CORE, CORNER, NONE, AroundMode, ObjectRule, PlaceMode, Tie
from grammar.spec.room_rules import OPENINGS
from grammar.spec.run_rules import HANGING_LOW_M
from scene_description import ParseNode, Room

_LINE_ODDS = 8.0
"""How many times as likely as elsewhere something hangs in line beside what hangs or stands there."""


_OF_THE_ROOM = frozenset({NONE, CORNER, *OPENINGS})
"""What addresses name beside objects."""

_Mode = TypeVar("_Mode", AroundMode, PlaceMode)
_Group = tuple[int, tuple[AroundMode, ...]]
"""What objects have in common whose places exclude each other: the core's id and the list of modes."""

Distribution = tuple[float, float, float, float]
"""Mean, standard deviation and bounds of a truncated normal distribution."""

_AXES = {"depth": 0, "width": 1, "height": 2}


def check_targets(addressed: Iterable[tuple[str, ObjectRule]], symbols: Collection[str]) -> None:
    """Reject a structure that lacks all objects that an address may point to, before anything else of it is drawn.

    Raises:
        RejectedError: an address has no target, whatever the room and the sizes are.
    """
    present = _OF_THE_ROOM.union(symbols)
    for symbol, rule in addressed:
        if rule.cores is not None and present.isdisjoint(rule.cores):
            raise RejectedError(f"an object that {symbol} belongs to")
        if rule.supporters is not None and present.isdisjoint(rule.supporters):
            raise RejectedError(f"an object that {symbol} can stand on")


def draw_addresses(
    categories: Categories, room: Room, drafts: Sequence[Draft], rng: np.random.Generator
) -> tuple[list[tuple[Item, list[ParseNode]]], tuple[Corner, ...]]:
    """Draw all addresses.

    Returns:
        items with the nodes below their terminals, neither yet with their indices in the list of nodes; the corners that cores point to,
        with ids that follow those of the items.

    Raises:
        RejectedError: an address has no target, or a place is taken.
    """
    first = 1 + len(room.openings) + len(drafts)
    context = Context(categories, room, {d.id: d for d in drafts}, {o.id: o for o in room.openings}, corners_of(room), first)
    for draft in drafts:
        _draw_core(draft, context, rng)
    for draft in drafts:
        resolve_ties(draft, context, rng)
    draw_places(drafts, context, rng)
    # number the corners that are used without gaps
    used = sorted({d.core for d in drafts if d.core is not None and d.core >= first})
    renumbered = {old: first + k for k, old in enumerate(used)}
    items = [_finish(draft, context, renumbered) for draft in drafts]
    return items, tuple(context.corners[old - first] for old in used)


def _draw_core(draft: Draft, context: Context, rng: np.random.Generator) -> None:
    if draft.rule.cores is None or draft.pinned is not None:
        return
    allowed = _carriers(draft, context) if draft.rule.in_line else None
    targets, probabilities = target_probabilities(draft.rule.cores, draft, context, allowed)
    if not targets:
        raise RejectedError(f"an object that {draft.symbol} belongs to")
    if draft.rule.in_line:
        probabilities = _closing_line(targets, probabilities, context)
    chosen = draw_index(rng, probabilities)
    draft.core = targets[chosen]
    name = NONE if draft.core is None else str(draft.core)
    if draft.core is not None and draft.core >= context.first_corner:
        name = f"{CORNER} {context.corners[draft.core - context.first_corner].vertex}"
    log_probability = math.log(probabilities[chosen])
    draft.below.append(ParseNode(symbol="core", kind="address", choice=name, log_probability=log_probability, object=draft.id))


def _carriers(draft: Draft, context: Context) -> list[int]:
    """Return the objects above which ``draft`` may hang in line: units of rows under free wall, that carry nothing yet."""
    taken = {other.core for other in context.drafts.values() if other.rule.in_line}
    return [key for key, other in context.drafts.items() if other.carries and key not in taken]


def _closing_line(targets: Sequence[int | None], probabilities: Sequence[float], context: Context) -> list[float]:
    """Return the probabilities of targets, those raised whose neighbours in the unit row carry something already or stand as high."""
    filled = {other.core for other in context.drafts.values() if other.rule.in_line}
    filled |= {key for key, other in context.drafts.items() if other.beside and other.size_m[2] > HANGING_LOW_M}
    weights = [
        share * (_LINE_ODDS if target is not None and filled.intersection(context.drafts[target].beside) else 1.0)
        for target, share in zip(targets, probabilities, strict=True)
    ]
    return [weight / sum(weights) for weight in weights]


def _finish(draft: Draft, context: Context, renumbered: Mapping[int, int]) -> tuple[Item, list[ParseNode]]:
    """Return an object with its supporters, and the nodes below its terminal."""
    rule, pinned = draft.rule, draft.pinned
    supporters, probabilities = _supporters(draft, context)
    below = [_size_node(draft), *draft.below]
    if supporters:
        below.append(ParseNode(symbol="supporter", kind="address", object=draft.id))
    item = Item(
        id=draft.id,
        symbol=draft.symbol,
        rule=_at_opening(rule, draft, context) if pinned is None else replace(rule, wall=(), around=(), cores=None),
        size_m=draft.size_m,
        core=None if draft.core is None else renumbered.get(draft.core, draft.core),
        supporters=tuple(supporters),
        supporter_log_probability=tuple(math.log(p) for p in probabilities),
        bottom_m=draft.bottom_m if pinned is None else pinned.z_m,
        node=0,
        supporter_node=None,
        pinned=pinned,
        behind_m=draft.behind_m,
    )
    return item, below


def _at_opening(rule: ObjectRule, draft: Draft, context: Context) -> ObjectRule:
    """Return the rule with the sides of its places told for the hinge of the door that the object belongs to, if it does to one."""
    door = context.openings.get(draft.core or 0)
    return rule if door is None else replace(rule, around=tuple(mode.at_door(door.hinge) for mode in rule.around))


def _size_node(draft: Draft) -> ParseNode:
    """Return the node of an object's size, with the log-density of the axes that were drawn from the mixture."""
    requested = draft.pinned is not None and draft.pinned.sized
    log_density = 0.0 if requested else size_log_density(draft.size_m, draft.rule, draft.drawn_axes)
    text = " x ".join(f"{side:.3f}" for side in draft.size_m) + f" m{' (requested)' if requested else ''}"
    return attribute_node(Attribute("size", text, log_density), draft.id)


def _supporters(draft: Draft, context: Context) -> tuple[list[int], list[float]]:
    """Return the ids of what an object may stand on and their probabilities; nothing for what does not stand on objects."""
    if draft.pinned is not None and draft.pinned.on is not None:
        return [draft.pinned.on], [1.0]
    if draft.rule.supporters is None:
        return [], []
    allowed = [key for key in context.drafts if _fits(context, key, draft.size_m)]
    found, probabilities = target_probabilities(draft.rule.supporters, draft, context, allowed)
    supporters = [key for key in found if key is not None]
    if not supporters:
        raise RejectedError(f"an object that {draft.symbol} can stand on")
    return supporters, probabilities


def _fits(context: Context, target: int, size_m: Size) -> bool:
    """Return whether a footprint fits on some support surface of an object, turned by a quarter or not."""
    other = context.drafts[target]
    small, large = sorted(size_m[:2])
    surfaces = (sorted(surface_top(surface, other.size_m)[1:]) for surface in context.categories[other.rule.category].surfaces)
    return any(small <= 2.0 * surface[0] and large <= 2.0 * surface[1] for surface in surfaces)


def draw_places(drafts: Sequence[Draft], context: Context, rng: np.random.Generator) -> None:
    """Restrict the modes of each object to those that are meant for its core and, where places are exclusive, to its own.

    Raises:
        RejectedError: no mode is left for an object.
    """
    taken: dict[_Group, set[int | str]] = {}
    group_size = Counter((draft.core, draft.rule.around) for draft in drafts if draft.core is not None)
    for draft in drafts:
        if draft.core is None:
            continue
        name = context.symbol_of(draft.core)
        allowed = [k for k, mode in enumerate(draft.rule.around) if not mode.of or name in mode.of]
        if not allowed:
            raise RejectedError(f"a place for {draft.symbol} at {name}")
        group = draft.core, draft.rule.around
        if draft.rule.one_each == "place" or (draft.rule.one_each == "side" and group_size[group] > 1):
            allowed = _draw_own(draft, draft.rule.one_each, name, allowed, taken.setdefault(group, set()), rng)
        if len(allowed) < len(draft.rule.around):
            draft.rule = replace(draft.rule, around=_only(draft.rule.around, allowed))
    for draft in drafts:
        if draft.rule.same_place_as is not None and draft.pinned is None:
            _follow_place(draft, draft.rule.same_place_as, context)


def _follow_place(draft: Draft, leader: str, context: Context) -> None:
    """Restrict the placements of an object to the one with the number of the mode that ``leader`` has around its core."""
    found = next((context.drafts[key] for key in targets_of(leader, draft, context) if key is not None), None)
    if found is None or found.mode is None:
        raise RejectedError(f"a {leader} whose place {draft.symbol} takes")
    draft.rule = replace(draft.rule, placements=_only(draft.rule.placements, [found.mode]))


def _draw_own(
    draft: Draft, each: Literal["place", "side"], core: str, allowed: Sequence[int], used: set[int | str], rng: np.random.Generator
) -> list[int]:
    """Draw a place, or a side, that no other object has and return the modes that this leaves; it is added to ``used``."""
    around = draft.rule.around
    choices: dict[int | str, list[int]] = {}
    for k in allowed:
        choices.setdefault(k if each == "place" else around[k].side, []).append(k)
    free = [choice for choice in choices if choice not in used]
    if not free:
        raise RejectedError(f"a {each} of its own for every {draft.symbol} at {core}")
    weights = [sum(_weight(around[k]) for k in choices[choice]) for choice in free]
    shares = [p / sum(weights) for p in weights]
    drawn = draw_index(rng, shares)
    chosen = free[drawn]
    used.add(chosen)
    draft.mode = chosen if isinstance(chosen, int) else None
    draft.note(each, str(chosen), math.log(shares[drawn]))
    return choices[chosen]


def _weight(mode: AroundMode | PlaceMode) -> float:
    """Return a mode's probability, or 1 for every mode where none is given."""
    return 1.0 if mode.probability is None else mode.probability


def _only(modes: Sequence[_Mode], kept: Sequence[int]) -> tuple[_Mode, ...]:
    """Return some of a relation's modes with their probabilities given that it is one of them."""
    chosen = [modes[k] for k in kept]
    if chosen[0].probability is None:
        return tuple(chosen)
    total = sum(map(_weight, chosen))
    return tuple(replace(mode, probability=_weight(mode) / total) for mode in chosen)


def resolve_ties(draft: Draft, context: Context, rng: np.random.Generator) -> None:
    """Give an object the sizes and the height that follow another one's, which is resolved first.

    Raises:
        RejectedError: the object is wider than every wall, or hangs through the floor or the ceiling.
    """
    if draft.ties_resolved:
        return
    draft.ties_resolved = True
    rule, size = draft.rule, list(draft.size_m)
    middle: Distribution | None = None
    for tie in rule.tied if draft.pinned is None else ():
        target = _target(tie, draft, context)
        if target is None:
            continue
        if target in context.drafts:
            resolve_ties(context.drafts[target], context, rng)
        mean = tie.factor * _measure(tie, target, context) + tie.add_m
        if tie.axis == "middle":
            assert rule.centre_height_m is not None
            middle = (mean, tie.sd_m, rule.centre_height_m.low, rule.centre_height_m.high)
            continue
        axis = _AXES[tie.axis]
        size[axis], log = _draw_about(rng, (mean, tie.sd_m, rule.low_m[axis], rule.high_m[axis]))
        draft.drawn_axes = tuple(other for other in draft.drawn_axes if other != axis)
        draft.note(f"{tie.axis}_of_{tie.to}", f"{size[axis]:.3f} m", log)
    draft.size_m = size[0], size[1], size[2]
    if rule.mount == "wall" and draft.size_m[1] >= max(wall_lengths(context.room.polygon_m)):
        raise RejectedError(f"a wall as wide as {draft.symbol}")
    if draft.pinned is None:
        _set_bottom(draft, middle, context, rng)


def _set_bottom(draft: Draft, middle: Distribution | None, context: Context, rng: np.random.Generator) -> None:
    """Set the height of the underside of what hangs; ``middle`` is the distribution of the middle's height where that is tied."""
    room = context.room
    if draft.rule.mount == "ceiling":
        draft.bottom_m = room.height_m - draft.size_m[2]
    if draft.rule.centre_height_m is None:
        return
    level = _level_of_line(draft, context)
    if level is not None:
        middle = level + 0.5 * draft.size_m[2], 0.0, 0.0, room.height_m
    centre, log = draw_height(rng, draft.rule) if middle is None else _draw_about(rng, middle)
    draft.bottom_m = centre - 0.5 * draft.size_m[2]
    if draft.bottom_m < 0.0 or draft.bottom_m + draft.size_m[2] > room.height_m:
        raise RejectedError("objects on walls between floor and ceiling")
    draft.note("centre_height", f"{centre:.3f} m", log)


def _level_of_line(draft: Draft, context: Context) -> float | None:
    """Return the height of the underside that what hangs in line already has, if heights of the line are drawn from a mixture."""
    if not (draft.rule.in_line and draft.rule.heights):
        return None
    hung = [other for other in context.drafts.values() if other is not draft and other.rule.in_line and other.rule.heights]
    found = [other.pinned.z_m for other in hung if other.pinned is not None] + [
        o.bottom_m for o in hung if o.ties_resolved and o.bottom_m > 0.0
    ]
    return next(iter(found), None)


def _draw_about(rng: np.random.Generator, distribution: Distribution) -> tuple[float, float]:
    """Return a value and its log-density; with a standard deviation of 0 the value is the mean, clamped, and nothing is drawn."""
    mean, sd, low, high = distribution
    if sd <= 0.0:
        return min(max(mean, low), high), 0.0
    value = draw_truncated_normal(rng, mean, sd, low, high)
    return value, truncated_normal_log_density(value, mean, sd, low, high)


def _target(tie: Tie, draft: Draft, context: Context) -> int | None:
    """Return the id of what a tie follows: the core if that is asked for by its symbol or as such, else the first other such object."""
    if tie.to == CORE:
        return draft.core
    found = targets_of(tie.to, draft, context)
    return draft.core if draft.core in found else next(iter(found), None)


def _measure(tie: Tie, target: int, context: Context) -> float:
    """Return the size or height of the target that a tie follows, in metres."""
    if target in context.openings:
        opening = context.openings[target]
        size, bottom = (0.0, opening.width_m, opening.height_m), opening.sill_m
    else:
        size, bottom = context.drafts[target].size_m, context.drafts[target].bottom_m
    return {"bottom": bottom, "top": bottom + size[2]}.get(tie.of, size[_AXES.get(tie.of, 0)])
