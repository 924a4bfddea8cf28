"""From a parse tree to the arrays of a layout problem."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple
from typing import TypeVar

import numpy as np

from grammar.categories import Categories
from grammar.energies import place_object
from grammar.layout import CEILING, FIXED, FLOOR, OBJECT, WALL, Floats, Ints, Problem, State, empty_state
from grammar.parse_tree import ParseTree, Thing
from grammar.rules import AroundMode, Grammar
from grammar.solids import local_solids, surface_top
from grammar.walls import reflex_vertices, wall_rows
from grammar.zones import Zone, opening_zones, thing_zones
from scene_description import Opening

_MOUNT = {"floor": FLOOR, "wall": WALL, "ceiling": CEILING, "object": OBJECT}
T = TypeVar("T")


def assemble(grammar: Grammar, categories: Categories, tree: ParseTree) -> tuple[Problem, State]:
    """Return the layout problem of a parse tree and a state in which only its openings are placed."""
    openings, things, room = tree.room.openings, tree.things, tree.room
    size = {opening.id: (0.0, opening.width_m, opening.height_m) for opening in openings} | {thing.id: thing.size_m for thing in things}
    solids = [np.zeros((0, 6)) for _ in openings] + [local_solids(categories[t.rule.category], t.size_m) for t in things]
    zones = [opening_zones(o, grammar.openings[o.category]) for o in openings] + [thing_zones(t.rule, t.size_m) for t in things]
    zone_rows = [zone for of_object in zones for zone in of_object]
    slots, slot_owner = _slots(categories, things)
    candidates: list[list[tuple[int, float]]] = [[] for _ in openings] + [_candidates(t, slots, slot_owner) for t in things]
    around: list[list[tuple[float, float, float]]] = [[] for _ in openings] + [
        [_around_target(mode, t.size_m, size[t.core]) for mode in t.rule.around] if t.core else [] for t in things
    ]
    of_things: list[Thing | None] = [*(None for _ in openings), *things]
    half = np.array([(0.5 * size[i + 1][0], 0.5 * size[i + 1][1]) for i in range(len(of_things))])
    walls, wall_yaw = wall_rows(room.polygon_m)
    polygon = np.array(room.polygon_m)
    problem = Problem(
        half=half,
        radius=np.array([_radii(h, s, z) for h, s, z in zip(half, solids, zones, strict=True)]),
        bottom=np.array([o.sill_m for o in openings] + [t.bottom_m for t in things]),
        mount=np.array([FIXED for _ in openings] + [_MOUNT[t.rule.mount] for t in things], np.int64),
        core=np.array([-1 if t is None or t.core is None else t.core - 1 for t in of_things], np.int64),
        box_first=_firsts(solids),
        box=np.concatenate(solids),
        zone_first=_firsts(zones),
        zone=np.array([zone[:6] for zone in zone_rows], np.float64).reshape(-1, 6),
        zone_kind=np.array([zone[6] for zone in zone_rows], np.int64),
        zone_depth=np.array([zone[7] for zone in zone_rows], np.float64),
        wall_mode_first=_firsts([t.rule.wall if t else () for t in of_things]),
        wall_mode=_rows([astuple(mode) for t in of_things if t for mode in t.rule.wall], 2),
        around_first=_firsts(around),
        around=_rows([row for rows in around for row in rows], 3),
        slot=_rows(slots, 5),
        slot_owner=np.array(slot_owner, np.int64),
        candidate_first=_firsts(candidates),
        candidate=np.array([slot for rows in candidates for slot, _ in rows], np.int64),
        candidate_cost=np.array([cost for rows in candidates for _, cost in rows], np.float64),
        place_first=_firsts([t.rule.placements if t else () for t in of_things]),
        place=_rows([astuple(mode) for t in of_things if t for mode in t.rule.placements], 3),
        centre=np.array([float(t is not None and t.rule.room_centre and t.core is None) for t in of_things]),
        wall=walls,
        wall_yaw=wall_yaw,
        reflex=reflex_vertices(polygon),
        bounds=np.concatenate([polygon.min(0), polygon.max(0)]),
        middle=_centroid(polygon),
        weight=np.array(astuple(grammar.weights)),
    )
    return problem, _with_openings(problem, openings)


def _with_openings(problem: Problem, openings: Sequence[Opening]) -> State:
    state = empty_state(problem)
    for i, opening in enumerate(openings):
        ax, ay, tx, ty = problem.wall[opening.wall, :4]
        along = opening.offset_m + 0.5 * opening.width_m
        state.pose[i] = ax + tx * along, ay + ty * along, problem.wall_yaw[opening.wall]
        state.on_wall[i], state.active[i] = opening.wall, True
        place_object(problem, state, i)
    return state


def _around_target(mode: AroundMode, size: tuple[float, float, float], core: tuple[float, float, float]) -> tuple[float, float, float]:
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


def _slots(categories: Categories, things: Sequence[Thing]) -> tuple[list[tuple[float, ...]], list[int]]:
    rows: list[tuple[float, ...]] = []
    owners: list[int] = []
    for thing in things:
        for surface in categories[thing.rule.category].surfaces:
            height, half_d, half_w = surface_top(surface, thing.size_m)
            rows.append((0.0, 0.0, height, half_d, half_w))
            owners.append(thing.id - 1)
    return rows, owners


def _candidates(thing: Thing, slots: Sequence[tuple[float, ...]], owners: Sequence[int]) -> list[tuple[int, float]]:
    """Return the tops that a thing fits on with -log of their probabilities; an object's probability is shared by its tops."""
    found: list[tuple[int, float]] = []
    small, large = sorted((0.5 * thing.size_m[0], 0.5 * thing.size_m[1]))
    for target, log_probability in zip(thing.supporters, thing.supporter_log_probability, strict=True):
        fitting = [k for k, owner in enumerate(owners) if owner == target - 1 and small <= min(slots[k][3:]) and large <= max(slots[k][3:])]
        found.extend((k, math.log(len(fitting)) - log_probability) for k in fitting)
    return found


def _radii(half: Floats, solids: Floats, zones: Sequence[Zone]) -> tuple[float, float]:
    def reach(rows: Sequence[Sequence[float]]) -> float:
        return max((math.hypot(abs(row[0]) + row[4], abs(row[1]) + row[5]) for row in rows), default=0.0)

    inner = max(reach([list(row) for row in solids]), float(np.hypot(*half)))
    return inner, max(inner, reach(zones))


def _centroid(polygon: Floats) -> Floats:
    following = np.roll(polygon, -1, 0)
    cross = polygon[:, 0] * following[:, 1] - following[:, 0] * polygon[:, 1]
    return np.asarray(((polygon + following) * cross[:, None]).sum(0) / (3.0 * cross.sum()))


def _firsts(lists: Sequence[Sequence[T] | Floats]) -> Ints:
    return np.concatenate([[0], np.cumsum([len(rows) for rows in lists])]).astype(np.int64)


def _rows(rows: Sequence[Sequence[float | None]], columns: int) -> Floats:
    return np.array([[math.nan if x is None else x for x in row] for row in rows], np.float64).reshape(-1, columns)
