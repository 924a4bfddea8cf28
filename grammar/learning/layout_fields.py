"""Fields of layout files: numbers within bounds and outlines; what does not fit raises with its reason."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from shapely import Polygon, contains_xy

from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_rows
from grammar.learning.observed import ObservedOpening
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

_ROOM_HIGH_M = 100.0

_OFF_WALL_M = 0.5
_LEAST_SIDE_M = 0.3
_KINDS = {"door": ("doors", ("door",)), "window": ("windows", ("window",))}
"""Kind -> key of the list in a layout line, and the names that count as it; frames and jambs are listed beside their doors."""

_INTO_M = 0.25
"""So far beyond the faces of a door's box one stands in the room that it leads into."""
_ACROSS = (-0.3, 0.0, 0.3)
"""Places where one stands before a door, in widths of it from its middle."""
_SAME_DOOR_M = 0.4
"""Boxes whose middles are no further apart are one door, seen from both of its rooms."""
_OVERLAP = 0.05
"""Rooms that share more of the smaller one's floor have no frame in common: each lies at its own origin."""


_MOST_BOXES = 1000
_MOST_OPENINGS = 15
"""Of one kind, as many as a grammar may give a room."""


class UnfitError(Exception):
    """A line, an object or an opening that cannot be used; the text is the reason, ``objects`` how many objects are lost with it."""

    def __init__(self, reason: str, objects: int = 0) -> None:
        super().__init__(reason)
        self.objects = objects


def quoted(name: str) -> str:
    """Return the beginning of a name as messages and the comments of files may show it: characters of one line, which every file holds."""
    return "'" + "".join(letter if letter.isprintable() else "?" for letter in name[:60]) + "'"


