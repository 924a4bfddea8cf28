"""What is tall below a sloped ceiling: how high things reach with what stands on them, and whether walls are high enough for them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from grammar.derivation.rejection import RejectedError
from grammar.geometry.slopes import low_ceiling
from grammar.geometry.solids import surface_top
from grammar.geometry.wall_spans import free_spans
from grammar.geometry.zones import SWING, VIEW, opening_frame, opening_zones, placed_zones
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule
from grammar.spec.room_rules import OPENINGS
from grammar.spec.rules import Grammar
from scene_description import Room

Size = tuple[float, float, float]
Thing = tuple[str, ObjectRule, Size]
"""Symbol, rule and size of an object."""

_LOW_M, _STORE_DEPTH_M, _SLACK = 0.2, 0.6, 1.7
"""Tall is what is so much higher than the eaves.  Outside of runs it needs a wall with floor so deep, and so many times its own width."""

_MOST_STACKED = 4
"""Things on things on a thing that are added up."""


def loaded_heights_m(categories: Categories, things: Sequence[Thing]) -> list[float]:
    """Return how high each thing is together with the highest thing that may stand on its lowest surface, and so on."""
    found = [size[2] for _, _, size in things]
    for _ in range(_MOST_STACKED):
        on = defaultdict[str, float](float)
        for (_, rule, _), height in zip(things, found, strict=True):
            for supporter in rule.supporters or ():
                on[supporter] = max(on[supporter], height)
        found = [
            max(size[2], min(surface_top(surface, size)[0] for surface in categories[rule.category].surfaces) + on[symbol])
            if symbol in on and categories[rule.category].surfaces
            else size[2]
            for symbol, rule, size in things
        ]
    return found


def check_tall(grammar: Grammar, room: Room, things: Sequence[Thing]) -> None:
    """Check that what stands tall or hangs high at walls finds enough wall below a sloped ceiling; a flat one passes.

    Raises:
        RejectedError: it does not.
    """
    if room.slopes is None:
        return
    tall = min(slope.eaves_height_m for slope in room.slopes) + _LOW_M
    reaches = (
        (top_m(rule, size), size[1], size[0]) if rule.in_run else (top_m(rule, size), _SLACK * size[1], _STORE_DEPTH_M)
        for _, rule, size in things
        if not rule.in_line
    )
    sizes = sorted((reach for reach in reaches if reach[0] > tall), reverse=True)
    if not sizes:
        return
    zones = [np.zeros((0, 8))]
    for opening in room.openings:
        x, y, yaw = opening_frame(room, opening)
        kept = [zone for zone in opening_zones(opening, grammar.openings[opening.category]) if zone.kind in (SWING, VIEW)]
        zones.append(placed_zones(kept, x, y, opening.sill_m, yaw))
    # share the stretches of wall out, the tallest thing first; what is lower finds the same stretches, or longer ones
    taken, used = np.concatenate(zones), defaultdict[tuple[int, int], float](float)
    for height, width, depth in sizes:
        spans = free_spans(room.polygon_m, np.concatenate([taken, low_ceiling(room, height)]), depth)
        left = {(w, k): span.high - span.low - used[w, k] for w, wall in enumerate(spans) for k, span in enumerate(wall)}
        fitting = [place for place, length in left.items() if length >= width]
        if not fitting:
            raise RejectedError(f"walls below the sloped ceiling for what is {height:.2f} m high")
        used[min(fitting, key=left.__getitem__)] += width


def top_m(rule: ObjectRule, size: Size) -> float:
    """Return how high a thing at a wall reaches, about; 0 for what has no wall of its own to find, such as a curtain."""
    if rule.mount == "floor" and (rule.wall or rule.in_run):
        return size[2]
    if rule.mount == "wall" and rule.centre_height_m is not None and not set(rule.cores or ()) & set(OPENINGS):
        return rule.centre_height_m.mean + 0.5 * size[2]
    return 0.0
