"""Layout files -> observed rooms: one JSON object a line; whatever does not fit is left out and counted, with its line.

Two kinds of lines are read.  Those with ``"schema": "scene_synth.layout/1"`` are in our conventions, as
:mod:`grammar.learning.write_layouts` writes them.  All others have boxes by centre and [width, depth, height], whose front faces -y at
yaw 0.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from grammar.geometry.walls import wall_rows
from grammar.learning.category_map import CategoryMap
from grammar.learning.geometry import at_walls
from grammar.learning.observed import ObservedObject, ObservedOpening, ObservedRoom
from grammar.spec.rules import GrammarError
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

LAYOUT_SCHEMA = "scene_synth.layout/1"

_SIDE_LOW_M, _SIDE_HIGH_M = 0.002, 12.0
_ROOM_HIGH_M = 100.0
_BEYOND_WALLS_M = 0.5
_MAX_LINE_CHARACTERS = 4_000_000
_OPENING_OFF_WALL_M = 0.5
_LEAST_OPENING_M = 0.3
_OPENINGS = {"door": ("doors", ("door",)), "window": ("windows", ("window",))}
"""Kind -> key of the list in a layout line, and the names that count as it; frames and jambs are listed beside their doors."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipped:
    """Something left out: file, line (from 1), and why."""

    file: str
    line: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutFile:
    """What one file gave: its rooms of the wanted type, everything left out, and how many lines were rooms of other types."""

    name: str
    rooms: tuple[ObservedRoom, ...]
    skipped: tuple[Skipped, ...]
    other_rooms: int

    def reasons(self) -> Counter[str]:
        """Return how often each reason occurs."""
        return Counter(item.reason for item in self.skipped)


class _Unfit(Exception):
    """A line or an object that cannot be used; the text is the reason."""


def read_layouts(path: Path, names: CategoryMap, room_type: str) -> LayoutFile:
    """Read the rooms of one type.

    Raises:
        GrammarError: the file itself cannot be read.
    """
    try:
        lines = path.read_bytes().splitlines()
    except OSError as error:
        raise GrammarError(f"{path}: expected a readable file of layouts, got {type(error).__name__} ({error.strerror})") from None
    rooms: list[ObservedRoom] = []
    skipped: list[Skipped] = []
    others = 0
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            room, reasons = _read_line(line, names, room_type)
        except _Unfit as unfit:
            skipped.append(Skipped(file=path.name, line=number, reason=str(unfit)))
            continue
        skipped.extend(Skipped(file=path.name, line=number, reason=reason) for reason in reasons)
        if room is None:
            others += 1
        else:
            rooms.append(room)
    return LayoutFile(name=path.name, rooms=tuple(rooms), skipped=tuple(skipped), other_rooms=others)


def _read_line(line: bytes, names: CategoryMap, room_type: str) -> tuple[ObservedRoom | None, list[str]]:
    try:
        if len(line) > _MAX_LINE_CHARACTERS:
            raise _Unfit("room: line too long")
        data = json.loads(line)
    except (ValueError, RecursionError):
        raise _Unfit("room: not JSON") from None
    if not isinstance(data, Mapping):
        raise _Unfit("room: not a JSON object")
    found, identifier, objects = data.get("room_type"), data.get("id"), data.get("objects")
    if not isinstance(found, str):
        raise _Unfit("room: no room_type")
    if names.room_type(found) != room_type:
        return None, []
    if not isinstance(objects, list):
        raise _Unfit("room: no list of objects")
    own = data.get("schema") == LAYOUT_SCHEMA
    polygon = _polygon(data.get("polygon_m" if own else "polygon"))
    height = _number(data.get("height_m" if own else "height"), "room: no height", 1.5, 10.0)
    text = identifier if isinstance(identifier, str) and identifier else "unnamed"
    house = data.get("house")
    kept: list[ObservedObject] = []
    on: list[int | None] = []
    place: dict[int, int] = {}
    reasons: list[str] = []
    for index, item in enumerate(objects):
        try:
            thing, target = (_own_object if own else _foreign_object)(item, names, room_type)
            _check_inside(thing, polygon)
            if thing.category in names.wide and thing.size_m[0] > thing.size_m[1]:
                thing = _turned_wide(thing, polygon)
        except _Unfit as unfit:
            reasons.append(str(unfit))
            continue
        place[index] = len(kept)
        kept.append(thing)
        on.append(target)
    placed = [None if target is None else place.get(target) for target in on]
    things = tuple(
        ObservedObject(category=t.category, size_m=t.size_m, position_m=t.position_m, yaw_rad=t.yaw_rad, on=None if p == i else p)
        for i, (t, p) in enumerate(zip(kept, placed, strict=True))
    )
    if not things:
        raise _Unfit("room: no usable object")
    openings = {kind: found for kind in _OPENINGS if (found := _openings(data, kind, polygon, reasons)) is not None}
    room = ObservedRoom(
        id=text,
        house=house if isinstance(house, str) and house else house_of(text),
        room_type=room_type,
        polygon_m=polygon,
        height_m=height,
        objects=things,
        openings=openings,
    )
    return room, reasons


