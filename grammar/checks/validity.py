"""Exact checks of a furnished room; a room that fails one is rejected.

- collision: no two objects' solids share more than the threshold, along the direction of least separation (a box that stands on another
  only touches it)
- out_of_bounds: every solid lies inside the floor polygon, above the floor and under the ceiling, and openings do under its slopes
- floating: gap to the floor, wall, ceiling or support surface of the object; overhang: how far its footprint sticks out of that surface
- door_clear, window_clear: depth of solids in the zones before doors and windows, of rugs in what a door sweeps; wall_clear: the same
  before pictures and mirrors, and for what hangs over an opening or behind an open door
- walkable_share: share of the free floor that a robot reaches from the door; reachable: number of seats, beds and stores that it does not
- side_clear: free share of a strip along the freest side by which a seat, bed or store is used, the least over these
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from grammar.geometry.arrays import Bools, Boxes, Floats, Ints
from grammar.geometry.boxes import (
    COS_YAW,
    HALF_DEPTH,
    HALF_WIDTH,
    NO_BOXES,
    SIN_YAW,
    Z_HIGH,
    Z_LOW,
    X,
    Y,
    box_rows,
    deepest_penetrations,
    footprint_corners,
    segment_inside_length,
)
from grammar.geometry.free_space import rasterize, reachable, walkable_share
from grammar.geometry.slopes import above_slopes, low_ceiling, slope_rows
from grammar.geometry.solids import object_sheets, object_solids, rest_top, surface_top, whole_box
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, START_X, START_Y, outside_distance, wall_rows
from grammar.geometry.zones import FACE, object_zones, opening_frame, opening_zones, placed_zones, side_rectangle
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule
from grammar.spec.request import RequestError
from grammar.spec.rules import Grammar, Thresholds
from scene_description import Opening, Room, SceneObject, ValidityCheck, ValidityReport
from scene_description.ceilings import ceiling_over_opening_m

_STRIP_POINTS = 12


def check_room(
    grammar: Grammar, categories: Categories, room: Room, objects: Sequence[SceneObject], rules: Mapping[int, ObjectRule], attempts: int
) -> ValidityReport:
    """Check a furnished room; ``rules``: object id -> its rule; ``attempts``: how many layouts were tried, for the report."""
    limits = grammar.validity
    boxes, owner = object_solids(categories, objects)
    low = low_ceiling(room, limits.robot_height_m)
    taken, taken_by = np.concatenate([boxes, low]), np.concatenate([owner, np.zeros(len(low), np.int64)])
    checks = (
        _check_collision(limits, boxes, owner),
        _check_bounds(limits, room, objects, boxes, owner),
        *_check_support(limits, categories, room, objects),
        *_check_openings(grammar, categories, room, objects, boxes, owner),
        _check_wall_space(grammar, room, objects, rules, boxes, owner),
        *_check_floor(limits, room, objects, rules, taken),
        _check_sides(limits, room, objects, rules, taken, taken_by),
    )
    return ValidityReport(valid=all(check.passed for check in checks), attempts=attempts, checks=checks)


def _at_most(name: str, limit: float, values: Mapping[int, float]) -> ValidityCheck:
    """Return a check that holds the greatest value per object id to a limit."""
    worst = max(values.values(), default=0.0)
    at_fault = tuple(sorted(key for key, value in values.items() if not value <= limit))
    return ValidityCheck(name=name, value=worst, limit=limit, passed=not at_fault, objects=at_fault)


def _worst_by_owner(depth: Floats, owner: Ints) -> dict[int, float]:
    worst: dict[int, float] = {}
    for value, key in zip(depth.tolist(), owner.tolist(), strict=True):
        worst[key] = max(worst.get(key, 0.0), value)
    return worst


def _check_collision(limits: Thresholds, boxes: Boxes, owner: Ints) -> ValidityCheck:
    return _at_most("collision", limits.penetration_m, _worst_by_owner(deepest_penetrations(boxes, owner, boxes, owner), owner))


def _check_bounds(limits: Thresholds, room: Room, objects: Sequence[SceneObject], boxes: Boxes, owner: Ints) -> ValidityCheck:
    rows = np.concatenate([boxes, box_rows(whole_box(item) for item in objects)])
    owners = np.concatenate([owner, np.array([item.id for item in objects], np.int64)])
    wall = wall_rows(room.polygon_m)
    depth = np.array([_outside(wall, room.height_m, row, limits.outside_m) for row in rows])
    worst = _worst_by_owner(depth, owners)
    if room.slopes is not None:
        slope = slope_rows(room)
        for k, key in enumerate(owner.tolist()):
            worst[key] = max(worst[key], float(above_slopes(slope, boxes, k)))
        for opening in room.openings:
            worst[opening.id] = max(opening.sill_m + opening.height_m - ceiling_over_opening_m(room, opening), 0.0)
    return _at_most("out_of_bounds", limits.outside_m, worst)


def _outside(wall: Floats, ceiling_m: float, box: Boxes, tolerance_m: float) -> float:
    """Return how far a box lies outside the room; if only a wall cuts through it between its corners, the wall's length in it."""
    worst = max(-box[Z_LOW], box[Z_HIGH] - ceiling_m, 0.0)
    for x, y in footprint_corners(box):
        worst = max(worst, outside_distance(wall, x, y))
    if worst <= tolerance_m:
        inner = box.copy()
        inner[[HALF_DEPTH, HALF_WIDTH]] = np.maximum(box[[HALF_DEPTH, HALF_WIDTH]] - tolerance_m, 0.0)
        for ax, ay, tx, ty, length in wall[:, [START_X, START_Y, ALONG_X, ALONG_Y, LENGTH]]:
            worst = max(worst, segment_inside_length(inner, ax, ay, ax + tx * length, ay + ty * length))
    return float(worst)


