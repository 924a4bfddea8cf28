"""An observed room as a layout problem of the grammar and the state that it was seen in: where the data's chain begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grammar.derivation.parse_tree import Item, ParseTree
from grammar.geometry.boxes import row_penetration
from grammar.geometry.walls import WALL_YAW, wall_lengths
from grammar.layout.assemble import assemble
from grammar.layout.energies import place_object
from grammar.layout.problem import BOX, CANDIDATE, HALF_DEPTH, HALF_WIDTH, OBJECT, WALL, ZONE, Problem, State
from grammar.learning.assign import AssignedRoom
from grammar.learning.geometry import wall_poses
from grammar.spec.categories import Categories
from grammar.spec.rules import Grammar
from scene_description.types import Room

_OVERLAP_M = 0.03
_HEIGHTS_M = 1e-3


def observed_layout(grammar: Grammar, categories: Categories, room: AssignedRoom) -> tuple[Problem, State] | None:
    """Return the problem and the observed state, None if fewer than two objects are left.

    Left out are objects on nothing that the grammar lets carry them, hanging things away from walls, and the smaller one of two that
    stand deep in each other, since no chain of the grammar leaves them so.  Rooms are taken without doors and windows.
    """
    things = _things(grammar, room)
    while things:
        shell = Room(
            polygon_m=room.room.polygon_m,
            height_m=room.room.height_m,
            wall_thickness_m=grammar.room.wall_thickness_m,
            openings=(),
            surfaces=(),
        )
        tree = ParseTree(room=shell, items=tuple(thing for thing, _ in things), nodes=())
        problem, state = assemble(grammar, categories, tree)
        bad = _settle(problem, state, room, [index for _, index in things])
        if bad is None:
            return (problem, state) if len(things) >= 2 else None
        gone = {things[bad][0].id}
        things = _renumbered([item for item in things if item[0].id not in gone], gone)
    return None


def _things(grammar: Grammar, room: AssignedRoom) -> list[tuple[Item, int]]:
    """Return a thing for each object that can take part, with the object's index; ids count from 1."""
    things: list[tuple[Item, int]] = []
    dropped: set[int] = set()
    longest = max(wall_lengths(room.room.polygon_m))
    for i, seen in enumerate(room.objects):
        rule = grammar.objects[seen.symbol]
        supported = seen.on is not None and bool(rule.supporters) and room.objects[seen.on].symbol in (rule.supporters or {})
        if (rule.mount == "object") != (seen.on is not None) or (rule.mount == "object" and not supported):
            dropped.add(i + 1)
        elif (rule.mount == "wall" and seen.seen.size_m[1] >= longest) or rule.mount == "ceiling":
            dropped.add(i + 1)
        share = (rule.supporters or {}).get(room.objects[seen.on].symbol, 0.0) if supported and seen.on is not None else 0.0
        thing = Item(
            id=i + 1,
            symbol=seen.symbol,
            rule=rule,
            size_m=seen.seen.size_m,
            core=seen.core + 1 if seen.core is not None else None,
            supporters=(seen.on + 1,) if supported and seen.on is not None else (),
            supporter_log_probability=(math.log(max(share, 1e-6)),) if supported else (),
            bottom_m=max(seen.seen.position_m[2], 0.0) if rule.mount == "wall" else 0.0,
            node=0,
            supporter_node=None,
        )
        things.append((thing, i))
    return _renumbered([item for item in things if item[0].id not in dropped], dropped)


def _renumbered(things: Sequence[tuple[Item, int]], gone: set[int]) -> list[tuple[Item, int]]:
    """Return the things with ids from 1 and references that follow; what stands on a thing that is gone goes too."""
    kept = list(things)
    while any(set(thing.supporters) & gone for thing, _ in kept):
        gone = gone | {thing.id for thing, _ in kept if set(thing.supporters) & gone}
        kept = [item for item in kept if item[0].id not in gone]
    number = {thing.id: k + 1 for k, (thing, _) in enumerate(kept)}
    return [
        (
            replace(
                thing,
                id=number[thing.id],
                core=number.get(thing.core) if thing.core is not None else None,
                supporters=tuple(number[target] for target in thing.supporters),
            ),
            index,
        )
        for thing, index in kept
    ]


def _settle(problem: Problem, state: State, room: AssignedRoom, indices: Sequence[int]) -> int | None:
    """Write the observed poses; return the index of a thing that cannot stay, None if all can."""
    for k, index in enumerate(indices):
        seen = room.objects[index].seen
        state.pose[k] = seen.position_m[0], seen.position_m[1], seen.yaw_rad
        state.active[k] = True
        if problem.mount[k] == OBJECT:
            slots = problem.modes(k, CANDIDATE)[:, 0].astype(np.int64)
            if len(slots) == 0:
                return k
            below = int(problem.slot_owner[slots[0]])
            base = room.objects[indices[below]].seen.position_m[2]
            state.slot[k] = slots[int(np.argmin([abs(base + problem.slot[slot, 2] - seen.position_m[2]) for slot in slots]))]
            state.z[k] = problem.slot[state.slot[k], 2] + (base if problem.mount[below] == OBJECT else 0.0)
        elif problem.mount[k] == WALL:
            walls = [item for item in wall_poses(room.room.polygon_m, seen) if abs(item.turn_rad) < 0.1 and abs(item.gap_m) < 0.1]
            if not walls:
                return k
            wall = min(walls, key=lambda item: abs(item.gap_m)).wall
            row = problem.wall[wall]
            along = (seen.position_m[0] - row[0]) * row[2] + (seen.position_m[1] - row[1]) * row[3]
            depth, width = problem.object[k, HALF_DEPTH], problem.object[k, HALF_WIDTH]
            along = min(max(along, width), row[4] - width)
            if row[4] < 2.0 * width:
                return k
            state.pose[k] = row[0] + row[2] * along + row[5] * depth, row[1] + row[3] * along + row[6] * depth, row[WALL_YAW]
            state.on_wall[k] = wall
        place_object(problem, state, k)
    return _deepest(problem, state)


def _deepest(problem: Problem, state: State) -> int | None:
    """Return the smaller one of the two things that overlap most, None if none does by much."""
    worst, found = _OVERLAP_M, None
    solids = [range(link[BOX], link[ZONE]) for link in problem.link]
    owner = np.repeat(np.arange(len(solids)), [len(rows) for rows in solids])
    solid = state.placed[[row for rows in solids for row in rows]]
    area = problem.object[:, HALF_DEPTH] * problem.object[:, HALF_WIDTH]
    for a in range(len(solid)):
        for b in range(a + 1, len(solid)):
            if owner[a] != owner[b] and min(solid[a, 3], solid[b, 3]) - max(solid[a, 2], solid[b, 2]) > _HEIGHTS_M:
                depth = row_penetration(solid, a, solid, b)
                if depth > worst:
                    worst = depth
                    found = int(min(owner[a], owner[b], key=lambda i: float(area[i])))
    return found
