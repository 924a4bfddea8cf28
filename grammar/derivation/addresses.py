"""Address terminals of a derivation: which core an object belongs to, and what it may stand on (Jiang et al., IJCV 2018, section 2).

Cores, ties and places are drawn here once, before the layout.  Supporters are only listed with their probabilities: the chain chooses.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.derivation.densities import draw_index, size_log_density
from grammar.derivation.drafts import Context, Corner, Draft, Size, attribute_node, corners_of, target_probabilities
from grammar.derivation.openings import Attribute
from grammar.derivation.parse_tree import Item
from grammar.derivation.places import draw_places
from grammar.derivation.rejection import RejectedError
from grammar.derivation.ties import resolve_ties
from grammar.geometry.solids import surface_top
from grammar.spec.categories import Categories
from grammar.spec.object_rules import CORNER, NONE, ObjectRule
from grammar.spec.room_rules import OPENINGS
from grammar.spec.run_rules import HANGING_LOW_M
from scene_description import ParseNode, Room

_LINE_ODDS = 8.0
"""How many times as likely as elsewhere something hangs in line beside what hangs or stands there."""


_OF_THE_ROOM = frozenset({NONE, CORNER, *OPENINGS})
"""What addresses name beside objects."""


def check_targets(addressed: Iterable[tuple[str, ObjectRule]], symbols: Collection[str]) -> None:
    """Reject a structure that lacks all objects that an address may point to, before anything else of it is drawn.

    Args:
        addressed: symbols and rules of the objects whose addresses are drawn.
        symbols: of all objects.

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
    """Return the objects above which ``draft`` may hang in line: units of runs under free wall, that carry nothing yet."""
    taken = {other.core for other in context.drafts.values() if other.rule.in_line}
    return [key for key, other in context.drafts.items() if other.carries and key not in taken]


def _closing_line(targets: Sequence[int | None], probabilities: Sequence[float], context: Context) -> list[float]:
    """Return the probabilities of targets, those raised whose neighbours in the run carry something already or stand as high."""
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
