"""From a parse tree to the arrays of a layout problem."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.derivation.parse_tree import Item, ParseTree
from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.slopes import slope_rows
from grammar.geometry.solids import Size, layout_solids, surface_top
from grammar.geometry.walls import ALONG_X, ALONG_Y, START_X, START_Y, WALL_YAW, wall_rows
from grammar.geometry.zones import (
    ACCESS,
    Zone,
    apart_zone,
    footing_zone,
    glare_zone,
    headroom_zone,
    object_zones,
    opening_front,
    opening_zones,
    side_rectangle,
)
from grammar.layout import columns as col
from grammar.layout.frames import place_object
from grammar.layout.problem import Problem, State, zero_state
from grammar.layout.unit_row_tables import Wish, begin_rows, row_table, slot_table, wishes, write_links
from grammar.spec.categories import Categories
from grammar.spec.energy_terms import weight_vector
from grammar.spec.object_rules import AroundMode, Mode, WallMode
from grammar.spec.rules import Grammar, Thresholds
from scene_description import Opening
from scene_description.polygons import centroid_m

_CHAIR_SPREAD, _DEEP_M = 2.5, 0.25
_MOUNT = {"floor": col.FLOOR, "wall": col.WALL, "ceiling": col.CEILING, "object": col.OBJECT}


class ModeRow(NamedTuple):
    """A row of ``Problem.mode``; the names of the first three columns are those of modes around a core object."""

    x: float
    y: float
    yaw: float
    odds_cost: float = 0.0
    probability: float = 0.0
    near: float = 0.0
    straight: float = 0.0


class SurfaceRow(NamedTuple):
    """A row of ``Problem.surface``."""

    x: float
    y: float
    z: float
    half_depth: float
    half_width: float
    owner: int


def assemble(grammar: Grammar, categories: Categories, tree: ParseTree, beta: float | None = None) -> tuple[Problem, State]:
    """Return the layout problem of a parse tree and a state in which all is placed that stays put or begins at a place of its own.

    These are openings, corners, fixed objects, and the rows of units with what hangs in line above them.

    ``beta``: inverse temperature at which the chain will run, by default the grammar's; it shall not temper the probabilities of modes and
    addresses.
    """
    openings, items, corners = tree.room.openings, tree.items, tree.corners
    sizes = _sizes(tree)
    surfaces = _surfaces(categories, items)
    at_beta = grammar.schedule.beta if beta is None else beta
    wished = wishes(tree, at_beta)
    parts = [
        *(_opening_parts(_zones_of(grammar, o)) for o in openings),
        *(_item_parts(grammar, categories, item, sizes, surfaces, at_beta, wished.get(item.id, [])) for item in items),
        *(_opening_parts([]) for _ in corners),
    ]
    polygon = np.array(tree.room.polygon_m)
    (x_low, y_low), (x_high, y_high), (x_centre, y_centre) = polygon.min(0), polygon.max(0), centroid_m(tree.room.polygon_m)
    problem = Problem(
        object=_object_table(categories, tree, sizes, parts),
        link=_link_table(categories, grammar.validity, tree, surfaces, parts),
        box=_table([row for p in parts for rows in p.boxes for row in rows], col.BOX_WIDTH),
        mode=_table([row for p in parts for rows in p.modes for row in rows], col.MODE_WIDTH),
        surface=_table(surfaces, col.SURFACE_WIDTH),
        wall=wall_rows(tree.room.polygon_m),
        slope=slope_rows(tree.room),
        row=row_table(tree),
        slot=slot_table(tree),
        weight=weight_vector(grammar.weights),
        x_low=x_low,
        y_low=y_low,
        x_high=x_high,
        y_high=y_high,
        x_centre=x_centre,
        y_centre=y_centre,
    )
    return problem, _with_fixed(problem, tree)


class _Parts(NamedTuple):
    """The rows that an object adds to the tables, in the order in which these keep them; of its boxes only zones have a kind."""

    solids: list[Zone]
    zones: list[Zone]
    strips: list[Zone]
    wall_modes: list[ModeRow]
    around_modes: list[ModeRow]
    placements: list[ModeRow]
    targets: list[ModeRow]
    wishes: list[ModeRow]

    @property
    def boxes(self) -> tuple[list[Zone], ...]:
        return self.solids, self.zones, self.strips

    @property
    def modes(self) -> tuple[list[ModeRow], ...]:
        return self.wall_modes, self.around_modes, self.placements, self.targets, self.wishes


def _zones_of(grammar: Grammar, opening: Opening) -> list[Zone]:
    clear = opening_zones(opening, grammar.openings[opening.category])
    return [*clear, glare_zone(opening)] if opening.category == "window" else clear


def _opening_parts(zones: list[Zone]) -> _Parts:
    """Return the rows of an opening, or of a corner, which has no zones."""
    return _Parts([], zones, [], [], [], [], [], [])


def _item_parts(
    grammar: Grammar,
    categories: Categories,
    item: Item,
    sizes: Mapping[int, Size],
    surfaces: Sequence[SurfaceRow],
    beta: float,
    wished: Sequence[Wish],
) -> _Parts:
    """Return the rows of a placed object."""
    rule, category = item.rule, categories[item.rule.category]
    zones = object_zones(rule, item.size_m, category.access)
    if "store" in category.roles and rule.mount == "floor":
        zones.append(footing_zone(item.size_m))
        if category.opens:
            zones.append(opening_front(item.size_m))
    if rule.mount == "wall" and item.size_m[0] > _DEEP_M and "store" in category.roles and "wall_unit" not in category.roles:
        zones.append(headroom_zone(item.size_m, item.bottom_m))
    if "dining" in category.roles:
        zones.append(apart_zone(item.size_m))
    behind = _straight(rule.wall) if {"store", "bed"} & set(category.roles) else rule.wall
    at_walls = [ModeRow(mode.distance_m, 0.0, _or_nan(mode.orientation_rad)) for mode in behind]
    beside = _drawn_up(rule.around) if "pulled_up" in category.roles else rule.around
    around = [ModeRow(*around_target(mode, item.size_m, sizes[item.core])) for mode in beside] if item.core else []
    depth = grammar.validity.reach_depth_m
    strips = [side_rectangle(side, depth, item.size_m) for side in rule.reach_any]
    places = [
        ModeRow(_or_nan(mode.depth_fraction), _or_nan(mode.width_fraction), _or_nan(mode.orientation_rad)) for mode in rule.placements
    ]
    return _Parts(
        solids=[Zone._make((*row, ACCESS, 0.0)) for row in layout_solids(category, item.size_m).tolist()],
        zones=zones,
        strips=[Zone(x, y, 0.0, item.size_m[2], half_d, half_w, ACCESS, depth) for x, y, half_d, half_w in strips],
        wall_modes=_with_odds(at_walls, behind, [1] * len(at_walls), beta),
        around_modes=_with_odds(around, beside, [1 if rule.mount == "wall" else 2] * len(around), beta),
        placements=_with_odds(places, rule.placements, [2 - math.isnan(row.x) - math.isnan(row.y) for row in places], beta),
        targets=[ModeRow(float(surface), cost / beta, 0.0) for surface, cost in _targets(item, surfaces)],
        wishes=[ModeRow(*wish) for wish in wished],
    )


def _drawn_up(modes: Sequence[AroundMode]) -> tuple[AroundMode, ...]:
    """Return places of a chair at its table that it keeps to within ``_CHAIR_SPREAD``, however loosely observed ones stood about."""
    return tuple(replace(mode, spread=min(mode.spread, _CHAIR_SPREAD)) for mode in modes)


def _straight(modes: Sequence[WallMode]) -> tuple[WallMode, ...]:
    """Return places at walls of what stands straight there, however loosely single observed ones were turned."""
    return tuple(replace(mode, orientation_spread=min(mode.orientation_spread, 1.0)) for mode in modes)


def _sizes(tree: ParseTree) -> dict[int, Size]:
    """Return the size of every opening, placed object and corner by its id."""
    last = len(tree.room.openings) + len(tree.items)
    sizes: dict[int, Size] = {opening.id: (0.0, opening.width_m, opening.height_m) for opening in tree.room.openings}
    sizes |= {item.id: item.size_m for item in tree.items}
    return sizes | {last + k + 1: (0.0, 0.0, 0.0) for k in range(len(tree.corners))}


def _object_table(categories: Categories, tree: ParseTree, sizes: Mapping[int, Size], parts: Sequence[_Parts]) -> Floats:
    """Return ``Problem.object``."""
    table, first = np.zeros((len(parts), col.OBJECT_WIDTH)), len(tree.room.openings)
    table[:, [col.BACK_GAP, col.SIDE_GAP]] = np.inf
    for i, part in enumerate(parts):
        half_d, half_w = 0.5 * sizes[i + 1][0], 0.5 * sizes[i + 1][1]
        inner = max(_radius(part.solids), math.hypot(half_d, half_w))
        table[i, [col.HALF_DEPTH, col.HALF_WIDTH]] = half_d, half_w
        table[i, [col.INNER_RADIUS, col.OUTER_RADIUS]] = inner, max(inner, _radius(part.zones))
    table[:first, col.BOTTOM] = [opening.sill_m for opening in tree.room.openings]
    for i, item in enumerate(tree.items, first):
        table[i, [col.BOTTOM, col.BEHIND]] = item.bottom_m, item.behind_m
        if item.rule.mount == "floor" and item.pinned is None:
            category = categories[item.rule.category]
            table[i, [col.BACK_GAP, col.SIDE_GAP]] = category.back_gap_m, category.side_gap_m
        table[i, col.CENTRED] = float(item.rule.room_centre and item.core is None and item.pinned is None)
    return table


def _link_table(
    categories: Categories, limits: Thresholds, tree: ParseTree, surfaces: Sequence[SurfaceRow], parts: Sequence[_Parts]
) -> Ints:
    """Return ``Problem.link``."""
    table, first = np.zeros((len(parts), col.LINK_WIDTH), np.int64), len(tree.room.openings)
    table[:, col.MOUNT], table[:, col.CORE], table[:, col.PINNED], table[:, col.WATCHED] = col.FIXED, -1, 1, -1
    seat = _watching_seat(categories, tree.items)
    for i, item in enumerate(tree.items, first):
        table[i, [col.MOUNT, col.CORE]] = _MOUNT[item.rule.mount], -1 if item.core is None else item.core - 1
        table[i, [col.BLOCKS, col.PINNED]] = _blocks(item, limits, parts[i]), item.pinned is not None
        roles = categories[item.rule.category].roles
        table[i, col.LOUNGES] = item.rule.mount == "floor" and ("lounge" in roles or "low_table" in roles)
        if "screen" in roles:
            table[i, col.WATCHED] = seat
    owners = {row.owner for row in surfaces}
    table[:, col.LEADS] = [i in owners or i in table[:, col.CORE] for i in range(len(table))]
    write_links(tree, table)
    table[:, col.SOLIDS : col.BOX_END + 1] = _firsts([part.boxes for part in parts])
    table[:, col.WALL_MODES : col.WISH_END + 1] = _firsts([part.modes for part in parts])
    return table


def _watching_seat(categories: Categories, items: Sequence[Item]) -> int:
    """Return the index of the largest sofa or armchair, or bed where there is none, that screens are watched from; -1: none."""
    for role in ("lounge", "bed"):
        seats = [item for item in items if role in categories[item.rule.category].roles]
        if seats:
            return max(seats, key=lambda item: item.size_m[0] * item.size_m[1]).id - 1
    return -1


def _blocks(item: Item, limits: Thresholds, parts: _Parts) -> bool:
    """Return whether an object takes floor from a robot; what stands on an object lies within its footprint, rugs below the floor."""
    low = min((row.z_low for row in parts.solids if row.z_high > 0.0), default=math.inf)
    return item.rule.mount != "object" and item.bottom_m + low < limits.robot_height_m


def _with_odds(rows: list[ModeRow], modes: Sequence[Mode], dimensions: Sequence[int], beta: float) -> list[ModeRow]:
    """Return the rows with each mode's cost, probability, and factors of its distance, which has so many dimensions, and of its angle."""
    if not rows:
        return []
    shares = [1.0 / len(modes) if mode.probability is None else mode.probability for mode in modes]
    logs = [
        math.log(share) - d * math.log(mode.spread) - (0.0 if math.isnan(row.yaw) else math.log(mode.orientation_spread))
        for share, mode, d, row in zip(shares, modes, dimensions, rows, strict=True)
    ]
    return [
        row._replace(odds_cost=(max(logs) - log) / beta, probability=share, near=1.0 / mode.spread, straight=1.0 / mode.orientation_spread)
        for row, mode, share, log in zip(rows, modes, shares, logs, strict=True)
    ]


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _radius(rows: Sequence[Zone]) -> float:
    """Return the radius of the circle about the origin around the footprints of boxes."""
    return max((math.hypot(abs(row.x) + row.half_depth, abs(row.y) + row.half_width) for row in rows), default=0.0)


