"""Ties: sizes and heights that follow those of another object or opening, and the heights of objects that hang."""

from __future__ import annotations

import numpy as np

from grammar.derivation.densities import draw_height, draw_truncated_normal, truncated_normal_log_density
from grammar.derivation.drafts import Context, Draft, attribute_node, targets_of
from grammar.derivation.openings import Attribute
from grammar.derivation.rejection import RejectedError
from grammar.geometry.walls import wall_lengths
from grammar.spec.object_rules import CORE, Tie

Distribution = tuple[float, float, float, float]
"""Mean, standard deviation and bounds of a truncated normal distribution."""

_AXES = {"depth": 0, "width": 1, "height": 2}


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
        draft.below.append(attribute_node(Attribute(f"{tie.axis}_of_{tie.to}", f"{size[axis]:.3f} m", log), draft.id))
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
    draft.below.append(attribute_node(Attribute("centre_height", f"{centre:.3f} m", log), draft.id))


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