def read_number(value: Any, reason: str, low: float, high: float) -> float:
    """Return a finite number within bounds.

    Raises:
        UnfitError: with ``reason``.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise UnfitError(reason)
    return float(value)


def read_numbers(value: Any, reason: str, low: float, high: float) -> tuple[float, float, float]:
    """Return a list of three numbers within bounds.

    Raises:
        UnfitError: with ``reason``.
    """
    if not isinstance(value, list) or len(value) != 3:
        raise UnfitError(reason)
    return read_number(value[0], reason, low, high), read_number(value[1], reason, low, high), read_number(value[2], reason, low, high)


def read_polygon(value: Any) -> tuple[Point2, ...]:
    """Return an outline counter-clockwise, without vertices that repeat or lie on a straight wall.

    Raises:
        UnfitError: it is no outline of a room.
    """
    reason = "room: no usable polygon"
    if not isinstance(value, list) or not 3 <= len(value) <= 1000:
        raise UnfitError(reason)
    points: list[Point2] = []
    for pair in value:
        if not isinstance(pair, list) or len(pair) != 2:
            raise UnfitError(reason)
        points.append((read_number(pair[0], reason, -1e5, 1e5), read_number(pair[1], reason, -1e5, 1e5)))
    corners = _turning_points(points)
    area = signed_area_m2(corners) if len(corners) >= 3 else 0.0
    if abs(area) < 0.5 or max(abs(p[0] - corners[0][0]) + abs(p[1] - corners[0][1]) for p in corners) > _ROOM_HIGH_M:
        raise UnfitError(reason)
    return tuple(corners if area > 0.0 else reversed(corners))


def _turning_points(points: Sequence[Point2]) -> list[Point2]:
    """Return the vertices where an outline turns; without one of the others its neighbours may be needless too."""
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


def read_openings(data: Mapping[str, Any], polygon: Sequence[Point2], reasons: list[str]) -> dict[str, tuple[ObservedOpening, ...]]:
    """Return the openings of a room by kind; a kind that the line does not list is left out.

    Raises:
        UnfitError: there are more than a grammar may give a room.
    """
    return {kind: found for kind in _KINDS if (found := _read_kind(data, kind, polygon, reasons)) is not None}


def _read_kind(data: Mapping[str, Any], kind: str, polygon: Sequence[Point2], reasons: list[str]) -> tuple[ObservedOpening, ...] | None:
    """Return the openings of one kind, None where the room does not list them: [name, and the lower and upper corner of a box]."""
    key, names = _KINDS[kind]
    boxes = data.get(key)
    if not isinstance(boxes, list):
        return None
    if len(boxes) > _MOST_BOXES:
        raise UnfitError(f"room: {len(boxes)} {key}, more than {_MOST_BOXES}")
    found: list[ObservedOpening] = []
    for box in boxes:
        try:
            if not isinstance(box, list) or len(box) != 7 or not isinstance(box[0], str):
                raise UnfitError(f"{kind}: not a name and six numbers")
            if box[0] in names:
                low = read_numbers(box[1:4], f"{kind}: absurd or missing corner", -1e5, 1e5)
                high = read_numbers(box[4:7], f"{kind}: absurd or missing corner", -1e5, 1e5)
                found.append(_in_wall(kind, low, high, polygon))
        except UnfitError as unfit:
            reasons.append(str(unfit))
    if len(found) > _MOST_OPENINGS:
        raise UnfitError(f"room: {len(found)} {key}, more than {_MOST_OPENINGS}")
    return tuple(found)


def _in_wall(kind: str, low: Sequence[float], high: Sequence[float], polygon: Sequence[Point2]) -> ObservedOpening:
    """Return a box as an opening of the wall that its middle is nearest to and that it lies along."""
    x, y = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])
    best: tuple[float, ObservedOpening] | None = None
    for index, wall in enumerate(wall_rows(polygon).tolist()):
        width = abs(wall[ALONG_X]) * (high[0] - low[0]) + abs(wall[ALONG_Y]) * (high[1] - low[1])
        along = (x - wall[START_X]) * wall[ALONG_X] + (y - wall[START_Y]) * wall[ALONG_Y]
        across = abs((x - wall[START_X]) * wall[NORMAL_X] + (y - wall[START_Y]) * wall[NORMAL_Y])
        beyond = max(0.5 * width - along, along + 0.5 * width - wall[LENGTH], 0.0)
        if width >= _LEAST_SIDE_M and across <= _OFF_WALL_M and beyond <= _OFF_WALL_M:
            offset = min(max(along - 0.5 * width, 0.0), max(wall[LENGTH] - width, 0.0))
            opening = ObservedOpening(wall=index, offset_m=offset, width_m=width, height_m=high[2] - low[2], sill_m=max(low[2], 0.0))
            if best is None or across + beyond < best[0]:
                best = across + beyond, opening
    if best is None or best[1].height_m < _LEAST_SIDE_M:
        raise UnfitError(f"{kind}: at no wall, or of no size")
    return best[1]


def shared_doors(room: Mapping[str, Any], others: Sequence[Mapping[str, Any]]) -> list[list[Any]]:
    """Return the doors of other rooms that lead into a room and that it does not list itself.

    Args:
        room: a line of a layout file, with ``doors``; without them they were not recorded, and none is returned.
        others: the other lines of its house; what does not fit in them is passed over.

    Returns:
        boxes as the lines have them: ["door", and the lower and the upper corner in metres].
    """
    outline = _outline(room)
    if outline is None or not isinstance(room.get("doors"), list):
        return []
    known = [_middle(box) for box in _doors(room)]
    found = []
    for other in others:
        leading = [box for box in _doors(other) if _leads_into(box, outline)]
        if leading and _one_frame(outline, _outline(other)):
            for box in leading:
                if all(math.dist(_middle(box), middle) > _SAME_DOOR_M for middle in known):
                    known.append(_middle(box))
                    found.append(box)
    return found


def _outline(data: Mapping[str, Any]) -> Polygon | None:
    try:
        return Polygon(read_polygon(data.get("polygon_m", data.get("polygon")))).buffer(0)
    except UnfitError:
        return None


def _doors(data: Mapping[str, Any]) -> list[list[Any]]:
    boxes = data.get("doors")
    return [box for box in boxes if _is_door(box)] if isinstance(boxes, list) else []


def _is_door(box: object) -> bool:
    if not isinstance(box, list) or len(box) != 7 or box[0] != "door":
        return False
    try:
        for part in (box[1:4], box[4:7]):
            read_numbers(part, "", -1e5, 1e5)
    except UnfitError:
        return False
    return True


def _middle(box: Sequence[Any]) -> tuple[float, float]:
    return 0.5 * (box[1] + box[4]), 0.5 * (box[2] + box[5])


def _leads_into(box: Sequence[Any], outline: Polygon) -> bool:
    """Return whether who steps through a door comes from outside a room into it."""
    (x, y), sides = _middle(box), (box[4] - box[1], box[5] - box[2])
    width, step = max(sides), 0.5 * min(sides) + _INTO_M
    inside = []
    for sign in (-1.0, 1.0):
        places = [(share * width, sign * step) if sides[0] > sides[1] else (sign * step, share * width) for share in _ACROSS]
        inside.append([bool(contains_xy(outline, x + dx, y + dy)) for dx, dy in places])
    return (all(inside[0]) and not any(inside[1])) or (all(inside[1]) and not any(inside[0]))


def _one_frame(first: Polygon, second: Polygon | None) -> bool:
    return second is not None and bool(first.intersection(second).area <= _OVERLAP * min(first.area, second.area))
