"""Relations of objects to walls, cores and supporters, learned symbol by symbol; only relations that the base grammar has are learned."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from grammar.geometry.solids import surface_top
from grammar.layout.assemble import around_target
from grammar.learning.assign import AssignedObject, AssignedRoom
from grammar.learning.graph import PULLED_UP
from grammar.learning.modes import (
    ALIGNED_RAD,
    LEAST_ANGLE_RAD,
    LEAST_PLACE_M,
    GroupPose,
    Scale,
    SupportPose,
    around_modes,
    blended,
    has_direction,
    place_modes,
    quarter_of,
    wall_modes,
)
from grammar.learning.observed import WallPose, fitting_gap, fitting_wall, nearest_wall, relative_pose, wrapped
from grammar.learning.sizes import height_modes, is_norm, learn_size
from grammar.spec.categories import Categories, Role
from grammar.spec.energy_terms import Weights
from grammar.spec.object_rules import CORE, NONE, AroundMode, ObjectRule, WallMode
from grammar.spec.rules import Grammar
from grammar.spec.values import TruncatedNormal

_AT_WALL_M = 1.0
_USED_FROM_M = 0.4
_ACROSS_M, _OFF_PLACE_M, _OTHER_PLACE_M = 1.0, 0.6, 0.15
_LEAST_POSES = 5
_LEAST_TURNS, _LEAST_TURNED, _STRAIGHT_RAD = 3, 0.15, 0.1
_PLENTY = 20
"""Poses beyond which other room types are not asked."""


_OUTWARDS = {"front": (1.0, 0.0), "back": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)}
"""Side of a core -> the direction away from it there, in its frame."""

LOW_TABLE: Role = "low_table"
_TIED_M = 0.1
_HEIGHT_MARGIN_M, _EXACT_M = 0.01, 0.001
_MEDIAN_OF_ROUND = 1.678
_AXES = {"depth": 0, "width": 1, "height": 2}

Seen = Sequence[tuple[AssignedRoom, AssignedObject]]


class LearnShares(NamedTuple):
    """How much the base, other room types and the data count.

    alpha: pseudo-counts of the base in sizes and addresses; pooled: pseudo-counts of other room types in sizes and places; least: with
    fewer observations a size stays as it is (for relations the bound is at least five).
    """

    alpha: float
    pooled: float
    least: int


def learn_object(
    grammar: Grammar,
    categories: Categories,
    symbol: str,
    rooms: Sequence[AssignedRoom],
    others: Sequence[AssignedRoom],
    shares: LearnShares,
    keep: AbstractSet[str],
) -> tuple[ObjectRule, Mapping[str, int]]:
    """Learn one object's attributes and relations.

    ``others``: rooms of other types, matched with the same grammar; ``keep``: "sizes", "relations", parts that stay as they are.

    Returns:
        the new rule, and for each field of it that changed how many observations made it.
    """
    rule = grammar.objects[symbol]
    seen, elsewhere = ([(room, item) for room in places for item in room.objects if item.symbol == symbol] for places in (rooms, others))
    counts: dict[str, int] = {}
    beta = grammar.schedule.beta
    if len(seen) >= shares.least and "sizes" not in keep:
        sizes, more = ([item.seen.size_m for _, item in found if is_sound(rule, item.seen.size_m)] for found in (seen, elsewhere))
        rule = _without_broken_ties(rule, seen, {other: r.category for other, r in grammar.objects.items()})
        if len(sizes) >= shares.least:
            rule, counts["sizes"] = learn_size(rule, sizes, shares.alpha, more, shares.pooled), len(sizes)
    if "relations" in keep:
        return rule, counts
    rule = straightened(rule, grammar, (*rooms, *others))
    enough = max(shares.least, _LEAST_POSES)
    if rule.wall:
        rule = _learn_wall(rule, grammar.weights, beta, seen, elsewhere, shares.pooled, enough, counts)
    if rule.cores and rule.around:
        scale = Scale.of(grammar.weights.group_distance, grammar.weights.group_orientation, beta)
        matched = any(other.same_place_as == symbol for other in grammar.objects.values())
        alike = LOW_TABLE in categories[rule.category].roles
        if rule.one_each == "place" and PULLED_UP in categories[rule.category].roles:
            rule, matched = _drawn_up(rule, seen, enough, counts), True  # loose chairs stand at no place or at two
        rule = _learn_group(rule, scale, seen, shares.alpha, enough, matched, alike, counts)
    if rule.mount == "object" and rule.supporters:
        rule = _learn_support(grammar, categories, rule, seen, shares.alpha, enough, counts)
    if rule.centre_height_m is not None:
        rule = _learn_height(rule, rule.centre_height_m, seen, counts)
    return rule, counts


def is_sound(rule: ObjectRule, size_m: Sequence[float]) -> bool:
    """Return whether no side is under half or beyond twice of what the base allows, as things measured wrongly are."""
    return all(0.5 * low <= side <= 2.0 * high for side, low, high in zip(size_m, rule.low_m, rule.high_m, strict=True))


def _without_broken_ties(rule: ObjectRule, seen: Seen, category_of: Mapping[str, str]) -> ObjectRule:
    """Return the rule without ties to other objects that the observed ones do not keep to: their sizes follow their own distribution."""
    kept = []
    for tie in rule.tied:
        axis, of = _AXES.get(tie.axis), _AXES.get(tie.of)
        if tie.to == CORE and axis is not None and of is not None:
            pairs = [(item, room.objects[item.core]) for room, item in seen if item.core is not None]
        else:
            pairs = [(item, other) for room, item in seen for other in room.objects if category_of[other.symbol] == category_of.get(tie.to)]
        off = [
            abs(item.seen.size_m[axis] - tie.factor * other.seen.size_m[of] - tie.add_m)
            for item, other in pairs
            if axis is not None and of is not None
        ]
        if len(off) < _LEAST_POSES or float(np.median(off)) <= max(_TIED_M, 2.0 * tie.sd_m):
            kept.append(tie)
    return replace(rule, tied=tuple(kept))


def _learn_wall(
    rule: ObjectRule, weights: Weights, beta: float, seen: Seen, elsewhere: Seen, pooled: float, least: int, counts: dict[str, int]
) -> ObjectRule:
    """Learn poses at walls, from objects without a core if they are enough, else from all objects near a wall.

    Of n poses and the ``pooled`` pseudo-counts of those in other room types, the modes of each have the share n / (n + pooled) and the
    rest; too few poses of a room type are taken together with those.
    """
    turned = any(mode.orientation_rad is not None for mode in rule.wall)
    found, more = (_wall_poses(rule, items, turned, least) for items in (seen, elsewhere))
    scale = Scale.of(weights.wall_distance, weights.wall_orientation, beta)

    def modes(poses: Sequence[WallPose]) -> tuple[WallMode, ...]:
        return wall_modes([(fitting_gap(pose.gap_m), _usable(rule, pose)) for pose in poses], turned, scale)

    if len(found) < least:
        if not found or len(found) + len(more) < least:
            return rule
        counts["wall"] = len(found) + len(more)
        return replace(rule, wall=modes([*found, *more]))
    counts["wall"] = len(found)
    if len(more) < least or len(found) >= _PLENTY:
        return replace(rule, wall=modes(found))
    own = len(found) / (len(found) + pooled)
    return replace(rule, wall=blended(modes(found), modes(more), own))


def _wall_poses(rule: ObjectRule, seen: Seen, turned: bool, least: int) -> list[WallPose]:
    """Return the poses of objects without a core, or where these are too few those of all near a wall."""
    chosen = fitting_wall if turned else nearest_wall
    found = [pose for room, item in seen if item.core is None and (pose := chosen(room.room.polygon_m, item.seen)) is not None]
    if rule.cores and len(found) < least:
        grouped = [pose for room, item in seen if (pose := chosen(room.room.polygon_m, item.seen)) is not None]
        found = [pose for pose in grouped if pose.gap_m <= _AT_WALL_M]
    return found


def _usable(rule: ObjectRule, seen: WallPose) -> float:
    """Return the turn against a wall; an object that is used from its front only and faces a wall close by is turned round.

    No one could use it otherwise.  Sources guess the front of shelves and racks, whose boxes do not show it.
    """
    facing = quarter_of(seen.turn_rad) == 2 and seen.gap_m < _USED_FROM_M
    return wrapped(seen.turn_rad - math.pi) if facing and rule.reach_any == ("front",) else seen.turn_rad


def _learn_group(
    rule: ObjectRule, scale: Scale, seen: Seen, alpha: float, least: int, matched: bool, alike: bool, counts: dict[str, int]
) -> ObjectRule:
    """Learn the poses around the core, and how often the object has no core though one is offered.

    Learned modes are not exclusive.  Places that are exclusive, that other objects follow by their numbers (``matched``), or that lie
    across the room stay where they are; all but the matched ones become as tight or loose as the data.  ``alike``: the object looks so
    from both sides.
    """
    cores = dict(rule.cores or {})
    poses = _group_poses(seen)
    across = any(mode.gap_m > _ACROSS_M for mode in rule.around)
    kept = matched or across or rule.one_each == "place" or all(mode.side == "centre" for mode in rule.around)
    modes, used = _learn_places(rule, scale, poses, least) if not kept else ((), 0)
    if kept and not matched and len(poses) >= least:
        counts["around"] = len(poses)
        rule = replace(rule, around=_as_close(rule, scale, [pose for _, pose in poses], alike))
    if used:
        counts["around"] = used
        rule = replace(rule, around=modes)
    offered = [item for _, item in seen if item.core_offered]
    if NONE in cores and len(offered) >= least:
        alone = sum(item.core is None for item in offered)
        share = (alone + alpha * cores[NONE]) / (len(offered) + alpha)
        others = 1.0 - cores[NONE]
        if others > 0.0:
            cores = {name: share if name == NONE else weight * (1.0 - share) / others for name, weight in cores.items()}
            counts["cores"] = len(offered)
            rule = replace(rule, cores=cores)
    return rule


def _group_poses(seen: Seen) -> list[tuple[str, GroupPose]]:
    """Return the poses of objects that have a core, each with the core's symbol."""
    pairs = [(room.objects[item.core], item.seen) for room, item in seen if item.core is not None]
    return [(core.symbol, GroupPose(relative_pose(one, core.seen), one.size_m, core.seen.size_m)) for core, one in pairs]


