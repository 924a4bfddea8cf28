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

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.checks.furnished import Furnished, furnished, in_boxes, outside, strip_points
from grammar.geometry.arrays import Bools, Boxes, Floats, Ints
from grammar.geometry.boxes import (
    HALF_DEPTH,
    HALF_WIDTH,
    NO_BOXES,
    Z_HIGH,
    Z_LOW,
    box_rows,
    deepest_penetrations,
    footprint_corners,
    segment_inside_length,
)
from grammar.geometry.free_space import rasterize, reachable, walkable_share
from grammar.geometry.slopes import above_slopes, low_ceiling, slope_rows
from grammar.geometry.solids import object_sheets, rest_top, surface_top, whole_box
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, REFLEX, START_X, START_Y, outside_distances
from grammar.geometry.zones import FACE, object_zones, opening_frame, opening_zones, placed_zones, side_rectangle
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule
from grammar.spec.request import RequestError
from grammar.spec.rules import Grammar, Thresholds
from scene_description import Opening, Room, SceneObject, ValidityCheck, ValidityReport
from scene_description.ceilings import ceiling_over_opening_m


def check_room(
    grammar: Grammar, categories: Categories, room: Room, objects: Sequence[SceneObject], rules: Mapping[int, ObjectRule], attempts: int
) -> ValidityReport:
    """Check a furnished room; ``rules``: object id -> its rule; ``attempts``: how many layouts were tried, for the report."""
    limits = grammar.validity
    found = furnished(grammar.room_type, room, objects, categories)
    low = low_ceiling(room, limits.robot_height_m)
    under = replace(found, boxes=np.concatenate([found.boxes, low]), owner=np.concatenate([found.owner, np.zeros(len(low), np.int64)]))
    checks = (
        _at_most("collision", limits.penetration_m, _depths(found.boxes, found.owner, found.boxes, found.owner)),
        _check_bounds(limits, found),
        *_check_support(limits, found),
        *_check_openings(grammar, found),
        _check_wall_space(grammar, found, rules),
        *_check_floor(limits, under, rules),
        _check_sides(limits, under, rules),
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


def _depths(boxes: Boxes, owner: Ints, others: Boxes, other_owner: Ints | None = None) -> dict[int, float]:
    """Return by owner how deep its boxes penetrate those of others, by default of nobody."""
    of = np.zeros(len(others), np.int64) if other_owner is None else other_owner
    return _worst_by_owner(deepest_penetrations(boxes, owner, others, of), owner)


def _check_bounds(limits: Thresholds, found: Furnished) -> ValidityCheck:
    room, boxes, owner = found.room, found.boxes, found.owner
    rows = np.concatenate([boxes, box_rows(whole_box(item) for item in found.objects)])
    owners = np.concatenate([owner, np.array([item.id for item in found.objects], np.int64)])
    worst = _worst_by_owner(_outside(found.wall, room.height_m, rows, limits.outside_m), owners)
    if room.slopes is not None:
        slope = slope_rows(room)
        for k, key in enumerate(owner.tolist()):
            worst[key] = max(worst[key], float(above_slopes(slope, boxes, k)))
        for opening in room.openings:
            worst[opening.id] = max(opening.sill_m + opening.height_m - ceiling_over_opening_m(room, opening), 0.0)
    return _at_most("out_of_bounds", limits.outside_m, worst)


def _outside(wall: Floats, ceiling_m: float, boxes: Boxes, tolerance_m: float) -> Floats:
    """Return (n,) how far boxes lie outside the room; if only a wall cuts through one between its corners, the wall's length in it."""
    corners = outside_distances(wall, footprint_corners(boxes).reshape(-1, 2)).reshape(-1, 4)
    worst: Floats = np.maximum(np.maximum(-boxes[:, Z_LOW], boxes[:, Z_HIGH] - ceiling_m), corners.max(axis=1))
    if wall[:, REFLEX].any():  # no wall gets between the corners where none sticks into the room
        inner = boxes.copy()
        inner[:, [HALF_DEPTH, HALF_WIDTH]] = np.maximum(boxes[:, [HALF_DEPTH, HALF_WIDTH]] - tolerance_m, 0.0)
        for k in np.flatnonzero(worst <= tolerance_m):
            for ax, ay, tx, ty, length in wall[:, [START_X, START_Y, ALONG_X, ALONG_Y, LENGTH]]:
                worst[k] = max(worst[k], segment_inside_length(inner[k], ax, ay, ax + tx * length, ay + ty * length))
    return worst


def _check_support(limits: Thresholds, found: Furnished) -> tuple[ValidityCheck, ValidityCheck]:
    by_id = {item.id: item for item in found.objects}
    gaps, overhangs = {}, {}
    for item in found.objects:
        if item.support.kind == "object":
            below = by_id.get(item.support.id or 0)
            gaps[item.id], overhangs[item.id] = _gap_to_surface(found.categories, item, below) if below else (item.position_m[2], 0.0)
        else:
            gaps[item.id] = _gap_to_room(found.room, item)
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


def _opening_boxes(grammar: Grammar, room: Room, kind: str, faces: bool) -> Boxes:
    rows = []
    for opening in room.openings:
        if kind == opening.category or (kind == "door" and opening.category == "garage_door"):
            x, y, yaw = opening_frame(room, opening)
            zones = [z for z in opening_zones(opening, grammar.openings[opening.category]) if (z.kind == FACE) == faces]
            rows.append(placed_zones(zones, x, y, opening.sill_m, yaw))
    return np.concatenate(rows) if rows else NO_BOXES


def _check_openings(grammar: Grammar, found: Furnished) -> tuple[ValidityCheck, ValidityCheck]:
    limit, standing = grammar.validity.penetration_m, _supported_by(found, "floor")
    doors = _opening_boxes(grammar, found.room, "door", False)
    windows = _opening_boxes(grammar, found.room, "window", False)
    sheets, of = object_sheets(found.categories, found.objects)
    low, low_owner = np.concatenate([found.boxes, sheets]), np.concatenate([found.owner, of])
    return (
        _at_most("door_clear", limit, _depths(low, low_owner, doors)),
        _at_most("window_clear", limit, _depths(found.boxes[standing], found.owner[standing], windows)),
    )


def _check_wall_space(grammar: Grammar, found: Furnished, rules: Mapping[int, ObjectRule]) -> ValidityCheck:
    standing, hanging = _supported_by(found, "floor"), _supported_by(found, "wall")
    hung = [item for item in found.objects if item.support.kind == "wall"]
    before = [placed_zones(object_zones(rules[item.id], item.size_m), *item.position_m, item.yaw_rad) for item in hung]
    curtains = np.isin(found.owner, [item.id for item in found.having("curtain")])
    covered: dict[int, float] = {}
    for kept, kind in ((hanging & ~curtains, "window"), (hanging, "door")):
        for owner, depth in _depths(found.boxes[kept], found.owner[kept], _opening_boxes(grammar, found.room, kind, True)).items():
            covered[owner] = max(depth, covered.get(owner, 0.0))
    hidden = _depths(found.boxes[standing], found.owner[standing], np.concatenate([NO_BOXES, *before]))
    return _at_most("wall_clear", grammar.validity.penetration_m, {**covered, **hidden})


def _supported_by(found: Furnished, kind: str) -> Bools:
    """Return (n,) whether the owner of each box has this kind of support."""
    return np.isin(found.owner, [item.id for item in found.objects if item.support.kind == kind])


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


def _check_floor(limits: Thresholds, found: Furnished, rules: Mapping[int, ObjectRule]) -> tuple[ValidityCheck, ValidityCheck]:
    free = rasterize(found.room.polygon_m, found.boxes, limits.grid_resolution_m, limits.robot_height_m)
    start = door_start_m(found.room, limits.robot_radius_m)
    share = walkable_share(free, limits.robot_radius_m, start)
    reached = np.argwhere(reachable(free, limits.robot_radius_m, start))
    points = np.array(free.origin_m) + (reached[:, ::-1] + 0.5) * free.resolution_m
    missed = {
        item.id: float(not any(_touches(item, side, limits.reach_depth_m, points) for side in rules[item.id].reach_any))
        for item in found.objects
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


def _check_sides(limits: Thresholds, found: Furnished, rules: Mapping[int, ObjectRule]) -> ValidityCheck:
    low = found.boxes[:, Z_LOW] < limits.robot_height_m
    share = {}
    for item in found.objects:
        if rules[item.id].reach_any:
            others = found.boxes[low & (found.owner != item.id)]
            share[item.id] = max(_free_share(limits, found, item, side, others) for side in rules[item.id].reach_any)
    blocked = tuple(sorted(key for key, value in share.items() if value < limits.side_share))
    return ValidityCheck(
        name="side_clear", value=min(share.values(), default=1.0), limit=limits.side_share, passed=not blocked, objects=blocked
    )


def _free_share(limits: Thresholds, found: Furnished, item: SceneObject, side: str, others: Boxes) -> float:
    """Return the share of a strip along a side of an object that lies inside the room and in none of ``others``."""
    points = strip_points(item, side, limits.side_gap_m, limits.side_depth_m)
    free = ~in_boxes(points, others)
    free[free] = ~outside(found, points[free])
    return float(np.mean(free))
