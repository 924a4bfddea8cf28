"""From a parse tree to the arrays of a layout problem."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from typing import NamedTuple

import numpy as np

from grammar.derivation.parse_tree import Item, ParseTree
from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.solids import local_solids, surface_top
from grammar.geometry.walls import WALL_YAW, wall_rows
from grammar.geometry.zones import Zone, object_zones, opening_zones, side_rectangle
from grammar.layout.energies import place_object
from grammar.layout.problem import BOTTOM, CANDIDATE, CEILING, CENTRE, CORE, FIXED, FLOOR, LEADS, OBJECT, WALL, Problem, State, empty_state
from grammar.spec.categories import Categories
from grammar.spec.object_rules import AroundMode, Mode, WallMode
from grammar.spec.rules import Grammar, Thresholds

Row = tuple[float, ...]
Modes = tuple[list[Row], list[Row], list[Row], list[Row]]

_MOUNT = {"floor": FLOOR, "wall": WALL, "ceiling": CEILING, "object": OBJECT}


def assemble(grammar: Grammar, categories: Categories, tree: ParseTree, beta: float | None = None) -> tuple[Problem, State]:
    """Return the layout problem of a parse tree and a state in which only what stays put is placed: openings, corners, fixed objects.

    ``beta``: tidiness at which the chain will run, by default the grammar's; it shall not temper the probabilities of modes and addresses.
    """
    tidiness = grammar.schedule.beta if beta is None else beta
    openings, things, room = tree.room.openings, tree.items, tree.room
    size = {opening.id: (0.0, opening.width_m, opening.height_m) for opening in openings} | {thing.id: thing.size_m for thing in things}
    size |= {len(openings) + len(things) + k + 1: (0.0, 0.0, 0.0) for k in range(len(tree.corners))}
    slots = _slots(categories, things)
    limits, reach_m = grammar.validity, grammar.validity.reach_depth_m
    parts = [_Parts([], [_zone_row(z) for z in opening_zones(o, grammar.openings[o.category])], [], ([], [], [], [])) for o in openings]
    for thing in things:
        solids = [(*row, 0.0, 0.0) for row in local_solids(categories[thing.rule.category], thing.size_m).tolist()]
        strips = [_strip_row(side, reach_m, thing.size_m) for side in thing.rule.reach_any]
        zones = [_zone_row(zone) for zone in object_zones(thing.rule, thing.size_m)]
        parts.append(_Parts(solids, zones, strips, _modes(thing, size, slots, tidiness)))
    rows = [(FIXED, -1, 0, 0)] * len(openings)
    parts.extend(_Parts([], [], [], ([], [], [], [])) for _ in tree.corners)
    for thing, part in zip(things, parts[len(openings) : len(openings) + len(things)], strict=True):
        core = -1 if thing.core is None else thing.core - 1
        rows.append((_MOUNT[thing.rule.mount], core, 0, int(_blocks(thing, limits, part))))
    rows.extend((FIXED, -1, 0, 0) for _ in tree.corners)
    stays = [1 for _ in openings] + [int(thing.pinned is not None) for thing in things] + [1 for _ in tree.corners]
    link = np.array(rows, np.int64).reshape(-1, 4)
    owners = {int(row[5]) for row in slots}
    link[:, LEADS] = [int(i in owners or i in link[:, CORE]) for i in range(len(link))]
    box_first, mode_first = _firsts([p.boxes for p in parts]), _firsts([p.modes for p in parts])
    wall, polygon = wall_rows(room.polygon_m), np.array(room.polygon_m)
    problem = Problem(
        object=np.array([_object_row(size[i + 1], p) for i, p in enumerate(parts)]),
        link=np.column_stack([link, box_first, mode_first, np.array(stays, np.int64)]),
        box=_rows([row for p in parts for rows in p.boxes for row in rows], 8),
        mode=_rows([row for p in parts for rows in p.modes for row in rows], 7),
        slot=_rows(slots, 6),
        wall=wall,
        number=np.concatenate([astuple(grammar.weights), polygon.min(0), polygon.max(0), _centroid(polygon)]),
    )
    middle = [float(t.rule.room_centre and t.core is None and t.pinned is None) for t in things]
    problem.object[: len(openings), BOTTOM] = [o.sill_m for o in openings]
    problem.object[len(openings) : len(openings) + len(things), BOTTOM] = [t.bottom_m for t in things]
    problem.object[len(openings) : len(openings) + len(things), CENTRE] = middle
    return problem, _with_fixed(problem, tree)


class _Parts(NamedTuple):
    """The rows that an object adds to the tables: solids, zones, strips to be reached; wall modes, around, placements, candidates."""

    solids: list[Row]
    zones: list[Row]
    strips: list[Row]
    modes: Modes

    @property
    def boxes(self) -> tuple[list[Row], list[Row], list[Row]]:
        return self.solids, self.zones, self.strips


def _zone_row(zone: Zone) -> Row:
    return (*(float(x) for x in zone),)


def _strip_row(side: str, depth_m: float, size: tuple[float, float, float]) -> Row:
    x, y, half_d, half_w = side_rectangle(side, depth_m, size)
    return x, y, 0.0, size[2], half_d, half_w, 0.0, depth_m


def _blocks(thing: Item, limits: Thresholds, parts: _Parts) -> bool:
    """Return whether a thing takes floor from a walker; what stands on a thing lies within its footprint."""
    low = min((row[2] for row in parts.solids), default=math.inf)
    return thing.rule.mount != "object" and thing.bottom_m + low < limits.robot_height_m


def _modes(thing: Item, size: Mapping[int, tuple[float, float, float]], slots: Sequence[Row], beta: float) -> Modes:
    rule = thing.rule
    wall: list[Row] = [(mode.distance_m, _or_nan(mode.orientation_rad), 0.0) for mode in rule.wall]
    around: list[Row] = [around_target(mode, thing.size_m, size[thing.core]) for mode in rule.around] if thing.core else []
    places: list[Row] = [
        (_or_nan(mode.depth_fraction), _or_nan(mode.width_fraction), _or_nan(mode.orientation_rad)) for mode in rule.placements
    ]
    return (
        _with_odds(wall, rule.wall, [1] * len(wall), beta),
        _with_odds(around, rule.around, [1 if rule.mount == "wall" else 2] * len(around), beta),
        _with_odds(places, rule.placements, [2 - sum(map(math.isnan, row[:2])) for row in places], beta),
        [(slot, cost / beta, 0.0, 0.0, 0.0, 0.0, 0.0) for slot, cost in _candidates(thing, slots)],
    )


def _with_odds(rows: list[Row], modes: Sequence[Mode], dimensions: Sequence[int], beta: float) -> list[Row]:
    """Append each mode's cost, probability, and factors of its distance, which has so many dimensions, and of its angle."""
    if not rows:
        return []
    shares = [1.0 / len(modes) if mode.probability is None else mode.probability for mode in modes]
    turns = [row[1] if isinstance(mode, WallMode) else row[2] for row, mode in zip(rows, modes, strict=True)]
    logs = [
        math.log(share) - d * math.log(mode.spread) - (0.0 if math.isnan(turn) else math.log(mode.orientation_spread))
        for share, mode, d, turn in zip(shares, modes, dimensions, turns, strict=True)
    ]
    return [
        (*row, (max(logs) - log) / beta, share, 1.0 / mode.spread, 1.0 / mode.orientation_spread)
        for row, mode, share, log in zip(rows, modes, shares, logs, strict=True)
    ]


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _object_row(size: tuple[float, float, float], parts: _Parts) -> Row:
    inner = max(_radius(parts.solids), math.hypot(0.5 * size[0], 0.5 * size[1]))
    return 0.5 * size[0], 0.5 * size[1], inner, max(inner, _radius(parts.zones)), 0.0, 0.0