def _drawn_up(rule: ObjectRule, seen: Seen, least: int, counts: dict[str, int]) -> ObjectRule:
    """Return a rule whose exclusive places are as near to the core as the median object at each side that has ``least`` of them."""
    nearer: dict[str, list[float]] = {side: [] for side in _OUTWARDS}
    for _, pose in _group_poses(seen):
        targets = [(mode.side, *around_target(mode, pose.size_m, pose.core_m)[:2]) for mode in rule.around]
        off = [(side, pose.frame.x_m - x, pose.frame.y_m - y) for side, x, y in targets]
        side, dx, dy = min(off, key=lambda place: math.hypot(*place[1:]))
        if side in nearer and math.hypot(dx, dy) <= _OFF_PLACE_M:
            nearer[side].append(_OUTWARDS[side][0] * dx + _OUTWARDS[side][1] * dy)
    shift = {side: float(np.median(found)) for side, found in nearer.items() if len(found) >= least}
    if shift:
        counts["around"] = sum(len(nearer[side]) for side in shift)
    return replace(rule, around=tuple(replace(mode, gap_m=mode.gap_m + shift.get(mode.side, 0.0)) for mode in rule.around))


def _as_close(rule: ObjectRule, scale: Scale, poses: Sequence[GroupPose], alike: bool) -> tuple[AroundMode, ...]:
    """Return the places of a rule, which stay where they are, as tight or loose as the median object keeps to the nearest of them.

    The distance from a place in the plane falls off exponentially with the length b, so half of all are within 1.68 b.  What is more than
    ``_OFF_PLACE_M`` from all places has none of them.  Where objects that each have a place of their own (chairs at tables)
    are further than ``_OTHER_PLACE_M`` off in the median, the places stay as tight as they are.
    """
    off, turns = [], []
    for pose in poses:
        targets = [around_target(mode, pose.size_m, pose.core_m) for mode in rule.around]
        distance, yaw = min((math.hypot(pose.frame.x_m - x, pose.frame.y_m - y), yaw) for x, y, yaw in targets)
        off.append(distance)
        if distance <= _OFF_PLACE_M and not math.isnan(yaw):
            turns.append(wrapped(pose.frame.turn_rad - yaw))
    near = [distance for distance in off if distance <= _OFF_PLACE_M] or [_OFF_PLACE_M]
    if rule.one_each == "place" and float(np.median(near)) > _OTHER_PLACE_M:
        return rule.around  # they have places of other kinds, about which these say nothing
    spread = scale.spread(max(float(np.median(near)) / _MEDIAN_OF_ROUND, LEAST_PLACE_M))
    kept = tuple(replace(mode, spread=spread) for mode in rule.around)
    return _as_turned(kept, turns, scale) if alike and len(turns) >= _LEAST_TURNS else kept


