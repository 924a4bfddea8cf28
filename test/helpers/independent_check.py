"""Furnished rooms checked from their JSON alone, with polygons of shapely in place of the package's own geometry.

Compounds, zones and thresholds come from the configuration; nothing of the generator's validity code is used.  Distances are exact here,
where the generator works on a raster, so what is near a limit of the floor checks is held to ``RASTER_M``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, NamedTuple

from shapely import LineString, Point, Polygon, union_all
from shapely.affinity import rotate, translate
from shapely.geometry.base import BaseGeometry

from grammar.spec.categories import Categories
from grammar.spec.rules import Grammar

RASTER_M = 0.05
"""Side of the generator's cells: a passage may be this much narrower to the raster than it is."""

Scene = Mapping[str, Any]


class Block(NamedTuple):
    """A solid of an object: whose, its footprint and heights in metres."""

    owner: int
    shape: Polygon
    low: float
    high: float


def faults(scene: Scene, grammar: Grammar, categories: Categories) -> list[str]:
    """Return what is wrong with a room, one line each; an empty list means that it is valid.

    Args:
        scene: the JSON document ``scene_synth/1``.
        grammar: that the room was sampled from: thresholds, rules of the objects, zones of the openings.
        categories: the boxes and tops of the objects' categories.
    """
    blocks = list(_blocks(scene, categories))
    checks = (_collisions, _bounds, _supports, _openings, _floor)
    return [line for check in checks for line in check(scene, blocks, grammar, categories)]


def _rectangle(x: float, y: float, x_low: float, x_high: float, y_low: float, y_high: float, yaw: float) -> Polygon:
    local = Polygon([(x_low, y_low), (x_high, y_low), (x_high, y_high), (x_low, y_high)])
    return translate(rotate(local, yaw, origin=(0, 0), use_radians=True), x, y)


def _blocks(scene: Scene, categories: Categories) -> Iterator[Block]:
    for thing in scene["objects"]:
        (x, y, z), size = thing["position_m"], thing["size_m"]
        solids = categories[thing["category"]].solids
        bounds = [((0, 0, 0), (1, 1, 1), (0, 0, 0), (0, 0, 0))] if solids is None else [
            (solid.low_fraction, solid.high_fraction, solid.low_m, solid.high_m) for solid in solids
        ]  # fmt: skip
        for low_part, high_part, low_m, high_m in bounds:
            low = [min(max(f * side + m, 0.0), side) for f, side, m in zip(low_part, size, low_m, strict=True)]
            high = [min(max(f * side + m, 0.0), side) for f, side, m in zip(high_part, size, high_m, strict=True)]
            if all(a < b for a, b in zip(low, high, strict=True)):
                half_d, half_w = 0.5 * size[0], 0.5 * size[1]
                shape = _rectangle(x, y, low[0] - half_d, high[0] - half_d, low[1] - half_w, high[1] - half_w, thing["yaw_rad"])
                yield Block(thing["id"], shape, z + low[2], z + high[2])


def _deeper(a: BaseGeometry, b: BaseGeometry, limit: float) -> bool:
    """Return whether two convex shapes still meet once both are shrunk by half of a limit."""
    if not a.intersects(b):
        return False
    return bool(a.buffer(-0.5 * limit, join_style="mitre").intersection(b.buffer(-0.5 * limit, join_style="mitre")).area > 1e-9)


def _collisions(scene: Scene, blocks: list[Block], grammar: Grammar, categories: Categories) -> Iterator[str]:
    del scene, categories
    limit = grammar.validity.penetration_m
    for a, b in combinations(blocks, 2):
        if a.owner != b.owner and min(a.high, b.high) - max(a.low, b.low) > limit and _deeper(a.shape, b.shape, limit):
            yield f"collision: {a.owner} and {b.owner}"


def _bounds(scene: Scene, blocks: list[Block], grammar: Grammar, categories: Categories) -> Iterator[str]:
    del categories
    limit = 1.0001 * grammar.validity.outside_m
    corners = scene["room"]["polygon_m"]
    room = Polygon(corners).buffer(limit, join_style="mitre")
    for block in blocks:
        if not room.contains(block.shape) or block.low < -limit or block.high > scene["room"]["height_m"] + limit:
            yield f"outside: {block.owner}"
        for slope in scene["room"].get("slopes", ()):
            tangent, top = math.tan(slope["pitch_rad"]), block.high - slope["eaves_height_m"]
            (ax, ay), (bx, by) = corners[slope["wall"]], corners[(slope["wall"] + 1) % len(corners)]
            # the line of the wall far beyond its ends, as floors may be wider farther in; square to the plane it is nearer by the cosine
            line = LineString([(ax - 9 * (bx - ax), ay - 9 * (by - ay)), (bx + 9 * (bx - ax), by + 9 * (by - ay))])
            if (top - tangent * block.shape.distance(line)) * math.cos(slope["pitch_rad"]) > limit:
                yield f"above the slope of wall {slope['wall']}: {block.owner}"


