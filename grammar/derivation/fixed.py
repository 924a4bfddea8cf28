"""Objects that a request puts in the room: reading them, and matching them with the objects that the grammar draws.

A fixed object takes the place of an object of its category that the grammar draws, so that the addresses of other objects find it.  One of
a category that the room type does not know joins the room as an object of its own.
"""

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.derivation.parse_tree import Pinned, RejectedError
from grammar.geometry.arrays import Boxes, Floats, Ints
from grammar.geometry.boxes import BOX_WIDTH, deepest_penetrations, place_boxes
from grammar.geometry.slopes import above_slopes, slope_rows
from grammar.geometry.solids import layout_solids, surface_top
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, START_X, START_Y, rectangle_outside, wall_rows
from grammar.geometry.zones import FACE, SWING, VIEW, opening_frame, opening_zones, placed_zones
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule, plain_rule
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar
from scene_description import Room

Size = tuple[float, float, float]

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_PATTERN = re.compile(rf"([a-z][a-z0-9_]*):({_NUMBER}):({_NUMBER}):({_NUMBER})((?::[a-z]+=[^:]*)*)")
_FORM = "'name:x:y:yaw' and after it ':size=DxWxH', ':on=K' or ':middle=Z'"
_FARTHEST_M = 60.0
_SMALLEST_M, _LARGEST_M = 0.001, 20.0

_NEAR_WALL_M = 0.25
_TOUCH_M = 1e-6


class FixedObject(NamedTuple):
    """One fixed object.

    text: as the request has it; name: category or symbol; x_m, y_m, yaw_rad: pose in the world; size_m: if given; on: place in the list of
    its supporter; middle_m: height of the middle of what hangs.
    """

    text: str
    name: str
    x_m: float
    y_m: float
    yaw_rad: float
    size_m: Size | None
    on: int | None
    middle_m: float | None


def read_fixed(request: SceneRequest) -> tuple[FixedObject, ...]:
    """Return a request's fixed objects.

    Raises:
        RequestError: a text does not parse, a number is absurd, or an address leads nowhere.
    """
    return tuple(_read_text(text, k) for k, text in enumerate(request.fixed))


def _read_text(text: str, place: int) -> FixedObject:
    """Read one text; ``place`` is its number in the list, from 0."""
    match = _PATTERN.fullmatch(text.replace(" ", ""))
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
    return FixedObject(text, match[1], x, y, math.remainder(yaw, 2.0 * math.pi), size, on, middle)


def _read_size(text: str, value: str) -> Size:
    sides = [float(side) if re.fullmatch(_NUMBER, side) else math.nan for side in value.split("x")]
    if len(sides) != 3 or not all(_SMALLEST_M <= side <= _LARGEST_M for side in sides):
        raise RequestError(
            f"fixed: {text}: expected ':size=DxWxH' with sides from {_SMALLEST_M:g} to {_LARGEST_M:g} m, depth first, got '{value}'"
        )
    return sides[0], sides[1], sides[2]


def match_terminals(fixed_objects: Sequence[FixedObject], symbols: Sequence[str], rules: Sequence[ObjectRule]) -> dict[int, int] | None:
    """Return terminal -> fixed object that takes its place, both as places in their lists, or None if there are too few terminals."""
    taken: dict[int, int] = {}
    # match names that are symbols before names of categories, which more terminals can satisfy
    for k in sorted(range(len(fixed_objects)), key=lambda k: (fixed_objects[k].name not in symbols, k)):
        name, stands = fixed_objects[k].name, fixed_objects[k].on is not None
        terminals = enumerate(zip(symbols, rules, strict=True))
        free = [i for i, (symbol, rule) in terminals if i not in taken and name in (symbol, rule.category)]
        wanted = [i for i in free if (rules[i].mount == "object") == stands]
        if not wanted:
            return None
        taken[wanted[0]] = k
    return taken


def rule_of_fixed(fixed: FixedObject) -> ObjectRule:
    """Return the rule of a fixed object of a category that the grammar does not have."""
    assert fixed.size_m is not None
    return plain_rule(fixed.name, "floor" if fixed.on is None else "object", fixed.size_m)