def _as_turned(around: Sequence[AroundMode], turns: Sequence[float], scale: Scale) -> tuple[AroundMode, ...]:
    """Return places at which objects are turned as those seen there, each (n,) an angle against its place's own yaw, in radians.

    A place becomes one for each half turn that a seventh of the objects have: what looks alike from both sides stands either way.
    """
    quarters = Counter(quarter_of(turn) for turn in turns)
    shown = {quarter: count for quarter, count in quarters.items() if quarter % 2 == 0 and count >= _LEAST_TURNED * len(turns)} or {0: 1}
    off = [abs(wrapped(turn - 0.5 * math.pi * quarter_of(turn))) for turn in turns]
    straight = [angle for angle in off if angle < _STRAIGHT_RAD] or off
    spread = scale.orientation_spread(max(float(np.mean(straight)), LEAST_ANGLE_RAD))
    total = sum(shown.values())
    return tuple(
        replace(
            mode,
            probability=(mode.probability or 1.0 / len(around)) * count / total,
            orientation_spread=spread,
            orientation_rad=None if mode.orientation_rad is None else wrapped(mode.orientation_rad + 0.5 * math.pi * quarter),
        )
        for mode in around
        for quarter, count in sorted(shown.items())
    )


def _learn_places(rule: ObjectRule, scale: Scale, poses: Sequence[tuple[str, GroupPose]], least: int) -> tuple[tuple[AroundMode, ...], int]:
    """Return modes around the cores and from how many poses; modes that are meant for some cores only are learned from these."""
    turned = any(mode.orientation_rad is not None for mode in rule.around)
    meant = list(dict.fromkeys(mode.of for mode in rule.around))
    modes: list[AroundMode] = []
    used = 0
    for cores in meant:
        mine = [pose for symbol, pose in poses if symbol in cores or not cores]
        learned = around_modes(mine, turned, scale) if len(mine) >= least else ()
        used += len(mine) if learned else 0
        if not learned:
            own = [mode for mode in rule.around if mode.of == cores]
            total = sum(mode.probability or 1.0 for mode in own)
            learned = tuple(replace(mode, probability=(mode.probability or 1.0) / total) for mode in own)
        modes.extend(replace(mode, of=cores, probability=(mode.probability or 0.0) / len(meant)) for mode in learned)
    return tuple(modes), used