def _check_support(
    limits: Thresholds, categories: Categories, room: Room, objects: Sequence[SceneObject]
) -> tuple[ValidityCheck, ValidityCheck]:
    by_id = {item.id: item for item in objects}
    gaps, overhangs = {}, {}
    for item in objects:
        if item.support.kind == "object":
            below = by_id.get(item.support.id or 0)
            gaps[item.id], overhangs[item.id] = _gap_to_surface(categories, item, below) if below else (item.position_m[2], 0.0)
        else:
            gaps[item.id] = _gap_to_room(room, item)
    return _at_most("floating", limits.gap_m, gaps), _at_most("overhang", limits.outside_m, overhangs)


def _gap_to_surface(categories: Categories, item: SceneObject, below: SceneObject) -> tuple[float, float]:
    """Return the vertical gap to the nearest support surface of the supporter and how far the footprint sticks out of it."""
    turn = item.yaw_rad - below.yaw_rad
    c, s = math.cos(below.yaw_rad), math.sin(below.yaw_rad)
    dx, dy = item.position_m[0] - below.position_m[0], item.position_m[1] - below.position_m[1]
    half_d, half_w = 0.5 * item.size_m[0], 0.5 * item.size_m[1]
    reach_d = half_d * abs(math.cos(turn)) + half_w * abs(math.sin(turn))
    reach_w = half_d * abs(math.sin(turn)) + half_w * abs(math.cos(turn))
    category, found = categories[below.category], []
    tops = [(z, 0.0, 0.0, top_d, top_w) for z, top_d, top_w in (surface_top(surface, below.size_m) for surface in category.surfaces)]
    for height, x, y, top_d, top_w in (*tops, *(rest_top(rest, below.size_m) for rest in category.rests)):
        out = max(abs(dx * c + dy * s - x) + reach_d - top_d, abs(dy * c - dx * s - y) + reach_w - top_w, 0.0)
        found.append((abs(item.position_m[2] - below.position_m[2] - height), out))
    return min(found, default=(math.hypot(*item.size_m), 0.0))


