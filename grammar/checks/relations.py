"""Which relations of a finished room are kept: satisfied over declared relations, by kind (scene-graph validity).

A grammar declares for an object where it likes to be at walls, around its core and on its supporter, as modes.  The relation is satisfied
if the object stands within the tolerance of one of them: 0.1 m and 15 degrees, and three times the mean deviation with which the object
keeps to that mode, which is its spread over the tidiness times the relation's weight.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from grammar.derivation.addresses import corners_of
from grammar.geometry.solids import surface_top
from grammar.geometry.walls import ALONG_X, ALONG_Y, START_X, START_Y, WALL_YAW, wall_rows
from grammar.layout.assemble import around_target
from grammar.spec.categories import Categories
from grammar.spec.rules import CORNER, Grammar, Mode, ObjectRule
from scene_description import ParseGraph, Room, SceneObject

DISTANCE_M, ANGLE_RAD, DEVIATIONS = 0.1, math.radians(15.0), 3.0

KINDS = ("wall", "group", "support")

Kept = Mapping[str, tuple[int, int]]
"""Kind of relation -> (satisfied, declared)."""


class _Base(NamedTuple):
    """What an object's relation refers to: pose in the world and size."""

    x_m: float
    y_m: float
    yaw_rad: float
    size_m: tuple[float, float, float]


class _Off(NamedTuple):
    """How far an object is from a mode of a relation."""

    mode: Mode
    distance_m: float
    angle_rad: float


def kept_relations(grammar: Grammar, categories: Categories, room: Room, objects: Sequence[SceneObject], graph: ParseGraph) -> Kept:
    """Count the relations of a room's objects.

    Args:
        grammar: that the room was sampled from.
        categories: the table of categories.
        room: with its openings and corners.
        objects: all objects of the room.
        graph: tells each object's symbol and core, and the weights of the energy.

    Returns:
        for each of ``KINDS`` how many are satisfied and declared; a relation whose weight is zero is not declared.
    """
    symbols = {node.object: node.symbol for node in graph.nodes if node.kind == "terminal" and node.object is not None}
    rules = {key: grammar.objects[symbol] for key, symbol in symbols.items() if symbol in grammar.objects}
    bases = _bases(room, objects, graph)
    weights, count = graph.weights, {kind: [0, 0] for kind in KINDS}
    for thing in objects:
        rule = rules.get(thing.id)
        if rule is None:
            continue
        relations = {
            "wall": ("wall_distance", "wall_orientation", _at_walls(rule, thing, room)),
            "group": ("group_distance", "group_orientation", _around_core(rule, thing, bases.get(thing.id))),
            "support": ("support_position", "support_orientation", _on_top(rule, thing, objects, categories)),
        }
        for kind, (distance, angle, offs) in relations.items():
            scale = tuple(grammar.schedule.beta * weights[name] for name in (distance, angle))
            found = list(offs)
            if found and max(scale) > 0.0:
                count[kind][0] += any(_within(off, *scale) for off in found)
                count[kind][1] += 1
    return {kind: (satisfied, declared) for kind, (satisfied, declared) in count.items()}


def _within(off: _Off, distance_scale: float, angle_scale: float) -> bool:
    near = DISTANCE_M + DEVIATIONS * off.mode.spread / max(distance_scale, 1e-9)
    turned = ANGLE_RAD + DEVIATIONS * off.mode.orientation_spread / max(angle_scale, 1e-9)
    return off.distance_m <= near and off.angle_rad <= turned


def _angle(turn_rad: float, mean_rad: float | None) -> float:
    return 0.0 if mean_rad is None else abs(math.remainder(turn_rad - mean_rad, 2.0 * math.pi))