def _learn_support(
    grammar: Grammar, categories: Categories, rule: ObjectRule, seen: Seen, alpha: float, least: int, counts: dict[str, int]
) -> ObjectRule:
    """Learn the probabilities of the supporters and the poses on their support surfaces."""
    supporters = dict(rule.supporters or {})
    carried = Counter[str]()
    poses = []
    for room, item in seen:
        below = room.objects[item.on] if item.on is not None else None
        if below is None or below.symbol not in supporters:
            continue
        carried[below.symbol] += 1
        surfaces = [surface_top(surface, below.seen.size_m) for surface in categories[grammar.objects[below.symbol].category].surfaces]
        if surfaces:
            z = item.seen.position_m[2] - below.seen.position_m[2]
            _, half_d, half_w = min(surfaces, key=lambda surface: abs(surface[0] - z))
            poses.append(SupportPose(relative_pose(item.seen, below.seen), item.seen.size_m, (half_d, half_w)))
    total = sum(carried.values())
    if total >= least:
        counts["supporters"] = total
        supporters = {name: (carried[name] + alpha * weight) / (total + alpha) for name, weight in supporters.items()}
        rule = replace(rule, supporters=supporters)
    if len(poses) >= least and rule.same_place_as is None:
        counts["placements"] = len(poses)
        turned = any(mode.orientation_rad is not None for mode in rule.placements) or has_direction([pose.frame.turn_rad for pose in poses])
        scale = Scale.of(grammar.weights.support_position, grammar.weights.support_orientation, grammar.schedule.beta)
        rule = replace(rule, placements=place_modes(poses, turned, scale))
    return rule


