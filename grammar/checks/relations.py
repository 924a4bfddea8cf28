"""Satisfied over declared contextual relations of a finished room, by kind (scene-graph validity).

A grammar declares preferred poses of an object at walls, around its core and on its supporter, as modes.  A relation is satisfied if the
object stands within the tolerance of one mode: 0.1 m and 15 degrees, plus three times the mean deviation from that mode, which is the
mode's spread divided by the tidiness and the relation's weight.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, NamedTuple

from grammar.derivation.drafts import corners_of
from grammar.geometry.solids import surface_top
from grammar.geometry.walls import ALONG_X, ALONG_Y, START_X, START_Y, WALL_YAW, wall_rows
from grammar.layout.assemble import around_target
from grammar.spec.categories import Categories
from grammar.spec.object_rules import CORNER, Mode, ObjectRule
from grammar.spec.rules import Grammar
from scene_description import ParseGraph, Room, SceneObject

DISTANCE_M, ANGLE_RAD, DEVIATIONS = 0.1, math.radians(15.0), 3.0

KINDS = ("wall", "group", "support")

RelationCounts = Mapping[str, tuple[int, int]]
"""Kind of relation -> (satisfied, declared)."""


class _Reference(NamedTuple):
    """What a relation of an object refers to: pose in the world and size."""

    x_m: float
    y_m: float
    yaw_rad: float
    size_m: tuple[float, float, float]
    hinge: Literal["start", "end"] = "start"


class _Deviation(NamedTuple):
    """The deviation of an object from a mode of a relation."""

    mode: Mode
    distance_m: float
    angle_rad: float


def satisfied_relations(
    grammar: Grammar, categories: Categories, room: Room, objects: Sequence[SceneObject], graph: ParseGraph
) -> RelationCounts:
    """Return for each of ``KINDS`` how many relations are satisfied and declared; one whose weight is zero is not declared.

    ``graph`` tells each object's symbol and core, and the weights of the energy.
    """
    symbols = {node.object: node.symbol for node in graph.nodes if node.kind == "terminal" and node.object is not None}
    rules = {key: grammar.objects[symbol] for key, symbol in symbols.items() if symbol in grammar.objects}
    references = _references(room, objects, graph)
    weights, count = graph.weights, {kind: [0, 0] for kind in KINDS}
    for item in objects:
        rule = rules.get(item.id)
        if rule is None:
            continue
        relations = {
            "wall": ("wall_distance", "wall_orientation", _at_walls(rule, item, room)),
            "group": ("group_distance", "group_orientation", _around_core(rule, item, references.get(item.id))),
            "support": ("support_position", "support_orientation", _on_supporter(rule, item, objects, categories)),
        }
        for kind, (distance, angle, deviations) in relations.items():
            scale = tuple(grammar.schedule.beta * weights[name] for name in (distance, angle))
            found = list(deviations)
            if found and max(scale) > 0.0:
                count[kind][0] += any(_within(deviation, *scale) for deviation in found)
                count[kind][1] += 1
    return {kind: (satisfied, declared) for kind, (satisfied, declared) in count.items()}


def _within(deviation: _Deviation, distance_scale: float, angle_scale: float) -> bool:
    near = DISTANCE_M + DEVIATIONS * deviation.mode.spread / max(distance_scale, 1e-9)
    turned = ANGLE_RAD + DEVIATIONS * deviation.mode.orientation_spread / max(angle_scale, 1e-9)
    return deviation.distance_m <= near and deviation.angle_rad <= turned


def _angle(turn_rad: float, mean_rad: float | None) -> float:
    return 0.0 if mean_rad is None else abs(math.remainder(turn_rad - mean_rad, 2.0 * math.pi))


def _references(room: Room, objects: Sequence[SceneObject], graph: ParseGraph) -> dict[int, _Reference]:
    """Return for every object with a core the pose and size of that core: an object, an opening or a corner of the room."""
    wall = wall_rows(room.polygon_m)
    at = {item.id: _Reference(item.position_m[0], item.position_m[1], item.yaw_rad, item.size_m) for item in objects}
    for opening in room.openings:
        along = opening.offset_m + 0.5 * opening.width_m
        x, y = wall[opening.wall, [START_X, START_Y]] + wall[opening.wall, [ALONG_X, ALONG_Y]] * along
        at[opening.id] = _Reference(
            float(x), float(y), float(wall[opening.wall, WALL_YAW]), (0.0, opening.width_m, opening.height_m), opening.hinge
        )
    corners = {
        f"{CORNER} {corner.vertex}": _Reference(corner.x_m, corner.y_m, corner.yaw_rad, (0.0, 0.0, 0.0)) for corner in corners_of(room)
    }
    chosen = {node.object: node.choice for node in graph.nodes if node.kind == "address" and node.symbol == "core"}
    found: dict[int, _Reference] = {}
    for item in objects:
        reference = corners.get(chosen.get(item.id) or "") if item.group is None else at.get(item.group)
        if reference is not None:
            found[item.id] = reference
    return found


def _relative_pose(reference: _Reference, item: SceneObject) -> tuple[float, float, float]:
    """Return an object's x, y and yaw in the frame of a reference."""
    dx, dy = item.position_m[0] - reference.x_m, item.position_m[1] - reference.y_m
    c, s = math.cos(reference.yaw_rad), math.sin(reference.yaw_rad)
    return dx * c + dy * s, dy * c - dx * s, item.yaw_rad - reference.yaw_rad


