"""How much of floor and walls furniture takes with the space to use it: rooms where that is too much hardly ever have a valid layout."""

import math
from collections.abc import Iterable

from grammar.derivation.drafts import Size
from grammar.geometry.walls import wall_lengths
from grammar.geometry.zones import ACCESS, Zone, object_zones, opening_zones
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule
from grammar.spec.rules import Grammar
from scene_description import Room
from scene_description.polygons import signed_area_m2

_NEAR_M, _STRAIGHT_RAD, _LEAST_M = 0.3, 0.1, 0.01


def used_share(grammar: Grammar, categories: Categories, room: Room, things: Iterable[tuple[ObjectRule, Size]]) -> float:
    """Return the share of the floor that things, the strips at their sides where people use them, and doors take, as if none overlapped.

    Args:
        grammar: with the rules of the openings.
        categories: with the access of rules that name none.
        room: with its openings.
        things: rules and sizes; what does not stand on the floor, or lies flat on it, takes nothing.
    """
    used = sum(_area_m2(opening_zones(opening, grammar.openings[opening.category])[0]) for opening in room.openings if not opening.sill_m)
    for rule, size in things:
        category = categories[rule.category]
        if rule.mount == "floor" and not category.underlay:
            beside = (zone for zone in object_zones(rule, size, category.access) if zone.kind == ACCESS and (zone.x or zone.y))
            used += size[0] * size[1] + sum(map(_area_m2, beside))
    return used / signed_area_m2(room.polygon_m)


def wall_share(categories: Categories, room: Room, things: Iterable[tuple[ObjectRule, Size]]) -> float:
    """Return the share of the walls between doors that is behind things which stand with their backs to one."""
    free_m = math.fsum(wall_lengths(room.polygon_m)) - sum(opening.width_m for opening in room.openings if not opening.sill_m)
    behind_m = sum(size[1] for rule, size in things if rule.mount == "floor" and _stands_at_wall(categories, rule))
    return behind_m / max(free_m, _LEAST_M)


def _stands_at_wall(categories: Categories, rule: ObjectRule) -> bool:
    straight = rule.wall and all(mode.orientation_rad is not None and abs(mode.orientation_rad) < _STRAIGHT_RAD for mode in rule.wall)
    return math.isfinite(categories[rule.category].back_gap_m) or bool(straight and min(mode.distance_m for mode in rule.wall) < _NEAR_M)


def _area_m2(zone: Zone) -> float:
    return 4.0 * zone.half_depth * zone.half_width
