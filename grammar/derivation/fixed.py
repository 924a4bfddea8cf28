"""Objects that a request puts in the room: read, matched with what the grammar draws, and checked before anything is laid out.

A fixed object takes the place of an object of its category that the grammar draws, so that what belongs to that or stands on it finds it
by its address; a category that the room type does not know joins the room as an object of its own.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grammar.geometry.arrays import Boxes, Ints
from grammar.geometry.boxes import deepest_penetrations, place_boxes
from grammar.geometry.solids import local_solids, surface_top
from grammar.geometry.walls import rectangle_outside, wall_rows
from grammar.geometry.zones import FACE, SWING, VIEW, opening_frame, opening_zones, placed_zones
from grammar.spec.categories import Categories
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar, ObjectRule, SizeMode
from scene_description import Room

Size = tuple[float, float, float]

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_ITEM = re.compile(rf"([a-z][a-z0-9_]*):({_NUMBER}):({_NUMBER}):({_NUMBER})((?::[a-z]+=[^:]*)*)")
_FORM = "'name:x:y:yaw' and after it ':size=DxWxH', ':on=K' or ':middle=Z'"
_FARTHEST_M = 60.0
_SMALLEST_M, _LARGEST_M = 0.001, 20.0
_NEAR_WALL_M = 0.25
_TOUCH_M = 1e-6


class Fixed(NamedTuple):
    """One fixed object: its text, category or symbol, pose in the world, size if given, place in the list of what carries it, height."""

    text: str
    name: str
    x_m: float
    y_m: float
    yaw_rad: float
    size_m: Size | None
    on: int | None
    middle_m: float | None


class Pinned(NamedTuple):
    """Where a thing stays: position of its underside's centre, yaw, the wall that it hangs on, the thing that it stands on."""

    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    wall: int | None = None
    on: int | None = None
    sized: bool = False


def read_fixed(request: SceneRequest) -> tuple[Fixed, ...]:
    """Return a request's fixed objects.

    Raises:
        RequestError: a text does not parse, a number is absurd, or an address leads nowhere.
    """
    return tuple(_read_item(text, k) for k, text in enumerate(request.fixed))


def _read_item(text: str, place: int) -> Fixed:
    match = _ITEM.fullmatch(text.replace(" ", ""))
    if match is None:
        raise RequestError(f"fixed: expected texts {_FORM}, got '{text}'")
    x, y, yaw = (float(match[k]) for k in (2, 3, 4))
    if max(abs(x), abs(y)) > _FARTHEST_M or abs(yaw) > 1000.0:
        raise RequestError(f"fixed: {text}: expected x and y within {_FARTHEST_M:g} m and yaw in radians, got {x:g}, {y:g}, {yaw:g}")
    size: Size | None = None
    on, middle = None, None
    for option in filter(None, match[5].split(":")):
        key, _, value = option.partition("=")
        if key == "size":
            size = _read_size(text, value)
        elif key == "on":
            if not re.fullmatch(r"\d{1,3}", value) or not 1 <= int(value) <= place:
                raise RequestError(f"fixed: {text}: expected ':on=K' with K from 1 to {place}, one before it in the list, got '{value}'")
            on = int(value) - 1
        elif key == "middle" and re.fullmatch(_NUMBER, value) and 0.0 <= float(value) <= _LARGEST_M:
            middle = float(value)
        else:
            raise RequestError(f"fixed: expected texts {_FORM}, got '{text}'")
    return Fixed(text, match[1], x, y, math.remainder(yaw, 2.0 * math.pi), size, on, middle)


def _read_size(text: str, value: str) -> Size:
    sides = [float(side) if re.fullmatch(_NUMBER, side) else math.nan for side in value.split("x")]
    if len(sides) != 3 or not all(_SMALLEST_M <= side <= _LARGEST_M for side in sides):
        raise RequestError(
            f"fixed: {text}: expected ':size=DxWxH' with sides from {_SMALLEST_M:g} to {_LARGEST_M:g} m, depth first, got '{value}'"
        )
    return sides[0], sides[1], sides[2]