def _at_walls(rule: ObjectRule, item: SceneObject, room: Room) -> Iterator[_Deviation]:
    """Yield the deviations of an object from its wall modes, for all walls; the gap to a wall is measured as the energy does."""
    x, y, yaw = item.position_m[0], item.position_m[1], item.yaw_rad
    for ax, ay, tx, ty, length, nx, ny, wall_yaw, _ in wall_rows(room.polygon_m) if rule.wall else ():
        along, across = (x - ax) * tx + (y - ay) * ty, (x - ax) * nx + (y - ay) * ny
        beyond = max(-along, along - length, 0.0)
        across = math.hypot(across, beyond) if beyond > 0.0 else across
        c, s = math.cos(yaw - wall_yaw), math.sin(yaw - wall_yaw)
        gap = across - 0.5 * (item.size_m[0] * abs(c) + item.size_m[1] * abs(s))
        for mode in rule.wall:
            yield _Deviation(mode, abs(gap - mode.distance_m), _angle(yaw - wall_yaw, mode.orientation_rad))


def _around_core(rule: ObjectRule, item: SceneObject, reference: _Reference | None) -> Iterator[_Deviation]:
    """Yield the deviations of an object from its modes around its core; what hangs is judged along its wall only."""
    if reference is None:
        return
    x, y, turn = _relative_pose(reference, item)
    for mode in rule.around:
        mean_x, mean_y, _ = around_target(mode.at_door(reference.hinge), item.size_m, reference.size_m)
        off = abs(y - mean_y) if rule.mount == "wall" else math.hypot(x - mean_x, y - mean_y)
        yield _Deviation(mode, off, 0.0 if rule.mount == "wall" else _angle(turn, mode.orientation_rad))


def _on_supporter(rule: ObjectRule, item: SceneObject, objects: Sequence[SceneObject], categories: Categories) -> Iterator[_Deviation]:
    """Yield the deviations of an object from its modes on the support surface that it stands on."""
    below = next((other for other in objects if other.id == item.support.id), None)
    if item.support.kind != "object" or below is None:
        return
    surfaces = [surface_top(surface, below.size_m) for surface in categories[below.category].surfaces]
    gap = item.position_m[2] - below.position_m[2]
    _, half_d, half_w = min(surfaces, key=lambda surface: abs(surface[0] - gap))
    x, y, turn = _relative_pose(_Reference(below.position_m[0], below.position_m[1], below.yaw_rad, below.size_m), item)
    for mode in rule.placements:
        c, s = (1.0, 0.0) if mode.orientation_rad is None else (abs(math.cos(mode.orientation_rad)), abs(math.sin(mode.orientation_rad)))
        free_d = max(half_d - 0.5 * (item.size_m[0] * c + item.size_m[1] * s), 0.0)
        free_w = max(half_w - 0.5 * (item.size_m[0] * s + item.size_m[1] * c), 0.0)
        across = 0.0 if mode.depth_fraction is None else abs(x - mode.depth_fraction * free_d)
        along = 0.0 if mode.width_fraction is None else abs(y - mode.width_fraction * free_w)
        yield _Deviation(mode, math.hypot(across, along), _angle(turn, mode.orientation_rad))