def check_fixed(grammar: Grammar, categories: Categories, fixed_objects: Sequence[FixedObject]) -> None:
    """Refuse fixed objects that no room can hold, as far as that can be said before anything is drawn.

    Raises:
        RequestError: an unknown category, one without a size, something in the air, or two of given sizes that overlap.
    """
    standing: list[FixedObject] = []
    solids: list[Boxes] = []
    for fixed in fixed_objects:
        rules = [rule for symbol, rule in grammar.objects.items() if fixed.name in (symbol, rule.category)]
        if not rules and fixed.name not in categories:
            raise RequestError(
                f"fixed: {fixed.text}: expected a category of categories.yaml or an object of the grammar, got '{fixed.name}'"
            )
        if not rules and fixed.size_m is None:
            raise RequestError(f"fixed: {fixed.text}: expected ':size=DxWxH', since the {grammar.room_type} grammar has no {fixed.name}")
        mounts = {rule.mount for rule in rules}
        if mounts and (mounts == {"object"}) != (fixed.on is not None) and (fixed.on is not None or "object" in mounts):
            wanted = "':on=K', since it stands on objects" if fixed.on is None else "no ':on=K', since it stands on no object"
            raise RequestError(f"fixed: {fixed.text}: expected {wanted}")
        if fixed.on is not None:
            _check_supporter(grammar, categories, fixed, fixed_objects[fixed.on])
        elif fixed.size_m is not None and mounts <= {"floor"}:
            category = rules[0].category if rules else fixed.name
            standing.append(fixed)
            solids.append(_solids(categories, category, fixed.size_m, Pinned(fixed.x_m, fixed.y_m, 0.0, fixed.yaw_rad)))
    _check_no_overlap(grammar, standing, solids)


def _check_supporter(grammar: Grammar, categories: Categories, fixed: FixedObject, below: FixedObject) -> None:
    category = next((r.category for s, r in grammar.objects.items() if below.name in (s, r.category)), below.name)
    if not categories[category].surfaces:
        raise RequestError(f"fixed: {fixed.text}: expected ':on=K' of an object with a support surface, got {category}, which has none")


def _check_no_overlap(grammar: Grammar, standing: Sequence[FixedObject], solids: Sequence[Boxes]) -> None:
    owner = np.repeat(np.arange(len(solids)), [len(boxes) for boxes in solids])
    pair = find_overlap(np.concatenate(solids), owner, grammar.validity.penetration_m) if len(owner) else None
    if pair is not None:
        first, second, depth = pair
        raise RequestError(
            f"fixed: {standing[first].text} and {standing[second].text}: expected objects that do not overlap, got {depth:.3g} m; move one"
        )


def find_overlap(boxes: Boxes, owner: Ints, tolerance_m: float) -> tuple[int, int, float] | None:
    """Return the owners of two boxes that penetrate each other deeper than a tolerance, and the depth in metres, or None."""
    depth = deepest_penetrations(boxes, owner, boxes, owner)
    if not len(depth) or depth.max() <= tolerance_m:
        return None
    first = int(owner[int(np.argmax(depth))])
    mine = owner == first
    against = deepest_penetrations(boxes[~mine], owner[~mine], boxes[mine], owner[mine])
    return first, int(owner[~mine][int(np.argmax(against))]), float(depth.max())


def pin(
    fixed: FixedObject,
    rule: ObjectRule,
    size_m: Size,
    bottom_m: float,
    room: Room,
    below: tuple[str, Size, Pinned] | None,
    categories: Categories,
) -> Pinned:
    """Return where a fixed object stays in a room.

    ``below``: category, size and pose of its supporter; ``bottom_m``: height of the underside of what hangs, as drawn.

    Raises:
        RejectedError: it would be off its wall or support surface, or outside the room.
    """
    x, y, yaw = fixed.x_m, fixed.y_m, fixed.yaw_rad
    if below is not None:
        return _on_supporter(fixed, size_m, *below, categories)
    # put what hangs flat against the nearest wall
    wall = wall_rows(room.polygon_m)
    z = bottom_m if fixed.middle_m is None or rule.mount != "wall" else fixed.middle_m - 0.5 * size_m[2]
    at = None
    if rule.mount == "wall":
        gaps = [_distance_to_wall(row, x, y) for row in wall]
        at = int(np.argmin(gaps))
        if gaps[at] > _NEAR_WALL_M + size_m[0]:
            raise RejectedError(f"fixed: {fixed.text}: on a wall")
        ax, ay, tx, ty, length, nx, ny, yaw = wall[at, :8].tolist()
        along = min(max((x - ax) * tx + (y - ay) * ty, 0.5 * size_m[1]), length - 0.5 * size_m[1])
        x, y = ax + tx * along + 0.5 * size_m[0] * nx, ay + ty * along + 0.5 * size_m[0] * ny
    # reject what is outside the room
    outside = rectangle_outside(wall, x, y, math.cos(yaw), math.sin(yaw), 0.5 * size_m[0], 0.5 * size_m[1])
    if outside > 1e-4 or z < 0.0 or z + size_m[2] > room.height_m + _TOUCH_M:
        raise RejectedError(f"fixed: {fixed.text}: inside the room")
    box = np.array([[x, y, z, z + size_m[2], 0.5 * size_m[0], 0.5 * size_m[1], math.cos(yaw), math.sin(yaw)]])
    if room.slopes is not None and above_slopes(slope_rows(room), box, 0) > 1e-4:
        raise RejectedError(f"fixed: {fixed.text}: below the sloped ceiling")
    return Pinned(x, y, z, yaw, wall=at)