def _learn_height(rule: ObjectRule, base: TruncatedNormal, seen: Seen, counts: dict[str, int]) -> ObjectRule:
    """Learn the height of the middle of an object that hangs, from those that hang about as high as the base says."""
    heights = [item.seen.position_m[2] + 0.5 * item.seen.size_m[2] for _, item in seen]
    off_floor = [height for height in heights if base.low - 0.5 <= height <= base.high + 0.5]
    if len(off_floor) < _LEAST_POSES:
        return rule
    middles = np.array(off_floor)
    modes = height_modes(middles)
    if is_norm(base.low, base.high):
        # a norm of the data are the heights that recur, one of which a whole row has
        modes = tuple(mode for mode in modes if mode.sd_m < _EXACT_M)
        if not modes:
            return rule
        total, middles = sum(mode.probability for mode in modes), np.array([mode.mean_m for mode in modes])
        modes = tuple(replace(mode, probability=mode.probability / total) for mode in modes)
    counts["centre_height_m"] = len(off_floor)
    low, high = float(middles.min()) - _HEIGHT_MARGIN_M, float(middles.max()) + _HEIGHT_MARGIN_M
    bounds = TruncatedNormal(mean=float(middles.mean()), sd=max(float(middles.std()), _HEIGHT_MARGIN_M), low=low, high=high)
    return replace(rule, centre_height_m=bounds, heights=modes)


def straightened(rule: ObjectRule, grammar: Grammar, rooms: Sequence[AssignedRoom]) -> ObjectRule:
    """Return a rule whose places are as straight as its category is in the rooms.

    That of one symbol is a habit of all: what stands exactly square to the walls in most rooms does so beside things too.  Places that the
    base leaves loose on purpose stay.
    """
    seen = [
        pose.turn_rad
        for room in rooms
        for item in room.objects
        if grammar.objects[item.symbol].category == rule.category and (pose := fitting_wall(room.room.polygon_m, item.seen)) is not None
    ]
    off = [abs(wrapped(turn - 0.5 * math.pi * quarter_of(turn))) for turn in seen]
    if len(off) < _LEAST_POSES or float(np.median(off)) > ALIGNED_RAD:
        return rule
    weights = {"wall": "wall_orientation", "around": "group_orientation", "placements": "support_orientation"}
    changed: dict[str, Any] = {}
    for name, weight in weights.items():
        spread = Scale.of(1.0, getattr(grammar.weights, weight), grammar.schedule.beta).orientation_spread(LEAST_ANGLE_RAD)
        changed[name] = tuple(
            replace(mode, orientation_spread=min(mode.orientation_spread, spread)) if mode.orientation_spread <= 1.0 else mode
            for mode in getattr(rule, name)
        )
    return replace(rule, **changed)