def _radius(rows: Sequence[Row]) -> float:
    return max((math.hypot(abs(row[0]) + row[4], abs(row[1]) + row[5]) for row in rows), default=0.0)


def _with_fixed(problem: Problem, tree: ParseTree) -> State:
    """Return a state in which openings, corners and the things that stay put have their places."""
    state = empty_state(problem)
    for i, opening in enumerate(tree.room.openings):
        ax, ay, tx, ty = problem.wall[opening.wall, :4]
        along = opening.offset_m + 0.5 * opening.width_m
        state.pose[i] = ax + tx * along, ay + ty * along, problem.wall[opening.wall, WALL_YAW]
        state.on_wall[i] = opening.wall
    for thing in tree.items:
        if thing.pinned is not None:
            place, i = thing.pinned, thing.id - 1
            state.where[i] = place.x_m, place.y_m, place.yaw_rad, place.z_m
            state.on_wall[i] = -1 if place.wall is None else place.wall
            state.slot[i] = -1 if place.on is None else _top_below(problem, thing.id - 1, place.on - 1, place.z_m - _z_of(tree, place.on))
    for k, corner in enumerate(tree.corners):
        state.pose[len(tree.room.openings) + len(tree.items) + k] = corner
    for i in np.flatnonzero(problem.pinned).tolist():
        state.active[i] = 1
        place_object(problem, state, i)
    return state