def _on_supporter(fixed: FixedObject, size_m: Size, category: str, below_size: Size, place: Pinned, categories: Categories) -> Pinned:
    """Return where a fixed object stays on a support surface of an object of ``category``, ``below_size`` and ``place``."""
    turn, c, s = fixed.yaw_rad - place.yaw_rad, math.cos(place.yaw_rad), math.sin(place.yaw_rad)
    dx, dy = fixed.x_m - place.x_m, fixed.y_m - place.y_m
    across, along = abs(math.cos(turn)), abs(math.sin(turn))
    reach_d = abs(dx * c + dy * s) + 0.5 * (size_m[0] * across + size_m[1] * along)
    reach_w = abs(dy * c - dx * s) + 0.5 * (size_m[0] * along + size_m[1] * across)
    for surface in categories[category].surfaces:
        height, half_d, half_w = surface_top(surface, below_size)
        if reach_d <= half_d + 1e-4 and reach_w <= half_w + 1e-4:
            return Pinned(fixed.x_m, fixed.y_m, place.z_m + height, fixed.yaw_rad, on=fixed.on)
    raise RejectedError(f"fixed: {fixed.text}: on a support surface of what it stands on")


def _distance_to_wall(row: Floats, x: float, y: float) -> float:
    """Return the distance of a point to a wall, a row of :func:`grammar.geometry.walls.wall_rows`."""
    along = min(max((x - row[START_X]) * row[ALONG_X] + (y - row[START_Y]) * row[ALONG_Y], 0.0), row[LENGTH])
    return math.hypot(x - row[START_X] - row[ALONG_X] * along, y - row[START_Y] - row[ALONG_Y] * along)


def _solids(categories: Categories, category: str, size_m: Size, place: Pinned) -> Boxes:
    local = layout_solids(categories[category], size_m)
    placed = np.empty((len(local), BOX_WIDTH))
    place_boxes(local, 0, len(local), place.x_m, place.y_m, place.z_m, place.yaw_rad, placed)
    return placed


def check_pinned(
    grammar: Grammar, categories: Categories, room: Room, pinned: Sequence[tuple[FixedObject, ObjectRule, Size, Pinned]]
) -> None:
    """Check that pinned objects keep clear of each other and of the room's openings.

    Raises:
        RejectedError: two overlap, or one blocks a door, a window or the wall beside it.
    """
    if not pinned:
        return
    solids = [_solids(categories, rule.category, size, place) for _, rule, size, place in pinned]
    owner = np.repeat(np.arange(len(pinned)), [len(boxes) for boxes in solids])
    boxes = np.concatenate(solids)
    pair = find_overlap(boxes, owner, grammar.validity.penetration_m)
    if pair is not None:
        raise RejectedError(f"fixed: {pinned[pair[0]][0].text} and {pinned[pair[1]][0].text} apart from each other")
    mounts = np.array([pinned[k][1].mount for k in owner.tolist()])
    for opening in room.openings:
        x, y, yaw = opening_frame(room, opening)
        for zone in opening_zones(opening, grammar.openings[opening.category]):
            blocks = {SWING: mounts != "", VIEW: mounts == "floor", FACE: mounts == "wall"}[zone.kind]
            placed = placed_zones([zone], x, y, opening.sill_m, yaw)
            depth = deepest_penetrations(boxes[blocks], owner[blocks], placed, np.array([-1], np.int64))
            if len(depth) and depth.max() > 0.5 * grammar.validity.penetration_m:
                worst = int(owner[blocks][int(np.argmax(depth))])
                raise RejectedError(f"fixed: {pinned[worst][0].text} clear of a {opening.category}")