def _supports(scene: Scene, blocks: list[Block], grammar: Grammar, categories: Categories) -> Iterator[str]:
    del blocks
    limits, by_id = grammar.validity, {thing["id"]: thing for thing in scene["objects"]}
    for thing in scene["objects"]:
        (x, y, z), (depth, width, height), support = thing["position_m"], thing["size_m"], thing["support"]
        gap = 0.0
        if support["kind"] == "floor":
            gap = abs(z)
        elif support["kind"] == "ceiling":
            gap = abs(scene["room"]["height_m"] - z - height)
        elif support["kind"] == "wall":
            corners = scene["room"]["polygon_m"]
            wall = LineString([corners[support["wall"]], corners[(support["wall"] + 1) % len(corners)]])
            back = [_offset(thing, -0.5 * depth, side * 0.5 * width) for side in (-1, 1)]
            gap = max(wall.distance(Point(point)) for point in back)
        else:
            below = by_id[support["id"]]
            gap = min((abs(z - top) for top, _ in _tops(below, categories)), default=math.inf)
            foot = _rectangle(x, y, -0.5 * depth, 0.5 * depth, -0.5 * width, 0.5 * width, thing["yaw_rad"])
            on = [shape for top, shape in _tops(below, categories) if abs(z - top) <= limits.gap_m]
            if not any(shape.buffer(1.0001 * limits.outside_m, join_style="mitre").contains(foot) for shape in on):
                yield f"overhang: {thing['id']} on {below['id']}"
        if not gap <= limits.gap_m:
            yield f"floating: {thing['id']} by {gap:.4f} m"


def _offset(thing: Mapping[str, Any], forward: float, left: float) -> tuple[float, float]:
    c, s = math.cos(thing["yaw_rad"]), math.sin(thing["yaw_rad"])
    return thing["position_m"][0] + forward * c - left * s, thing["position_m"][1] + forward * s + left * c


def _tops(thing: Mapping[str, Any], categories: Categories) -> Iterator[tuple[float, Polygon]]:
    x, y, z = thing["position_m"]
    depth, width, height = thing["size_m"]
    for top in categories[thing["category"]].surfaces:
        half_d, half_w = max(0.5 * depth - top.inset_m, 0.0), max(0.5 * width - top.inset_m, 0.0)
        yield z + top.height_fraction * height + top.height_m, _rectangle(x, y, -half_d, half_d, -half_w, half_w, thing["yaw_rad"])
    for rest in categories[thing["category"]].rests:
        (back, front), (right, left) = (
            [(share - 0.5) * side for share in part] for part, side in ((rest.depth, depth), (rest.width, width))
        )
        yield z + rest.height * height + rest.height_m, _rectangle(x, y, back, front, right, left, thing["yaw_rad"])


def _opening_zone(scene: Scene, opening: Mapping[str, Any], depth: float) -> Polygon:
    corners = scene["room"]["polygon_m"]
    (ax, ay), (bx, by) = corners[opening["wall"]], corners[(opening["wall"] + 1) % len(corners)]
    yaw = math.atan2(by - ay, bx - ax)
    return _rectangle(ax, ay, opening["offset_m"], opening["offset_m"] + opening["width_m"], 0.0, depth, yaw)


def _openings(scene: Scene, blocks: list[Block], grammar: Grammar, categories: Categories) -> Iterator[str]:
    del categories
    limit = grammar.validity.penetration_m
    standing = {thing["id"] for thing in scene["objects"] if thing["support"]["kind"] == "floor"}
    for opening in scene["room"]["openings"]:
        rule, is_door = grammar.openings[opening["category"]], opening["category"] == "door"
        depth = opening["width_m"] if is_door and opening["swing"] == "in" else rule.clear_depth_m
        zone = _opening_zone(scene, opening, depth)
        low, high = opening["sill_m"] + rule.clear_above_sill_m, opening["sill_m"] + opening["height_m"]
        for block in blocks:
            if (is_door or block.owner in standing) and min(high, block.high) - max(low, block.low) > limit:
                if _deeper(zone, block.shape, limit):
                    yield f"{opening['category']} blocked: {opening['id']} by {block.owner}"


def _floor(scene: Scene, blocks: list[Block], grammar: Grammar, categories: Categories) -> Iterator[str]:
    """Check the walkable share and who is reached, with the continuous set of places where a disc fits."""
    del categories
    limits, radius = grammar.validity, grammar.validity.robot_radius_m
    room = Polygon(scene["room"]["polygon_m"])
    solid = union_all([block.shape for block in blocks if block.low < limits.robot_height_m])
    stands = room.buffer(-radius).difference(solid.buffer(radius))
    parts = list(getattr(stands, "geoms", [stands]))
    door = next(opening for opening in scene["room"]["openings"] if opening["category"] == "door")
    entry = _opening_zone(scene, door, 2.0 * radius).centroid
    start = min(parts, key=entry.distance)
    # passages that are open by less than a cell may be closed to the raster, so parts are joined when they are that near
    reached = [part for part in parts if part.distance(start) < 1e-9]
    share = sum(part.area for part in reached) / max(stands.area, 1e-9)
    if entry.distance(start) > 2.0 * RASTER_M or share < limits.walkable_share - 0.01:
        yield f"walkable share {share:.3f}"
    symbol = {node["object"]: node["symbol"] for node in scene["parse_graph"]["nodes"] if node["kind"] == "terminal" and "object" in node}
    walked = union_all(reached).buffer(RASTER_M)
    for thing in scene["objects"]:
        rule = grammar.objects.get(symbol[thing["id"]])  # small things that no grammar has need no reach
        sides = () if rule is None else rule.reach_any
        if sides and not any(walked.intersects(_strip(thing, side, limits.reach_depth_m)) for side in sides):
            yield f"not reached: {thing['id']}"


def _strip(thing: Mapping[str, Any], side: str, depth: float) -> Polygon:
    half_d, half_w = 0.5 * thing["size_m"][0], 0.5 * thing["size_m"][1]
    bounds = {
        "front": (half_d, half_d + depth, -half_w, half_w),
        "back": (-half_d - depth, -half_d, -half_w, half_w),
        "left": (-half_d, half_d, half_w, half_w + depth),
        "right": (-half_d, half_d, -half_w - depth, -half_w),
    }[side]
    return _rectangle(*thing["position_m"][:2], *bounds, thing["yaw_rad"])
