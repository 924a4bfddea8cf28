"""Relations of objects to walls, cores and supporters, learned symbol by symbol; only relations that the base grammar has are looked at."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

import numpy as np

from grammar.geometry.solids import surface_top
from grammar.learning.assign import AssignedObject, AssignedRoom
from grammar.learning.geometry import AtWall, fitting_wall, in_frame, nearest_wall, wrapped
from grammar.learning.modes import GroupPose, Scale, TopPose, around_modes, place_modes, quarter_of, wall_modes
from grammar.learning.sizes import learn_normal, learn_size
from grammar.spec.categories import Categories
from grammar.spec.energy_terms import Weights
from grammar.spec.rules import NONE, AroundMode, Grammar, Normal, ObjectRule

_AT_WALL_M = 1.0
_USED_FROM_M = 0.4
_LEAST_POSES = 5

Seen = Sequence[tuple[AssignedRoom, AssignedObject]]


def learn_object(
    grammar: Grammar, categories: Categories, symbol: str, rooms: Sequence[AssignedRoom], alpha: float, least: int, keep: AbstractSet[str]
) -> tuple[ObjectRule, Mapping[str, int]]:
    """Learn one object's attributes and relations.

    Args:
        grammar: the base.
        categories: tops of the supporters.
        symbol: the object.
        rooms: what was observed.
        alpha: pseudo-counts that hold on to the base in sizes and addresses.
        least: fewer observations than this leave a size as it is; for relations it is at least five.
        keep: "sizes", "relations": parts that stay as they are.

    Returns:
        the new rule, and for each field of it that changed how many observations made it.
    """
    rule = grammar.objects[symbol]
    seen = [(room, thing) for room in rooms for thing in room.objects if thing.symbol == symbol]
    counts: dict[str, int] = {}
    beta = grammar.schedule.beta
    if len(seen) >= least and "sizes" not in keep:
        rule, counts["sizes"] = learn_size(rule, [thing.seen.size_m for _, thing in seen], alpha), len(seen)
    if "relations" in keep:
        return rule, counts
    enough = max(least, _LEAST_POSES)
    if rule.wall:
        rule = _learn_wall(rule, grammar.weights, beta, seen, enough, counts)
    if rule.cores and rule.around:
        scale = _scale(grammar.weights.group_distance, grammar.weights.group_orientation, beta)
        matched = any(other.same_place_as == symbol for other in grammar.objects.values())
        rule = _learn_group(rule, scale, seen, alpha, enough, matched, counts)
    if rule.mount == "object" and rule.supporters:
        rule = _learn_support(grammar, categories, rule, seen, alpha, enough, counts)
    if rule.centre_height_m is not None:
        rule = _learn_height(rule, rule.centre_height_m, seen, counts)
    return rule, counts


def _learn_wall(rule: ObjectRule, weights: Weights, beta: float, seen: Seen, least: int, counts: dict[str, int]) -> ObjectRule:
    """Learn gaps and turns at walls: of those that stand for themselves if they are enough, else of those near a wall in their groups."""
    turned = any(mode.orientation_rad is not None for mode in rule.wall)
    chosen = fitting_wall if turned else nearest_wall
    found = [item for room, thing in seen if thing.core is None and (item := chosen(room.room.polygon_m, thing.seen)) is not None]
    if rule.cores and len(found) < least:
        grouped = [item for room, thing in seen if (item := chosen(room.room.polygon_m, thing.seen)) is not None]
        found = [item for item in grouped if item.gap_m <= _AT_WALL_M]
    if len(found) < least:
        return rule
    counts["wall"] = len(found)
    scale = _scale(weights.wall_distance, weights.wall_orientation, beta)
    return replace(rule, wall=wall_modes([(item.gap_m, _usable(rule, item)) for item in found], turned, scale))


def _usable(rule: ObjectRule, seen: AtWall) -> float:
    """Return the turn against a wall; what is used from its front only and is said to face a wall close by has its back there.

    No one could use it otherwise, and sources guess the front of shelves and racks, whose boxes do not tell.
    """
    facing = quarter_of(seen.turn_rad) == 2 and seen.gap_m < _USED_FROM_M
    return wrapped(seen.turn_rad - math.pi) if facing and rule.reach_any == ("front",) else seen.turn_rad


def _scale(distance_weight: float, angle_weight: float, beta: float) -> Scale:
    """Return what the weights of a relation make; a weight of zero makes nothing, so its modes get no spread."""
    return Scale(*(1.0 / (beta * weight) if weight > 0.0 else 1e6 for weight in (distance_weight, angle_weight)))


def _learn_group(rule: ObjectRule, scale: Scale, seen: Seen, alpha: float, least: int, matched: bool, counts: dict[str, int]) -> ObjectRule:
    """Learn the poses around the core, and how often the object stands for itself though there is a core.

    Poses that were learned are no places for one object each.  Where others match the places by their numbers (``matched``), these stay.
    """
    cores = dict(rule.cores or {})
    poses = []
    for room, thing in seen:
        if thing.core is not None:
            core = room.objects[thing.core]
            poses.append((core.symbol, GroupPose(in_frame(thing.seen, core.seen), thing.seen.size_m, core.seen.size_m)))
    kept = matched or all(mode.side == "centre" for mode in rule.around)
    modes, used = _learn_places(rule, scale, poses, least) if not kept else ((), 0)
    if used:
        counts["around"] = used
        rule = replace(rule, around=modes, one_each=None if rule.one_each == "place" else rule.one_each)
    offered = [thing for _, thing in seen if thing.core_offered]
    if NONE in cores and len(offered) >= least:
        alone = sum(thing.core is None for thing in offered)
        share = (alone + alpha * cores[NONE]) / (len(offered) + alpha)
        others = 1.0 - cores[NONE]
        if others > 0.0:
            cores = {name: share if name == NONE else weight * (1.0 - share) / others for name, weight in cores.items()}
            counts["cores"] = len(offered)
            rule = replace(rule, cores=cores)
    return rule


def _learn_places(rule: ObjectRule, scale: Scale, poses: Sequence[tuple[str, GroupPose]], least: int) -> tuple[tuple[AroundMode, ...], int]:
    """Return modes around the cores and from how many poses; places that are meant for some cores only are learned from these."""
    turned = any(mode.orientation_rad is not None for mode in rule.around)
    meant = list(dict.fromkeys(mode.of for mode in rule.around))
    modes: list[AroundMode] = []
    used = 0
    for cores in meant:
        mine = [pose for symbol, pose in poses if symbol in cores or not cores]
        if len(mine) >= least:
            learned = around_modes(mine, turned, scale)
            used += len(mine)
        else:
            own = [mode for mode in rule.around if mode.of == cores]
            total = sum(mode.probability or 1.0 for mode in own)
            learned = tuple(replace(mode, probability=(mode.probability or 1.0) / total) for mode in own)
        modes.extend(replace(mode, of=cores, probability=(mode.probability or 0.0) / len(meant)) for mode in learned)
    return tuple(modes), used


def _learn_support(
    grammar: Grammar, categories: Categories, rule: ObjectRule, seen: Seen, alpha: float, least: int, counts: dict[str, int]
) -> ObjectRule:
    supporters = dict(rule.supporters or {})
    carried = Counter[str]()
    poses = []
    for room, thing in seen:
        below = room.objects[thing.on] if thing.on is not None else None
        if below is None or below.symbol not in supporters:
            continue
        carried[below.symbol] += 1
        tops = [surface_top(top, below.seen.size_m) for top in categories[grammar.objects[below.symbol].category].surfaces]
        if tops:
            z = thing.seen.position_m[2] - below.seen.position_m[2]
            _, half_d, half_w = min(tops, key=lambda top: abs(top[0] - z))
            poses.append(TopPose(in_frame(thing.seen, below.seen), thing.seen.size_m, (half_d, half_w)))
    total = sum(carried.values())
    if total >= least:
        counts["supporters"] = total
        supporters = {name: (carried[name] + alpha * weight) / (total + alpha) for name, weight in supporters.items()}
        rule = replace(rule, supporters=supporters)
    if len(poses) >= least and rule.same_place_as is None:
        counts["placements"] = len(poses)
        turned = any(mode.orientation_rad is not None for mode in rule.placements)
        scale = _scale(grammar.weights.support_position, grammar.weights.support_orientation, grammar.schedule.beta)
        rule = replace(rule, placements=place_modes(poses, turned, scale))
    return rule


def _learn_height(rule: ObjectRule, base: Normal, seen: Seen, counts: dict[str, int]) -> ObjectRule:
    heights = [thing.seen.position_m[2] + 0.5 * thing.seen.size_m[2] for _, thing in seen]
    off_floor = [height for height in heights if base.low - 0.5 <= height <= base.high + 0.5]
    if len(off_floor) < _LEAST_POSES:
        return rule
    counts["centre_height_m"] = len(off_floor)
    learned = learn_normal(base, off_floor)
    return replace(rule, centre_height_m=replace(learned, low=float(np.min(off_floor)), high=float(np.max(off_floor)) + 1e-3))