def _gap_to_room(room: Room, item: SceneObject) -> float:
    """Return the gap of an object to the floor, the ceiling or the wall that supports it."""
    x, y, z = item.position_m
    if item.support.kind == "floor":
        return abs(z)
    if item.support.kind == "ceiling":
        return abs(room.height_m - z - item.size_m[2])
    wall = item.support.wall or 0
    (ax, ay), (bx, by) = room.polygon_m[wall], room.polygon_m[(wall + 1) % len(room.polygon_m)]
    length = math.hypot(bx - ax, by - ay)
    back = 0.5 * item.size_m[0]
    back_x, back_y = x - back * math.cos(item.yaw_rad), y - back * math.sin(item.yaw_rad)
    turn = math.sin(item.yaw_rad - math.atan2(bx - ax, ay - by))
    across = ((back_x - ax) * (ay - by) + (back_y - ay) * (bx - ax)) / length
    return abs(across) + 0.5 * item.size_m[1] * abs(turn)


def _zone_check(name: str, limit: float, zones: Boxes, boxes: Boxes, owner: Ints, zone_owner: Ints) -> ValidityCheck:
    return _at_most(name, limit, _worst_by_owner(deepest_penetrations(boxes, owner, zones, zone_owner), owner))


def _opening_boxes(grammar: Grammar, room: Room, kind: str, faces: bool) -> Boxes:
    rows = []
    for opening in room.openings:
        if kind in (opening.category, "any"):
            x, y, yaw = opening_frame(room, opening)
            zones = [z for z in opening_zones(opening, grammar.openings[opening.category]) if (z.kind == FACE) == faces]
            rows.append(placed_zones(zones, x, y, opening.sill_m, yaw))
    return np.concatenate(rows) if rows else NO_BOXES


def _check_openings(
    grammar: Grammar, categories: Categories, room: Room, objects: Sequence[SceneObject], boxes: Boxes, owner: Ints
) -> tuple[ValidityCheck, ValidityCheck]:
    standing = _supported_by(objects, owner, "floor")
    limit = grammar.validity.penetration_m
    doors = np.concatenate([_opening_boxes(grammar, room, kind, False) for kind in ("door", "garage_door")])
    windows = _opening_boxes(grammar, room, "window", False)
    sheets, of = object_sheets(categories, objects)
    low, low_owner = np.concatenate([boxes, sheets]), np.concatenate([owner, of])
    return (
        _zone_check("door_clear", limit, doors, low, low_owner, np.zeros(len(doors), np.int64)),
        _zone_check("window_clear", limit, windows, boxes[standing], owner[standing], np.zeros(len(windows), np.int64)),
    )


def _check_wall_space(
    grammar: Grammar, room: Room, objects: Sequence[SceneObject], rules: Mapping[int, ObjectRule], boxes: Boxes, owner: Ints
) -> ValidityCheck:
    standing, hanging = _supported_by(objects, owner, "floor"), _supported_by(objects, owner, "wall")
    views = [NO_BOXES]
    for item in objects:
        if item.support.kind == "wall":
            rule = rules[item.id]
            views.append(placed_zones(object_zones(rule, item.size_m), *item.position_m, item.yaw_rad))
    faces, before = _opening_boxes(grammar, room, "any", True), np.concatenate(views)
    covered = deepest_penetrations(boxes[hanging], owner[hanging], faces, np.zeros(len(faces), np.int64))
    hidden = deepest_penetrations(boxes[standing], owner[standing], before, np.zeros(len(before), np.int64))
    depth, owners = np.concatenate([covered, hidden]), np.concatenate([owner[hanging], owner[standing]])
    return _at_most("wall_clear", grammar.validity.penetration_m, _worst_by_owner(depth, owners))


def _supported_by(objects: Sequence[SceneObject], owner: Ints, kind: str) -> Bools:
    """Return (n,) whether the owner of each box has this kind of support."""
    return np.isin(owner, [item.id for item in objects if item.support.kind == kind])


def door_start_m(room: Room, radius_m: float) -> tuple[float, float]:
    """Return the point ``radius_m`` before the middle of the first door, where a robot enters.

    Raises:
        RequestError: the room has no door.
    """
    door: Opening | None = next((opening for opening in room.openings if opening.category == "door"), None)
    if door is None:
        raise RequestError("room: expected a door to enter by, got none; add one to room.openings")
    x, y, yaw = opening_frame(room, door)
    return x + radius_m * math.cos(yaw), y + radius_m * math.sin(yaw)