def check_fixed(grammar: Grammar, categories: Categories, items: Sequence[Fixed]) -> None:
    """Refuse fixed objects that no room can hold, as far as that can be said before anything is drawn.

    Raises:
        RequestError: an unknown category, one without a size, something in the air, or two of given sizes that overlap.
    """
    drafts: list[tuple[Fixed, Boxes]] = []
    for item in items:
        rules = [rule for symbol, rule in grammar.objects.items() if item.name in (symbol, rule.category)]
        if not rules and item.name not in categories:
            raise RequestError(f"fixed: {item.text}: expected a category of categories.yaml or an object of the grammar, got '{item.name}'")
        if not rules and item.size_m is None:
            raise RequestError(f"fixed: {item.text}: expected ':size=DxWxH', since the {grammar.room_type} grammar has no {item.name}")
        mounts = {rule.mount for rule in rules}
        if mounts and (mounts == {"object"}) != (item.on is not None) and (item.on is not None or "object" in mounts):
            wanted = "':on=K', since it stands on things" if item.on is None else "no ':on=K', since it stands on no thing"
            raise RequestError(f"fixed: {item.text}: expected {wanted}")
        if item.on is not None:
            below = items[item.on]
            category = next((r.category for s, r in grammar.objects.items() if below.name in (s, r.category)), below.name)
            if not categories[category].surfaces:
                raise RequestError(f"fixed: {item.text}: expected ':on=K' of a thing with a top, got {category}, which has none")
        elif item.size_m is not None and mounts <= {"floor"}:
            category = rules[0].category if rules else item.name
            drafts.append((item, _solids(categories, category, item.size_m, Pinned(item.x_m, item.y_m, 0.0, item.yaw_rad))))
    owner = np.repeat(np.arange(len(drafts)), [len(boxes) for _, boxes in drafts])
    if len(owner):
        _check_apart(grammar, [item for item, _ in drafts], np.concatenate([boxes for _, boxes in drafts]), owner)


def _check_apart(grammar: Grammar, items: Sequence[Fixed], boxes: Boxes, owner: Ints) -> None:
    pair = overlapping(boxes, owner, grammar.validity.penetration_m)
    if pair is not None:
        first, second, depth = pair
        raise RequestError(
            f"fixed: {items[first].text} and {items[second].text}: expected objects that do not overlap, got {depth:.3g} m; move one"
        )


def overlapping(boxes: Boxes, owner: Ints, tolerance_m: float) -> tuple[int, int, float] | None:
    """Return the owners of the first two boxes of different owners that share more than a tolerance, and how much, or None."""
    depth = deepest_penetrations(boxes, owner, boxes, owner)
    if not len(depth) or depth.max() <= tolerance_m:
        return None
    first = int(owner[int(np.argmax(depth))])
    mine = owner == first
    against = deepest_penetrations(boxes[~mine], owner[~mine], boxes[mine], owner[mine])
    return first, int(owner[~mine][int(np.argmax(against))]), float(depth.max())


def matched(items: Sequence[Fixed], symbols: Sequence[str], rules: Sequence[ObjectRule]) -> dict[int, int] | None:
    """Return terminal -> fixed object that takes its place, for all fixed objects, or None if there are too few terminals.

    Args:
        items: fixed objects.
        symbols: of the drawn terminals.
        rules: of the drawn terminals.
    """
    taken: dict[int, int] = {}
    for k in sorted(range(len(items)), key=lambda k: (items[k].name not in symbols, k)):
        name, stands = items[k].name, items[k].on is not None
        terminals = enumerate(zip(symbols, rules, strict=True))
        free = [i for i, (symbol, rule) in terminals if i not in taken and name in (symbol, rule.category)]
        wanted = [i for i in free if (rules[i].mount == "object") == stands]
        if not wanted:
            return None
        taken[wanted[0]] = k
    return taken


def own_rule(item: Fixed) -> ObjectRule:
    """Return the rule of a fixed object of a category that the grammar does not have."""
    assert item.size_m is not None
    mount: Literal["floor", "object"] = "floor" if item.on is None else "object"
    sizes = (SizeMode(mean_m=item.size_m, sd_m=(0.01, 0.01, 0.01)),)
    return ObjectRule(category=item.name, mount=mount, sizes=sizes, low_m=item.size_m, high_m=item.size_m)