def _with_fixed(problem: Problem, tree: ParseTree) -> State:
    """Return a state in which openings, corners, the objects that stay put, and rows of units have their places."""
    state = zero_state(problem)
    for i, opening in enumerate(tree.room.openings):
        wall, along = problem.wall[opening.wall], opening.offset_m + 0.5 * opening.width_m
        state.pose[i] = wall[START_X] + wall[ALONG_X] * along, wall[START_Y] + wall[ALONG_Y] * along, wall[WALL_YAW]
        state.on_wall[i] = opening.wall
    for item in tree.items:
        if item.pinned is not None:
            place, i = item.pinned, item.id - 1
            state.where[i] = place.x_m, place.y_m, place.yaw_rad, place.z_m
            state.on_wall[i] = -1 if place.wall is None else place.wall
            state.surface[i] = -1 if place.on is None else _surface_at(problem, i, place.on - 1, place.z_m - _z_of(tree, place.on))
    for k, corner in enumerate(tree.corners):
        state.pose[len(tree.room.openings) + len(tree.items) + k] = corner
    for i in np.flatnonzero(problem.pinned).tolist():
        state.active[i] = 1
        place_object(problem, state, i)
    begin_rows(problem, tree, state)
    return state


def _z_of(tree: ParseTree, identifier: int) -> float:
    return next(item.bottom_m for item in tree.items if item.id == identifier)


