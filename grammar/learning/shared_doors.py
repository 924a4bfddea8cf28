"""Doors that a room shares with the other rooms of its house: a source may list a door with only one of the two rooms that it joins.

Halls are listed with the one door that they are entered by, while the doors of all rooms around them lead into them too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from shapely import Polygon, contains_xy

from grammar.learning.layout_fields import UnfitError, read_numbers, read_polygon

_INTO_M = 0.25
"""So far beyond the faces of a door's box one stands in the room that it leads into."""
_ACROSS = (-0.3, 0.0, 0.3)
"""Places where one stands before a door, in widths of it from its middle."""
_SAME_DOOR_M = 0.4
"""Boxes whose middles are no further apart are one door, seen from both of its rooms."""
_OVERLAP = 0.05
"""Rooms that share more of the smaller one's floor have no frame in common: each lies at its own origin."""


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