def pin(
    item: Fixed,
    rule: ObjectRule,
    size_m: Size,
    bottom_m: float,
    room: Room,
    below: tuple[str, Size, Pinned] | None,
    categories: Categories,
) -> Pinned | str:
    """Return where a fixed object stays in a room, or the words for what keeps it from there.

    Args:
        item: the fixed object.
        rule: how it is held.
        size_m: its size.
        bottom_m: height of its underside as drawn, for what hangs.
        room: the shell.
        below: category, size and place of what carries it.
        categories: table of categories, for tops.
    """
    x, y, yaw = item.x_m, item.y_m, item.yaw_rad
    if below is not None:
        return _on_top(item, size_m, *below, categories)
    wall = wall_rows(room.polygon_m)
    z = bottom_m if item.middle_m is None or rule.mount != "wall" else item.middle_m - 0.5 * size_m[2]
    at = None
    if rule.mount == "wall":
        gaps = [_to_segment(row, x, y) for row in wall]
        at = int(np.argmin(gaps))
        if gaps[at] > _NEAR_WALL_M + size_m[0]:
            return f"fixed: {item.text}: on a wall"
        ax, ay, tx, ty, length, nx, ny, yaw = wall[at, :8].tolist()
        along = min(max((x - ax) * tx + (y - ay) * ty, 0.5 * size_m[1]), length - 0.5 * size_m[1])
        x, y = ax + tx * along + 0.5 * size_m[0] * nx, ay + ty * along + 0.5 * size_m[0] * ny
    outside = rectangle_outside(wall, x, y, math.cos(yaw), math.sin(yaw), 0.5 * size_m[0], 0.5 * size_m[1])
    if outside > 1e-4 or z < 0.0 or z + size_m[2] > room.height_m + _TOUCH_M:
        return f"fixed: {item.text}: inside the room"
    return Pinned(x, y, z, yaw, wall=at)


def _on_top(item: Fixed, size_m: Size, category: str, below_size: Size, place: Pinned, categories: Categories) -> Pinned | str:
    turn, c, s = item.yaw_rad - place.yaw_rad, math.cos(place.yaw_rad), math.sin(place.yaw_rad)
    dx, dy = item.x_m - place.x_m, item.y_m - place.y_m
    across, along = abs(math.cos(turn)), abs(math.sin(turn))
    reach_d = abs(dx * c + dy * s) + 0.5 * (size_m[0] * across + size_m[1] * along)
    reach_w = abs(dy * c - dx * s) + 0.5 * (size_m[0] * along + size_m[1] * across)
    for surface in categories[category].surfaces:
        height, half_d, half_w = surface_top(surface, below_size)
        if reach_d <= half_d + 1e-4 and reach_w <= half_w + 1e-4:
            return Pinned(item.x_m, item.y_m, place.z_m + height, item.yaw_rad, on=item.on)
    return f"fixed: {item.text}: on the top of what carries it"


def _to_segment(row: NDArray[np.float64], x: float, y: float) -> float:
    along = min(max((x - row[0]) * row[2] + (y - row[1]) * row[3], 0.0), row[4])
    return math.hypot(x - row[0] - row[2] * along, y - row[1] - row[3] * along)


def _solids(categories: Categories, category: str, size_m: Size, place: Pinned) -> Boxes:
    local = local_solids(categories[category], size_m)
    placed = np.empty((len(local), 8))
    place_boxes(local, 0, len(local), place.x_m, place.y_m, place.z_m, place.yaw_rad, placed)
    return placed


def conflict(grammar: Grammar, categories: Categories, room: Room, pinned: Sequence[tuple[Fixed, ObjectRule, Size, Pinned]]) -> str | None:
    """Return the words for what keeps pinned objects and the room's openings from going together, or None."""
    if not pinned:
        return None
    solids = [_solids(categories, rule.category, size, place) for _, rule, size, place in pinned]
    owner = np.repeat(np.arange(len(pinned)), [len(boxes) for boxes in solids])
    boxes = np.concatenate(solids)
    pair = overlapping(boxes, owner, grammar.validity.penetration_m)
    if pair is not None:
        return f"fixed: {pinned[pair[0]][0].text} and {pinned[pair[1]][0].text} apart from each other"
    mounts = np.array([pinned[k][1].mount for k in owner.tolist()])
    for opening in room.openings:
        zones = opening_zones(opening, grammar.openings[opening.category])
        frame = opening_frame(room, opening)
        for zone in zones:
            blocks = {SWING: mounts != "", VIEW: mounts == "floor", FACE: mounts == "wall"}[zone.kind]
            placed = placed_zones([zone], frame[0], frame[1], opening.sill_m, frame[2])
            depth = deepest_penetrations(boxes[blocks], owner[blocks], placed, np.array([-1], np.int64))
            if len(depth) and depth.max() > 0.5 * grammar.validity.penetration_m:
                worst = int(owner[blocks][int(np.argmax(depth))])
                return f"fixed: {pinned[worst][0].text} clear of a {opening.category}"
    return None