def _surface_at(problem: Problem, i: int, owner: int, height_m: float) -> int:
    """Return the support surface of ``owner``, of those that object ``i`` may stand on, that is nearest to a height above its underside."""
    found = [k for k in problem.targets(i).tolist() if problem.surface_owner[k] == owner]
    return int(min(found, key=lambda k: abs(float(problem.surface[k, col.SURFACE_Z]) - height_m)))


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


def _surfaces(categories: Categories, items: Sequence[Item]) -> list[SurfaceRow]:
    return [
        SurfaceRow(0.0, 0.0, *surface_top(surface, item.size_m), item.id - 1)
        for item in items
        for surface in categories[item.rule.category].surfaces
    ]


def _targets(item: Item, surfaces: Sequence[SurfaceRow]) -> list[tuple[int, float]]:
    """Return the support surfaces that an object fits on with -log of their probabilities; a supporter's is shared by its surfaces."""
    found: list[tuple[int, float]] = []
    small, large = sorted((0.5 * item.size_m[0], 0.5 * item.size_m[1]))
    for target, log_probability in zip(item.supporters, item.supporter_log_probability, strict=True):
        fitting = [
            k
            for k, row in enumerate(surfaces)
            if row.owner == target - 1 and small <= min(row.half_depth, row.half_width) and large <= max(row.half_depth, row.half_width)
        ]
        found.extend((k, math.log(len(fitting)) - log_probability) for k in fitting)
    return found


def _firsts(parts: Sequence[Sequence[Sequence[NamedTuple]]]) -> Ints:
    """Return for each object the first rows of its lists in their common table, and the end of the last one."""
    kinds = len(parts[0]) if parts else 0
    ends = np.cumsum([len(rows) for lists in parts for rows in lists]).reshape(-1, kinds)
    return np.column_stack([np.concatenate([[0], ends[:-1, -1]]), ends]).astype(np.int64)


def _table(rows: Sequence[tuple[float, ...]], columns: int) -> Floats:
    return np.array(rows, np.float64).reshape(-1, columns)
