"""Places: which modes of its relation an object may take, where objects around one core exclude each other or follow each other."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypeVar

import numpy as np

from grammar.derivation.densities import draw_index
from grammar.derivation.drafts import Context, Draft, attribute_node, targets_of
from grammar.derivation.openings import Attribute
from grammar.derivation.rejection import RejectedError
from grammar.spec.object_rules import AroundMode, PlaceMode

_Mode = TypeVar("_Mode", AroundMode, PlaceMode)
_Group = tuple[int, tuple[AroundMode, ...]]
"""What objects have in common whose places exclude each other: the core's id and the list of modes."""


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
    draft.below.append(attribute_node(Attribute(each, str(chosen), math.log(shares[drawn])), draft.id))
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