def _bases(room: Room, objects: Sequence[SceneObject], graph: ParseGraph) -> dict[int, _Base]:
    """Return for every object that belongs to something the pose and size of that: an object, an opening or a corner of the room."""
    wall = wall_rows(room.polygon_m)
    at = {thing.id: _Base(thing.position_m[0], thing.position_m[1], thing.yaw_rad, thing.size_m) for thing in objects}
    for opening in room.openings:
        along = opening.offset_m + 0.5 * opening.width_m
        x, y = wall[opening.wall, [START_X, START_Y]] + wall[opening.wall, [ALONG_X, ALONG_Y]] * along
        at[opening.id] = _Base(float(x), float(y), float(wall[opening.wall, WALL_YAW]), (0.0, opening.width_m, opening.height_m))
    corners = {f"{CORNER} {corner.vertex}": _Base(corner.x_m, corner.y_m, corner.yaw_rad, (0.0, 0.0, 0.0)) for corner in corners_of(room)}
    chosen = {node.object: node.choice for node in graph.nodes if node.kind == "address" and node.symbol == "core"}
    found: dict[int, _Base] = {}
    for thing in objects:
        base = corners.get(chosen.get(thing.id) or "") if thing.group is None else at.get(thing.group)
        if base is not None:
            found[thing.id] = base
    return found


def _in_frame(base: _Base, thing: SceneObject) -> tuple[float, float, float]:
    """Return an object's x, y and yaw in the frame of what it belongs to."""
    dx, dy = thing.position_m[0] - base.x_m, thing.position_m[1] - base.y_m
    c, s = math.cos(base.yaw_rad), math.sin(base.yaw_rad)
    return dx * c + dy * s, dy * c - dx * s, thing.yaw_rad - base.yaw_rad


def _at_walls(rule: ObjectRule, thing: SceneObject, room: Room) -> Iterator[_Off]:
    """Yield what the gap between footprint and wall and the turn against it are off, for all walls; the gap is the energy's."""
    x, y, yaw = thing.position_m[0], thing.position_m[1], thing.yaw_rad
    for ax, ay, tx, ty, length, nx, ny, wall_yaw, _ in wall_rows(room.polygon_m) if rule.wall else ():
        along, across = (x - ax) * tx + (y - ay) * ty, (x - ax) * nx + (y - ay) * ny
        beyond = max(-along, along - length, 0.0)
        across = math.hypot(across, beyond) if beyond > 0.0 else across
        c, s = math.cos(yaw - wall_yaw), math.sin(yaw - wall_yaw)
        gap = across - 0.5 * (thing.size_m[0] * abs(c) + thing.size_m[1] * abs(s))
        for mode in rule.wall:
            yield _Off(mode, abs(gap - mode.distance_m), _angle(yaw - wall_yaw, mode.orientation_rad))


def _around_core(rule: ObjectRule, thing: SceneObject, base: _Base | None) -> Iterator[_Off]:
    if base is None:
        return
    x, y, turn = _in_frame(base, thing)
    for mode in rule.around:
        mean_x, mean_y, _ = around_target(mode, thing.size_m, base.size_m)
        off = abs(y - mean_y) if rule.mount == "wall" else math.hypot(x - mean_x, y - mean_y)
        yield _Off(mode, off, 0.0 if rule.mount == "wall" else _angle(turn, mode.orientation_rad))


def _on_top(rule: ObjectRule, thing: SceneObject, objects: Sequence[SceneObject], categories: Categories) -> Iterator[_Off]:
    """Yield what an object's place on the top below it is off."""
    below = next((other for other in objects if other.id == thing.support.id), None)
    if thing.support.kind != "object" or below is None:
        return
    tops = [surface_top(top, below.size_m) for top in categories[below.category].surfaces]
    gap = thing.position_m[2] - below.position_m[2]
    _, half_d, half_w = min(tops, key=lambda top: abs(top[0] - gap))
    x, y, turn = _in_frame(_Base(below.position_m[0], below.position_m[1], below.yaw_rad, below.size_m), thing)
    for mode in rule.placements:
        c, s = (1.0, 0.0) if mode.orientation_rad is None else (abs(math.cos(mode.orientation_rad)), abs(math.sin(mode.orientation_rad)))
        free_d = max(half_d - 0.5 * (thing.size_m[0] * c + thing.size_m[1] * s), 0.0)
        free_w = max(half_w - 0.5 * (thing.size_m[0] * s + thing.size_m[1] * c), 0.0)
        across = 0.0 if mode.depth_fraction is None else abs(x - mode.depth_fraction * free_d)
        along = 0.0 if mode.width_fraction is None else abs(y - mode.width_fraction * free_w)
        yield _Off(mode, math.hypot(across, along), _angle(turn, mode.orientation_rad))
