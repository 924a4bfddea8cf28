"""Objects of layout files: in our conventions, or as boxes by centre and [width, depth, height] whose front faces -y at yaw 0."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from grammar.learning.category_map import CategoryMap
from grammar.learning.geometry import wall_poses
from grammar.learning.layout_fields import UnfitError, read_number, read_numbers
from grammar.learning.observed import ObservedObject
from scene_description.types import Point2

_SIDE_LOW_M, _SIDE_HIGH_M = 0.002, 12.0
_BEYOND_WALLS_M = 0.5


def read_objects(
    objects: Sequence[Any], names: CategoryMap, room_type: str, polygon: Sequence[Point2], *, own: bool
) -> tuple[tuple[ObservedObject, ...], list[str]]:
    """Return the objects that can be used, and the reasons why others cannot.

    Args:
        objects: as the line lists them.
        names: the table of categories.
        room_type: of the room.
        polygon: outline of the room, counter-clockwise.
        own: whether they are in our conventions.
    """
    read = _own_object if own else _foreign_object
    kept: list[ObservedObject] = []
    supporters: list[int | None] = []
    place: dict[int, int] = {}
    reasons: list[str] = []
    for index, data in enumerate(objects):
        try:
            item, supporter = read(data, names, room_type)
            _check_inside(item, polygon)
            if item.category in names.wide and item.size_m[0] > item.size_m[1]:
                item = _turned_wide(item, polygon)
        except UnfitError as unfit:
            reasons.append(str(unfit))
            continue
        place[index] = len(kept)
        kept.append(item)
        supporters.append(supporter)
    # point to supporters by their places among the objects that are kept
    on = [None if supporter is None else place.get(supporter) for supporter in supporters]
    return tuple(replace(item, on=None if on[i] == i else on[i]) for i, item in enumerate(kept)), reasons


def _foreign_object(data: Any, names: CategoryMap, room_type: str) -> tuple[ObservedObject, int | None]:
    """Read a box given by centre and [width, depth, height], front -y: its yaw is a quarter turn behind ours, its ``on`` counts from 1."""
    if not isinstance(data, Mapping):
        raise UnfitError("object: not a JSON object")
    name, raw = data.get("cat"), data.get("raw")
    if not isinstance(name, str):
        raise UnfitError("object: no category")
    category = names.category(room_type, name, raw if isinstance(raw, str) else "")
    if category is None:
        raise UnfitError(f"object: unknown category '{name[:60]}'")
    if category == "":
        raise UnfitError(f"object: category '{name[:60]}' is not learned")
    width, depth, height = read_numbers(data.get("size"), "object: absurd or missing size", _SIDE_LOW_M, _SIDE_HIGH_M)
    x, y, z = read_numbers(data.get("pos"), "object: absurd or missing position", -1e5, 1e5)
    yaw = read_number(data.get("yaw"), "object: no yaw", -100.0, 100.0)
    on = data.get("on")
    target = on - 1 if isinstance(on, int) and not isinstance(on, bool) and on >= 1 else None
    turned = math.remainder(yaw - 0.5 * math.pi, 2.0 * math.pi)
    item = ObservedObject(category=category, size_m=(depth, width, height), position_m=(x, y, z - 0.5 * height), yaw_rad=turned)
    return item, target


def _turned_wide(item: ObservedObject, polygon: Sequence[Point2]) -> ObservedObject:
    """Return an object turned by a quarter in its box, that way round in which its back is nearer to a wall."""
    depth, width, height = item.size_m
    quarters = (math.remainder(item.yaw_rad + turn, 2.0 * math.pi) for turn in (0.5 * math.pi, -0.5 * math.pi))
    turned = [replace(item, size_m=(width, depth, height), yaw_rad=yaw) for yaw in quarters]
    gaps = [
        min((pose.gap_m for pose in wall_poses(polygon, way) if abs(pose.turn_rad) < 0.25 * math.pi), default=math.inf) for way in turned
    ]
    return turned[0] if gaps[0] <= gaps[1] else turned[1]


def _own_object(data: Any, names: CategoryMap, room_type: str) -> tuple[ObservedObject, int | None]:
    del names, room_type
    if not isinstance(data, Mapping) or not isinstance(data.get("category"), str):
        raise UnfitError("object: no category")
    size = read_numbers(data.get("size_m"), "object: absurd or missing size", _SIDE_LOW_M, _SIDE_HIGH_M)
    position = read_numbers(data.get("position_m"), "object: absurd or missing position", -1e5, 1e5)
    yaw = read_number(data.get("yaw_rad"), "object: no yaw", -100.0, 100.0)
    on = data.get("on")
    target = on if isinstance(on, int) and not isinstance(on, bool) and on >= 0 else None
    turned = math.remainder(yaw, 2.0 * math.pi)
    return ObservedObject(category=data["category"], size_m=size, position_m=position, yaw_rad=turned), target


def _check_inside(item: ObservedObject, polygon: Sequence[Point2]) -> None:
    for axis in (0, 1):
        values = [point[axis] for point in polygon]
        if not min(values) - _BEYOND_WALLS_M <= item.position_m[axis] <= max(values) + _BEYOND_WALLS_M:
            raise UnfitError("object: outside its room")
