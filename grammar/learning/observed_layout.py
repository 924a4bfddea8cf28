"""An observed room as a layout problem of the grammar and the state that it was seen in: where the data's chain begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grammar.derivation.parse_tree import Item, ParseTree
from grammar.geometry import boxes
from grammar.geometry.boxes import row_penetration
from grammar.geometry.walls import wall_lengths
from grammar.layout import columns as col
from grammar.layout.assemble import assemble
from grammar.layout.frames import place_object
from grammar.layout.problem import Problem, State
from grammar.learning.assign import AssignedRoom
from grammar.learning.geometry import wall_poses
from grammar.spec.categories import Categories
from grammar.spec.rules import Grammar
from scene_description.types import Room

_OVERLAP_M = 0.03
_HEIGHTS_M = 1e-3


def observed_layout(grammar: Grammar, categories: Categories, room: AssignedRoom) -> tuple[Problem, State] | None:
    """Return the problem and the observed state, None if fewer than two objects are left.

    Left out are objects on nothing that the grammar lets carry them, hanging objects away from walls, and the smaller one of two that
    stand deep in each other, since no chain of the grammar leaves them so.  Rooms are taken without doors and windows.
    """
    items = _items(grammar, room)
    while items:
        shell = Room(
            polygon_m=room.room.polygon_m,
            height_m=room.room.height_m,
            wall_thickness_m=grammar.room.wall_thickness_m,
            openings=(),
            surfaces=(),
        )
        tree = ParseTree(room=shell, items=tuple(item for item, _ in items), nodes=())
        problem, state = assemble(grammar, categories, tree)
        bad = _settle(problem, state, room, [index for _, index in items])
        if bad is None:
            return (problem, state) if len(items) >= 2 else None
        gone = {items[bad][0].id}
        items = _renumbered([pair for pair in items if pair[0].id not in gone], gone)
    return None


def _items(grammar: Grammar, room: AssignedRoom) -> list[tuple[Item, int]]:
    """Return a placed object for each observed one that can take part, with the index of that; ids count from 1."""
    items: list[tuple[Item, int]] = []
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
        item = Item(
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
        items.append((item, i))
    return _renumbered([pair for pair in items if pair[0].id not in dropped], dropped)


def _renumbered(items: Sequence[tuple[Item, int]], gone: set[int]) -> list[tuple[Item, int]]:
    """Return the objects with ids from 1 and references that follow; what stands on an object that is gone goes too."""
    kept = list(items)
    while any(set(item.supporters) & gone for item, _ in kept):
        gone = gone | {item.id for item, _ in kept if set(item.supporters) & gone}
        kept = [pair for pair in kept if pair[0].id not in gone]
    number = {item.id: k + 1 for k, (item, _) in enumerate(kept)}
    return [
        (
            replace(
                item,
                id=number[item.id],
                core=number.get(item.core) if item.core is not None else None,
                supporters=tuple(number[target] for target in item.supporters),
            ),
            index,
        )
        for item, index in kept
    ]


def _settle(problem: Problem, state: State, room: AssignedRoom, indices: Sequence[int]) -> int | None:
    """Write the observed poses; return the index of an object that cannot stay, None if all can."""
    for k, index in enumerate(indices):
        seen = room.objects[index].seen
        state.pose[k] = seen.position_m[0], seen.position_m[1], seen.yaw_rad
        state.active[k] = True
        if problem.mount[k] == col.OBJECT:
            surfaces = problem.targets(k)
            if len(surfaces) == 0:
                return k
            below = int(problem.surface_owner[surfaces[0]])
            base = room.objects[indices[below]].seen.position_m[2]
            height = problem.surface[:, col.SURFACE_Z]
            state.surface[k] = surfaces[int(np.argmin([abs(base + height[surface] - seen.position_m[2]) for surface in surfaces]))]
            state.z[k] = height[state.surface[k]] + (base if problem.mount[below] == col.OBJECT else 0.0)
        elif problem.mount[k] == col.WALL:
            near = [at for at in wall_poses(room.room.polygon_m, seen) if abs(at.turn_rad) < 0.1 and abs(at.gap_m) < 0.1]
            if not near:
                return k
            state.on_wall[k] = min(near, key=lambda at: abs(at.gap_m)).wall
            start_x, start_y, along_x, along_y, length, normal_x, normal_y, wall_yaw, _ = problem.wall[state.on_wall[k]]
            along = (seen.position_m[0] - start_x) * along_x + (seen.position_m[1] - start_y) * along_y
            depth, width = problem.object[k, [col.HALF_DEPTH, col.HALF_WIDTH]]
            if length < 2.0 * width:
                return k
            along = min(max(along, width), length - width)
            state.pose[k] = start_x + along_x * along + normal_x * depth, start_y + along_y * along + normal_y * depth, wall_yaw
        place_object(problem, state, k)
    return _deepest(problem, state)


def _deepest(problem: Problem, state: State) -> int | None:
    """Return the smaller one of the two objects that overlap most, None if none does by much."""
    worst, found = _OVERLAP_M, None
    solids = [range(link[col.SOLIDS], link[col.ZONES]) for link in problem.link]
    owner = np.repeat(np.arange(len(solids)), [len(rows) for rows in solids])
    solid = state.placed[[row for rows in solids for row in rows]]
    area = problem.object[:, col.HALF_DEPTH] * problem.object[:, col.HALF_WIDTH]
    for a in range(len(solid)):
        for b in range(a + 1, len(solid)):
            shared = min(solid[a, boxes.Z_HIGH], solid[b, boxes.Z_HIGH]) - max(solid[a, boxes.Z_LOW], solid[b, boxes.Z_LOW])
            if owner[a] != owner[b] and shared > _HEIGHTS_M:
                depth = row_penetration(solid, a, solid, b)
                if depth > worst:
                    worst = depth
                    found = int(min(owner[a], owner[b], key=lambda i: float(area[i])))
    return found
