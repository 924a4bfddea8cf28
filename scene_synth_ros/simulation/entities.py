"""The objects of a room as entities of a simulator: names, states, bounds, and which of them a filter means.  No ROS.

Answers are mappings with the fields of simulation_interfaces' messages.  An entity's link is the middle of its underside, x to its front.
"""

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from scene_description import NYU40, SceneDescription, SceneObject
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.simulation.requests import Bounds, EntityFilters, TagsFilter

STATIC_OBJECT = 5
"""EntityCategory: furniture stands still while a room is shown."""
NO_BOUNDS, BOX, SPHERE = 0, 1, 3
_ALL = 1
_REPEATS = 3
_WITHOUT_POWER = re.compile(r"\)[*+?{]|\\\d")
"""Groups that repeat, and references back, by which an expression can take for ever."""


class UnsupportedFilterError(ValueError):
    """A filter of a kind that is not served; one line."""


def entities(scene: SceneDescription, names: Mapping[str, int]) -> dict[str, SceneObject]:
    """Return name -> object: the name that it was given (name -> id), else its category and id, which no other object of a run has."""
    given = {identifier: name for name, identifier in names.items()}
    return {given.get(item.id, f"{item.category}_{item.id}"): item for item in scene.objects}


def state_of(item: SceneObject, stamp_ns: int, frame: str) -> dict[str, Any]:
    """Return an entity's EntityState, which stands still."""
    x, y, z = item.position_m
    return {
        "header": {"frame_id": frame, "stamp": {"sec": stamp_ns // NANOSECONDS, "nanosec": stamp_ns % NANOSECONDS}},
        "pose": {
            "position": {"x": x, "y": y, "z": z},
            "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * item.yaw_rad), "w": math.cos(0.5 * item.yaw_rad)},
        },
    }


def tags_of(item: SceneObject) -> list[str]:
    """Return the words that an entity can be found by: its category, its NYU40 class, and what carries it."""
    return [item.category, NYU40[item.label].name, f"on_{item.support.kind}"]


def info_of(item: SceneObject) -> dict[str, Any]:
    """Return an entity's EntityInfo."""
    size = " x ".join(f"{side:.3g}" for side in item.size_m)
    text = f"{item.category}, {size} m (depth x width x height), instance id {item.id}"
    return {"category": {"category": STATIC_OBJECT}, "description": text, "tags": tags_of(item)}


def bounds_of(item: SceneObject) -> dict[str, Any]:
    """Return an entity's Bounds, a box about its link: upper corner, lower corner."""
    depth, width, height = item.size_m
    corners = (0.5 * depth, 0.5 * width, height), (-0.5 * depth, -0.5 * width, 0.0)
    return {"type": BOX, "points": [{"x": x, "y": y, "z": z} for x, y, z in corners]}


def filtered(found: Mapping[str, SceneObject], filters: EntityFilters) -> dict[str, SceneObject]:
    """Return the entities that a filter means.

    Raises:
        UnsupportedFilterError: of a convex hull, or an expression that is none or may take for ever.
    """
    expression = _expression(filters.filter)
    categories = {one.category for one in filters.categories}
    return {
        name: item
        for name, item in found.items()
        if expression.search(name)
        and (not categories or STATIC_OBJECT in categories)
        and has_tags(tags_of(item), filters.tags)
        and _overlaps(item, filters.bounds)
    }


def has_tags(tags: Iterable[str], wanted: TagsFilter) -> bool:
    """Return whether tags are those that are wanted; any are where none is."""
    each = [tag in set(tags) for tag in wanted.tags]
    return not each or (all(each) if wanted.filter_mode == _ALL else any(each))


def _expression(text: str) -> re.Pattern[str]:
    if _WITHOUT_POWER.search(text) or len(re.findall(r"(?<!\\)[*+?{]", text)) > _REPEATS:
        raise UnsupportedFilterError(f"filter: expected at most {_REPEATS} repeats, none of them of a group, got '{text}'")
    try:
        return re.compile(text)
    except re.error as error:
        raise UnsupportedFilterError(f"filter: expected a regular expression, got '{text}': {error}") from None


def _overlaps(item: SceneObject, bounds: Bounds) -> bool:
    """Return whether an entity's box overlaps bounds."""
    if bounds.type == NO_BOUNDS:
        return True
    if bounds.type not in (BOX, SPHERE) or len(bounds.points) != 2:
        got = f"type {bounds.type} with {len(bounds.points)} points"
        raise UnsupportedFilterError(f"filters.bounds: expected a box or a sphere of two points, got {got}")
    one, other = ((point.x, point.y, point.z) for point in bounds.points)
    return _meets_sphere(item, one, other[0]) if bounds.type == SPHERE else _meets_box(item, one, other)


def _meets_sphere(item: SceneObject, centre: tuple[float, float, float], radius_m: float) -> bool:
    depth, width, height = item.size_m
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    dx, dy, dz = (a - b for a, b in zip(centre, item.position_m, strict=True))
    along, across = abs(dx * c + dy * s) - 0.5 * depth, abs(dy * c - dx * s) - 0.5 * width
    return math.hypot(max(along, 0.0), max(across, 0.0), max(dz - height, -dz, 0.0)) <= radius_m


def _meets_box(item: SceneObject, one: tuple[float, float, float], other: tuple[float, float, float]) -> bool:
    """Return whether an upright box that is turned meets one that is not: along no axis of either are they apart."""
    low, high = ([pick(pair) for pair in zip(one, other, strict=True)] for pick in (min, max))
    half_d, half_w = 0.5 * item.size_m[0], 0.5 * item.size_m[1]
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    dx, dy = (item.position_m[k] - 0.5 * (low[k] + high[k]) for k in range(2))
    half_x, half_y = (0.5 * (high[k] - low[k]) for k in range(2))
    return (
        item.position_m[2] <= high[2]
        and low[2] <= item.position_m[2] + item.size_m[2]
        and abs(dx) <= half_x + half_d * abs(c) + half_w * abs(s)
        and abs(dy) <= half_y + half_d * abs(s) + half_w * abs(c)
        and abs(dx * c + dy * s) <= half_d + half_x * abs(c) + half_y * abs(s)
        and abs(dy * c - dx * s) <= half_w + half_x * abs(s) + half_y * abs(c)
    )