def _z_of(tree: ParseTree, identifier: int) -> float:
    return next(thing.bottom_m for thing in tree.items if thing.id == identifier)


def _top_below(problem: Problem, i: int, owner: int, height_m: float) -> int:
    """Return the top of ``owner`` at a height."""
    tops = [k for k in problem.modes(i, CANDIDATE)[:, 0].astype(int).tolist() if problem.slot_owner[k] == owner]
    return int(min(tops, key=lambda k: abs(float(problem.slot[k, 2]) - height_m)))


def around_target(mode: AroundMode, size: tuple[float, float, float], core: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return x, y and yaw of a mode's centre in the core's frame, for the sizes at hand."""
    if mode.orientation_rad is None:
        depth = width = 0.5 * max(size[:2])
        yaw = math.nan
    else:
        yaw = mode.orientation_rad
        c, s = abs(math.cos(yaw)), abs(math.sin(yaw))
        depth, width = 0.5 * (size[0] * c + size[1] * s), 0.5 * (size[0] * s + size[1] * c)
    core_d, core_w = 0.5 * core[0], 0.5 * core[1]
    along_depth = mode.align * (core_d - depth) + mode.along_m
    along_width = mode.align * (core_w - width) + mode.along_m
    x, y = {
        "front": (core_d + mode.gap_m + depth, along_width),
        "back": (-core_d - mode.gap_m - depth, along_width),
        "left": (along_depth, core_w + mode.gap_m + width),
        "right": (along_depth, -core_w - mode.gap_m - width),
        "centre": (along_depth, 0.0),
    }[mode.side]
    return x, y, yaw


def _slots(categories: Categories, things: Sequence[Item]) -> list[Row]:
    rows: list[Row] = []
    for thing in things:
        for surface in categories[thing.rule.category].surfaces:
            rows.append((0.0, 0.0, *surface_top(surface, thing.size_m), float(thing.id - 1)))
    return rows


def _candidates(thing: Item, slots: Sequence[Row]) -> list[tuple[int, float]]:
    """Return the tops that a thing fits on with -log of their probabilities; an object's probability is shared by its tops."""
    found: list[tuple[int, float]] = []
    small, large = sorted((0.5 * thing.size_m[0], 0.5 * thing.size_m[1]))
    for target, log_probability in zip(thing.supporters, thing.supporter_log_probability, strict=True):
        fitting = [k for k, row in enumerate(slots) if row[5] == target - 1 and small <= min(row[3:5]) and large <= max(row[3:5])]
        found.extend((k, math.log(len(fitting)) - log_probability) for k in fitting)
    return found


def _centroid(polygon: Floats) -> Floats:
    following = np.roll(polygon, -1, 0)
    cross = polygon[:, 0] * following[:, 1] - following[:, 0] * polygon[:, 1]
    return np.asarray(((polygon + following) * cross[:, None]).sum(0) / (3.0 * cross.sum()))


def _firsts(parts: Sequence[Sequence[Sequence[Row]]]) -> Ints:
    """Return for each object the first rows of its lists in their common table, and the end of the last one."""
    kinds = len(parts[0]) if parts else 0
    ends = np.cumsum([len(rows) for lists in parts for rows in lists]).reshape(-1, kinds)
    return np.column_stack([np.concatenate([[0], ends[:-1, -1]]), ends]).astype(np.int64)


def _rows(rows: Sequence[Row], columns: int) -> Floats:
    return np.array(rows, np.float64).reshape(-1, columns)