def _openings(data: Mapping[str, Any], kind: str, polygon: Sequence[Point2], reasons: list[str]) -> tuple[ObservedOpening, ...] | None:
    """Return the openings of one kind, None where the room does not list them: [name, and the lower and upper corner of a box]."""
    key, names = _OPENINGS[kind]
    items = data.get(key)
    if not isinstance(items, list):
        return None
    found: list[ObservedOpening] = []
    for item in items:
        try:
            if not isinstance(item, list) or len(item) != 7 or not isinstance(item[0], str):
                raise _Unfit(f"{kind}: not a name and six numbers")
            if item[0] in names:
                low = _numbers(item[1:4], f"{kind}: absurd or missing corner", -1e5, 1e5)
                high = _numbers(item[4:7], f"{kind}: absurd or missing corner", -1e5, 1e5)
                found.append(_in_wall(kind, low, high, polygon))
        except _Unfit as unfit:
            reasons.append(str(unfit))
    return tuple(found)


def _in_wall(kind: str, low: Sequence[float], high: Sequence[float], polygon: Sequence[Point2]) -> ObservedOpening:
    """Return a box as an opening of the wall that its middle is nearest to and that it lies along."""
    x, y = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])
    best: tuple[float, ObservedOpening] | None = None
    for index, wall in enumerate(wall_rows(polygon).tolist()):
        width = abs(wall[2]) * (high[0] - low[0]) + abs(wall[3]) * (high[1] - low[1])
        along = (x - wall[0]) * wall[2] + (y - wall[1]) * wall[3]
        across = abs((x - wall[0]) * wall[5] + (y - wall[1]) * wall[6])
        beyond = max(0.5 * width - along, along + 0.5 * width - wall[4], 0.0)
        if width >= _LEAST_OPENING_M and across <= _OPENING_OFF_WALL_M and beyond <= _OPENING_OFF_WALL_M:
            offset = min(max(along - 0.5 * width, 0.0), max(wall[4] - width, 0.0))
            opening = ObservedOpening(wall=index, offset_m=offset, width_m=width, height_m=high[2] - low[2], sill_m=max(low[2], 0.0))
            if best is None or across + beyond < best[0]:
                best = across + beyond, opening
    if best is None or best[1].height_m < _LEAST_OPENING_M:
        raise _Unfit(f"{kind}: at no wall, or of no size")
    return best[1]


def house_of(identifier: str) -> str:
    """Return the house that a room's name speaks of: the part before the first "-" if it ends in a digit, else the whole name."""
    first = identifier.split("-", 1)[0]
    return first if re.search(r"\d$", first) else identifier


def _foreign_object(item: Any, names: CategoryMap, room_type: str) -> tuple[ObservedObject, int | None]:
    """Read a box given by centre and [width, depth, height], front -y: its yaw is a quarter turn behind ours, its ``on`` counts from 1."""
    if not isinstance(item, Mapping):
        raise _Unfit("object: not a JSON object")
    name, raw = item.get("cat"), item.get("raw")
    if not isinstance(name, str):
        raise _Unfit("object: no category")
    category = names.category(room_type, name, raw if isinstance(raw, str) else "")
    if category is None:
        raise _Unfit(f"object: unknown category '{name[:60]}'")
    if category == "":
        raise _Unfit(f"object: category '{name[:60]}' is not learned")
    width, depth, height = _numbers(item.get("size"), "object: absurd or missing size", _SIDE_LOW_M, _SIDE_HIGH_M)
    x, y, z = _numbers(item.get("pos"), "object: absurd or missing position", -1e5, 1e5)
    yaw = _number(item.get("yaw"), "object: no yaw", -100.0, 100.0)
    on = item.get("on")
    target = on - 1 if isinstance(on, int) and not isinstance(on, bool) and on >= 1 else None
    turned = math.remainder(yaw - 0.5 * math.pi, 2.0 * math.pi)
    thing = ObservedObject(category=category, size_m=(depth, width, height), position_m=(x, y, z - 0.5 * height), yaw_rad=turned)
    return thing, target