def _check_floor(
    limits: Thresholds, room: Room, objects: Sequence[SceneObject], rules: Mapping[int, ObjectRule], boxes: Boxes
) -> tuple[ValidityCheck, ValidityCheck]:
    free = rasterize(room.polygon_m, boxes, limits.grid_resolution_m, limits.robot_height_m)
    start = door_start_m(room, limits.robot_radius_m)
    share = walkable_share(free, limits.robot_radius_m, start)
    reached = np.argwhere(reachable(free, limits.robot_radius_m, start))
    points = np.array(free.origin_m) + (reached[:, ::-1] + 0.5) * free.resolution_m
    missed = {
        item.id: float(not any(_touches(item, side, limits.reach_depth_m, points) for side in rules[item.id].reach_any))
        for item in objects
        if rules[item.id].reach_any
    }
    unreached = tuple(sorted(key for key, value in missed.items() if value))
    walkable = ValidityCheck(name="walkable_share", value=share, limit=limits.walkable_share, passed=bool(share >= limits.walkable_share))
    reach = ValidityCheck(name="reachable", value=float(len(unreached)), limit=0.0, passed=not unreached, objects=unreached)
    return walkable, reach


def _touches(item: SceneObject, side: str, depth_m: float, points: Floats) -> bool:
    """Return whether one of the points (n, 2) lies in the strip along a side of an object."""
    x, y, half_d, half_w = side_rectangle(side, depth_m, item.size_m)
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    dx, dy = points[:, 0] - item.position_m[0], points[:, 1] - item.position_m[1]
    return bool(np.any((np.abs(dx * c + dy * s - x) <= half_d) & (np.abs(dy * c - dx * s - y) <= half_w)))


def _check_sides(
    limits: Thresholds, room: Room, objects: Sequence[SceneObject], rules: Mapping[int, ObjectRule], boxes: Boxes, owner: Ints
) -> ValidityCheck:
    low = boxes[:, Z_LOW] < limits.robot_height_m
    wall, share = wall_rows(room.polygon_m), {}
    for item in objects:
        if rules[item.id].reach_any:
            others = boxes[low & (owner != item.id)]
            share[item.id] = max(_free_share(limits, wall, item, side, others) for side in rules[item.id].reach_any)
    blocked = tuple(sorted(key for key, value in share.items() if value < limits.side_share))
    return ValidityCheck(
        name="side_clear", value=min(share.values(), default=1.0), limit=limits.side_share, passed=not blocked, objects=blocked
    )


def _free_share(limits: Thresholds, wall: Floats, item: SceneObject, side: str, others: Boxes) -> float:
    """Return the share of a strip along a side of an object that lies inside the room and in none of ``others``."""
    x, y, half_d, half_w = side_rectangle(side, limits.side_depth_m, item.size_m)
    steps = (np.arange(_STRIP_POINTS) + 0.5) / (0.5 * _STRIP_POINTS) - 1.0
    u, v = np.meshgrid(x + np.sign(x) * limits.side_gap_m + half_d * steps, y + np.sign(y) * limits.side_gap_m + half_w * steps)
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    px, py = (item.position_m[0] + u * c - v * s).ravel(), (item.position_m[1] + u * s + v * c).ravel()
    dx, dy, cos, sin = px[:, None] - others[:, X], py[:, None] - others[:, Y], others[:, COS_YAW], others[:, SIN_YAW]
    taken = (np.abs(dx * cos + dy * sin) < others[:, HALF_DEPTH]) & (np.abs(dy * cos - dx * sin) < others[:, HALF_WIDTH])
    free = [
        not hit and outside_distance(wall, a, b) == 0.0 for hit, a, b in zip(taken.any(1).tolist(), px.tolist(), py.tolist(), strict=True)
    ]
    return float(np.mean(free))
