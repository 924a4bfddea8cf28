"""Objects of layout files: in our conventions, or as boxes by centre and [width, depth, height] whose front faces -y at yaw 0."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from grammar.learning.category_map import CategoryMap, kind_of, nearest_category, symbol_of
from grammar.learning.layout_fields import UnfitError, quoted, read_number, read_numbers
from grammar.learning.observed import ObservedObject, between_walls, box_gap, wall_poses
from scene_description.types import Point2

Size = tuple[float, float, float]

_SIDE_LOW_M, _SIDE_HIGH_M = 0.002, 12.0
_BEYOND_WALLS_M = 0.5
_RAISED_M = 0.3
_LONGEST_NAME = 200
_AT_WALL_M, _STRAIGHT_RAD, _SQUARE = 0.15, 0.1, 1.2


def read_objects(
    objects: Sequence[Any], names: CategoryMap, room_type: str, polygon: Sequence[Point2], *, own: bool
) -> tuple[tuple[ObservedObject, ...], list[str]]:
    """Return the objects that can be used, and the reasons why others cannot.

    ``own``: whether they are in our conventions.
    """
    read = _own_object if own else _foreign_object
    kept: list[ObservedObject] = []
    supporters: list[int | None] = []
    general: list[bool] = []
    place: dict[int, int] = {}
    reasons: list[str] = []
    for index, data in enumerate(objects):
        try:
            item, supporter, unturned, told, by_room = read(data, names, room_type)
            _check_inside(item, polygon)
            if item.category in names.low and item.size_m[2] < names.low[item.category].below_m:
                item = replace(item, category=names.low[item.category].is_a)
            if item.category in names.standing and supporter is None and item.position_m[2] < _RAISED_M:
                item = replace(item, category=names.category(room_type, names.standing[item.category], "") or item.category)
            if item.category in names.wide and item.size_m[0] > item.size_m[1]:
                item = _turned_wide(item, polygon)
            if (item.category in names.backed or unturned) and supporter is None:
                item = _turned_back(item, polygon)
            item = between_walls(polygon, item)
            if item.category in names.highest_m:
                item = replace(item, size_m=(*item.size_m[:2], min(item.size_m[2], names.highest_m[item.category])))
        except UnfitError as unfit:
            reasons.append(str(unfit))
            continue
        if told:
            reasons.append(told)
        place[index] = len(kept)
        kept.append(item)
        supporters.append(supporter)
        general.append(by_room)
    kept = [_by_neighbour(item, kept, names) if by_room else item for item, by_room in zip(kept, general, strict=True)]
    # point to supporters by their places among the objects that are kept
    on = [None if supporter is None else place.get(supporter) for supporter in supporters]
    return tuple(replace(item, on=None if on[i] == i else on[i]) for i, item in enumerate(kept)), reasons


class _Read(NamedTuple):
    """An object as a line has it: its supporter's place in the line, whether the line tells no front, and what was made of its name.

    ``by_room``: whether the room type told what a general name means.
    """

    item: ObservedObject
    supporter: int | None
    unturned: bool = False
    told: str = ""
    by_room: bool = False


def _foreign_object(data: Any, names: CategoryMap, room_type: str) -> _Read:
    """Read a box given by centre and [width, depth, height], front -y: its yaw is a quarter turn behind ours, its ``on`` counts from 1."""
    if not isinstance(data, Mapping):
        raise UnfitError("object: not a JSON object")
    name, raw = data.get("cat"), data.get("raw")
    if not isinstance(name, str):
        raise UnfitError("object: no category")
    category = names.category(room_type, name, raw if isinstance(raw, str) else "")
    if category is None and not names.catalogue:
        raise UnfitError(f"object: unknown category {quoted(name)}")
    if category == "":
        raise UnfitError(f"object: category {quoted(name)} is not learned")
    width, depth, height = read_numbers(data.get("size"), "object: absurd or missing size", _SIDE_LOW_M, _SIDE_HIGH_M)
    x, y, z = read_numbers(data.get("pos"), "object: absurd or missing position", -1e5, 1e5)
    unturned = "yaw" in data and data["yaw"] is None
    yaw = 0.0 if unturned else read_number(data.get("yaw"), "object: no yaw", -100.0, 100.0)
    on = data.get("on")
    target = on - 1 if isinstance(on, int) and not isinstance(on, bool) and on >= 1 else None
    turned = math.remainder(yaw - 0.5 * math.pi, 2.0 * math.pi)
    size, position = (depth, width, height), (x, y, z - 0.5 * height)
    unknown = category is None
    category, own_name = (category, "") if category is not None else _guessed(names, name, size, target is not None)
    return _Read(
        ObservedObject(category=category, size_m=size, position_m=position, yaw_rad=turned, name=own_name),
        target,
        unturned,
        _told(name, category, own_name) if unknown or (name in names.catalogue and category != name) else "",
        names.is_general(room_type, name, raw if isinstance(raw, str) else ""),
    )


def _by_neighbour(item: ObservedObject, objects: Sequence[ObservedObject], names: CategoryMap) -> ObservedObject:
    """Return an object of a general name as what it is by what stands beside it."""
    rule = names.beside.get(item.category)
    if rule is None:
        return item
    near = any(other.category == rule.of and box_gap(item, other) < rule.within_m for other in objects)
    return replace(item, category=(rule.there if near else rule.elsewhere) or item.category)


def _guessed(names: CategoryMap, name: str, size_m: Size, raised: bool) -> tuple[str, str]:
    """Return a category for a name that no table has, and the symbol that keeps the name where the category is a general one."""
    nearest = nearest_category(name[:_LONGEST_NAME], names.catalogue)
    return (nearest, "") if nearest is not None else (kind_of(size_m, raised), symbol_of(name[:_LONGEST_NAME]))


def _told(name: str, category: str, own_name: str) -> str:
    return f"name: {quoted(name)} is taken for {category}{', a plain box' if own_name else ''}"


def _turned_wide(item: ObservedObject, polygon: Sequence[Point2]) -> ObservedObject:
    """Return an object turned by a quarter in its box, that way round in which its back is nearer to a wall."""
    depth, width, height = item.size_m
    quarters = (math.remainder(item.yaw_rad + turn, 2.0 * math.pi) for turn in (0.5 * math.pi, -0.5 * math.pi))
    turned = [replace(item, size_m=(width, depth, height), yaw_rad=yaw) for yaw in quarters]
    gaps = [
        min((pose.gap_m for pose in wall_poses(polygon, way) if abs(pose.turn_rad) < 0.25 * math.pi), default=math.inf) for way in turned
    ]
    return turned[0] if gaps[0] <= gaps[1] else turned[1]


def _turned_back(item: ObservedObject, polygon: Sequence[Point2]) -> ObservedObject:
    """Return an object in its box with its back to the wall that one of its sides is at, a long side rather than a short one.

    What is at no wall with its back or another side stays as it is.
    """
    depth, width, height = item.size_m
    ways = [
        replace(
            item,
            size_m=(depth, width, height) if quarter % 2 == 0 else (width, depth, height),
            yaw_rad=math.remainder(item.yaw_rad + 0.5 * math.pi * quarter, 2.0 * math.pi),
        )
        for quarter in range(4)
    ]
    found = []
    for quarter, way in enumerate(ways):
        backs = [pose.gap_m for pose in wall_poses(polygon, way) if abs(pose.turn_rad) < _STRAIGHT_RAD]
        if backs and min(backs) <= _AT_WALL_M:
            found.append((way.size_m[0] > _SQUARE * way.size_m[1], max(min(backs), 0.0), quarter))
    return ways[min(found)[2]] if found else item


def _own_object(data: Any, names: CategoryMap, room_type: str) -> _Read:
    del room_type
    if not isinstance(data, Mapping) or not isinstance(data.get("category"), str):
        raise UnfitError("object: no category")
    size = read_numbers(data.get("size_m"), "object: absurd or missing size", _SIDE_LOW_M, _SIDE_HIGH_M)
    position = read_numbers(data.get("position_m"), "object: absurd or missing position", -1e5, 1e5)
    yaw = read_number(data.get("yaw_rad"), "object: no yaw", -100.0, 100.0)
    on = data.get("on")
    target = on if isinstance(on, int) and not isinstance(on, bool) and on >= 0 else None
    turned = math.remainder(yaw, 2.0 * math.pi)
    name = data["category"]
    known = not names.catalogue or name in names.catalogue
    category, own_name = (name, "") if known else _guessed(names, name, size, target is not None)
    item = ObservedObject(category=category, size_m=size, position_m=position, yaw_rad=turned, name=own_name)
    return _Read(item, target, told="" if known else _told(name, category, own_name))


def _check_inside(item: ObservedObject, polygon: Sequence[Point2]) -> None:
    for axis in (0, 1):
        values = [point[axis] for point in polygon]
        if not min(values) - _BEYOND_WALLS_M <= item.position_m[axis] <= max(values) + _BEYOND_WALLS_M:
            raise UnfitError("object: outside its room")