def _turned_wide(thing: ObservedObject, polygon: Sequence[Point2]) -> ObservedObject:
    """Return an object turned by a quarter in its box, that way round in which its back is nearer to a wall."""
    depth, width, height = thing.size_m
    quarters = (math.remainder(thing.yaw_rad + turn, 2.0 * math.pi) for turn in (0.5 * math.pi, -0.5 * math.pi))
    turned = [replace(thing, size_m=(width, depth, height), yaw_rad=yaw) for yaw in quarters]
    gaps = [min((item.gap_m for item in at_walls(polygon, way) if abs(item.turn_rad) < 0.25 * math.pi), default=math.inf) for way in turned]
    return turned[0] if gaps[0] <= gaps[1] else turned[1]


def _own_object(item: Any, names: CategoryMap, room_type: str) -> tuple[ObservedObject, int | None]:
    del names, room_type
    if not isinstance(item, Mapping) or not isinstance(item.get("category"), str):
        raise _Unfit("object: no category")
    size = _numbers(item.get("size_m"), "object: absurd or missing size", _SIDE_LOW_M, _SIDE_HIGH_M)
    position = _numbers(item.get("position_m"), "object: absurd or missing position", -1e5, 1e5)
    yaw = _number(item.get("yaw_rad"), "object: no yaw", -100.0, 100.0)
    on = item.get("on")
    target = on if isinstance(on, int) and not isinstance(on, bool) and on >= 0 else None
    turned = math.remainder(yaw, 2.0 * math.pi)
    return ObservedObject(category=item["category"], size_m=size, position_m=position, yaw_rad=turned), target


def _number(value: Any, reason: str, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise _Unfit(reason)
    return float(value)


def _numbers(value: Any, reason: str, low: float, high: float) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise _Unfit(reason)
    return _number(value[0], reason, low, high), _number(value[1], reason, low, high), _number(value[2], reason, low, high)


def _polygon(value: Any) -> tuple[Point2, ...]:
    """Return the outline counter-clockwise without vertices that repeat or lie on a straight wall."""
    reason = "room: no usable polygon"
    if not isinstance(value, list) or not 3 <= len(value) <= 1000:
        raise _Unfit(reason)
    points: list[Point2] = []
    for pair in value:
        if not isinstance(pair, list) or len(pair) != 2:
            raise _Unfit(reason)
        points.append((_number(pair[0], reason, -1e5, 1e5), _number(pair[1], reason, -1e5, 1e5)))
    corners = _corners(points)
    area = signed_area_m2(corners) if len(corners) >= 3 else 0.0
    if abs(area) < 0.5 or max(abs(p[0] - corners[0][0]) + abs(p[1] - corners[0][1]) for p in corners) > _ROOM_HIGH_M:
        raise _Unfit(reason)
    return tuple(corners if area > 0.0 else reversed(corners))


def _corners(points: Sequence[Point2]) -> list[Point2]:
    """Return the vertices where an outline turns; taking one out may make its neighbours needless."""
    corners, index, steady = list(points), 0, 0
    while len(corners) > 2 and steady < len(corners):
        index %= len(corners)
        before, here, after = corners[index - 1], corners[index], corners[(index + 1) % len(corners)]
        if math.dist(before, here) > 1e-6 and abs(_cross(before, here, after)) > 1e-9:
            index, steady = index + 1, steady + 1
        else:
            del corners[index]
            index, steady = max(index - 1, 0), 0
    return corners


def _cross(a: Point2, b: Point2, c: Point2) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _check_inside(thing: ObservedObject, polygon: Sequence[Point2]) -> None:
    for axis in (0, 1):
        values = [point[axis] for point in polygon]
        if not min(values) - _BEYOND_WALLS_M <= thing.position_m[axis] <= max(values) + _BEYOND_WALLS_M:
            raise _Unfit("object: outside its room")
