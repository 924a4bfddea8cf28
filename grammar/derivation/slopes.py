"""Rooms under a roof: which walls their ceilings fall to, how low and how steep, and doors and windows below them.

The floor grows by what a low ceiling takes from it: of floor below 1 m nothing counts, below 2 m a half (German ordinance on floor space,
WoFlV, section 4), and what counts is as large as the floor that was drawn.
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from shapely import Polygon

from grammar.derivation.densities import draw_index, draw_with_log_density
from grammar.derivation.parse_tree import Attribute, RejectedError
from grammar.geometry.boxes import NO_BOXES, footprint_corners
from grammar.geometry.slopes import low_ceiling
from grammar.geometry.solids import surface_top
from grammar.geometry.wall_spans import free_spans
from grammar.geometry.walls import NORMAL_X, NORMAL_Y, wall_lengths, wall_rows
from grammar.geometry.zones import SWING, VIEW, opening_frame, opening_zones, placed_zones
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.room_rules import OPENINGS, SlopeRule
from grammar.spec.rules import Grammar
from grammar.spec.values import TruncatedNormal
from scene_description import Room, Slope
from scene_description.ceilings import OUTSIDE_M, distance_into_room_m
from scene_description.polygons import signed_area_m2
from scene_description.products import matmul

_TRIES = 6
_SIDES = {"flat": (0.0, 0.0), "one_slope": (1.0, 0.0), "two_slopes": (1.0, 1.0)}
"""Probabilities of slopes, and of two of them, that a request for a ceiling stands for."""
_OPPOSITE = -1.0 + 1e-6
_SLIM = 1.9
"""A floor does not grow to a longer proportion than this."""
_NOT_COUNTED_M, _HALF_COUNTED_M = 1.0, 2.0

Size = tuple[float, float, float]
Thing = tuple[str, ObjectRule, Size]
"""Symbol, rule and size of an object."""

_LOW_M, _STORE_DEPTH_M, _SLACK = 0.2, 0.6, 1.7
"""Tall is what is so much higher than the eaves.  Outside of rows it needs a wall with floor so deep, and so many times its own width."""

_MOST_STACKED = 4
"""Things on things on a thing that are added up."""


def with_ceiling(rule: SlopeRule, request: SceneRequest) -> SlopeRule:
    """Return the rule of slopes with what a request says of the ceiling.

    Raises:
        RequestError: the eaves asked for are no lower than the ceiling.
    """
    if request.room_ceiling != "any":
        probability, two_sides = _SIDES[request.room_ceiling]
        rule = replace(rule, probability=probability, two_sides=two_sides)
    if request.room_eaves_m > 0.0:
        low, high = 0.5, rule.height_m.low - 0.1
        if not low <= request.room_eaves_m <= high:
            raise RequestError(f"room_eaves_m: expected {low:g} to {high:g} m for this height of the room, got {request.room_eaves_m:g}")
        rule = replace(rule, eaves_height_m=_only(rule.eaves_height_m, request.room_eaves_m))
    if request.room_pitch_deg > 0.0:
        rule = replace(rule, pitch_rad=_only(rule.pitch_rad, math.radians(request.room_pitch_deg)))
    return rule


def _only(normal: TruncatedNormal, value: float) -> TruncatedNormal:
    return TruncatedNormal(mean=value, sd=normal.sd, low=value, high=value)


def draw_slopes(
    rule: SlopeRule, room: Room, attributes: Sequence[Attribute], rng: np.random.Generator, *, grows: bool, raised: float = 0.0
) -> tuple[Room, list[Attribute]]:
    """Return a room with a sloped ceiling drawn for it, and its attributes with those of that ceiling.

    ``grows``: whether the floor grows by what does not count below the slopes; ``raised``: share of their range by which the lowest eaves
    are raised, for rooms and furniture that do not fit below lower ones.

    Raises:
        RejectedError: the room is too narrow for slopes.
    """
    walls, floor_m2 = _bounding_walls(room), signed_area_m2(room.polygon_m)
    eaves_rule = replace(rule.eaves_height_m, low=rule.eaves_height_m.low + raised * (rule.eaves_height_m.high - rule.eaves_height_m.low))
    for _ in range(_TRIES if walls else 0):
        two = bool(rng.random() < rule.two_sides)
        (height, height_log), (eaves, eaves_log), (pitch, pitch_log) = (
            draw_with_log_density(rng, normal) for normal in (rule.height_m, eaves_rule, rule.pitch_rad)
        )
        wall, wall_log = _draw_wall(room, walls, rng)
        chosen = [wall, *_opposite(room, walls, wall)] if two else [wall]
        slopes = tuple(Slope(wall=index, eaves_height_m=eaves, pitch_rad=pitch) for index in chosen)
        sloped = replace(room, height_m=height, slopes=slopes)
        sloped = _grown(sloped) if grows else sloped
        slim = grows and _proportion(sloped) > max(_proportion(room), _SLIM)
        if not slim and len(chosen) == 1 + two and _high_area_m2(sloped, rule.high_m) >= rule.high_share * floor_m2:
            log = math.log(rule.probability) + math.log(rule.two_sides if two else 1.0 - rule.two_sides) + wall_log
            told = f"walls {' and '.join(map(str, chosen))}, from {eaves:.3f} m at {math.degrees(pitch):.2f} deg"
            others = [attribute for attribute in attributes if attribute.name != "height_m"]
            drawn = [Attribute("height_m", f"{height:.3f} m", height_log), Attribute("slopes", told, log + eaves_log + pitch_log)]
            return sloped, [*others, *drawn]
    raise RejectedError(f"a sloped ceiling at least {rule.high_m:g} m high over {rule.high_share:g} of the floor")


def _grown(room: Room) -> Room:
    """Return a room with its floor stretched square to its slopes by what does not count of it."""
    slopes = room.slopes or ()
    nx, ny = wall_rows(room.polygon_m)[slopes[0].wall, [NORMAL_X, NORMAL_Y]].tolist()
    across = [x * nx + y * ny for x, y in room.polygon_m]
    depth, middle = max(across) - min(across), 0.5 * (max(across) + min(across))
    lost = 0.0
    for slope in slopes:
        rise = math.tan(slope.pitch_rad)
        lost += sum(0.5 * max(level - slope.eaves_height_m, 0.0) / rise for level in (_NOT_COUNTED_M, _HALF_COUNTED_M))
    stretch = [lost / depth * (value - middle) for value in across]
    return replace(room, polygon_m=tuple((x + by * nx, y + by * ny) for (x, y), by in zip(room.polygon_m, stretch, strict=True)))


def _proportion(room: Room) -> float:
    """Return the long side of the rectangle about a floor, along x and y, over the short one."""
    (x_low, y_low), (x_high, y_high) = np.min(room.polygon_m, axis=0), np.max(room.polygon_m, axis=0)
    return float(max(x_high - x_low, y_high - y_low) / min(x_high - x_low, y_high - y_low))


def _bounding_walls(room: Room) -> list[int]:
    """Return the walls that have the whole floor before them."""
    outline = room.polygon_m
    return [w for w in range(len(outline)) if min(distance_into_room_m(outline, w, x, y) for x, y in outline) >= -OUTSIDE_M]


def _draw_wall(room: Room, walls: Sequence[int], rng: np.random.Generator) -> tuple[int, float]:
    """Return one of the walls, drawn by their lengths, and the logarithm of its probability."""
    lengths = wall_lengths(room.polygon_m)
    total = sum(lengths[w] for w in walls)
    shares = [lengths[w] / total for w in walls]
    chosen = draw_index(rng, shares)
    return walls[chosen], math.log(shares[chosen])


def _opposite(room: Room, walls: Sequence[int], wall: int) -> list[int]:
    """Return the longest of the walls that face a wall, if there is one."""
    rows, lengths = wall_rows(room.polygon_m), wall_lengths(room.polygon_m)
    facing = [w for w in walls if float(matmul(rows[w, [NORMAL_X, NORMAL_Y]], rows[wall, [NORMAL_X, NORMAL_Y]])) <= _OPPOSITE]
    return sorted(facing, key=lambda w: lengths[w])[-1:]


def _high_area_m2(room: Room, high_m: float) -> float:
    """Return the area of the floor over which the ceiling is at least so high."""
    high = Polygon(room.polygon_m)
    for strip in low_ceiling(room, high_m):
        high = high.difference(Polygon(footprint_corners(strip)))
    return float(high.area)


def loaded_heights_m(categories: Categories, things: Sequence[Thing]) -> list[float]:
    """Return how high each thing is together with the highest thing that may stand on its lowest surface, and so on."""
    found = [size[2] for _, _, size in things]
    for _ in range(_MOST_STACKED):
        on = defaultdict[str, float](float)
        for (_, rule, _), height in zip(things, found, strict=True):
            for supporter in rule.supporters or ():
                on[supporter] = max(on[supporter], height)
        found = [
            max(size[2], min(surface_top(surface, size)[0] for surface in categories[rule.category].surfaces) + on[symbol])
            if symbol in on and categories[rule.category].surfaces
            else size[2]
            for symbol, rule, size in things
        ]
    return found


def check_tall(grammar: Grammar, room: Room, things: Sequence[Thing]) -> None:
    """Check that what stands tall or hangs high at walls finds enough wall below a sloped ceiling; a flat one passes.

    Raises:
        RejectedError: it does not.
    """
    if room.slopes is None:
        return
    tall = min(slope.eaves_height_m for slope in room.slopes) + _LOW_M
    reaches = (
        (top_m(rule, size), size[1], size[0]) if rule.in_run else (top_m(rule, size), _SLACK * size[1], _STORE_DEPTH_M)
        for _, rule, size in things
        if not rule.in_line
    )
    sizes = sorted((reach for reach in reaches if reach[0] > tall), reverse=True)
    if not sizes:
        return
    zones = [NO_BOXES]
    for opening in room.openings:
        x, y, yaw = opening_frame(room, opening)
        kept = [zone for zone in opening_zones(opening, grammar.openings[opening.category]) if zone.kind in (SWING, VIEW)]
        zones.append(placed_zones(kept, x, y, opening.sill_m, yaw))
    # share the stretches of wall out, the tallest thing first; what is lower finds the same stretches, or longer ones
    taken, used = np.concatenate(zones), defaultdict[tuple[int, int], float](float)
    for height, width, depth in sizes:
        spans = free_spans(room.polygon_m, np.concatenate([taken, low_ceiling(room, height)]), depth)
        left = {(w, k): span.high - span.low - used[w, k] for w, wall in enumerate(spans) for k, span in enumerate(wall)}
        fitting = [place for place, length in left.items() if length >= width]
        if not fitting:
            raise RejectedError(f"walls below the sloped ceiling for what is {height:.2f} m high")
        used[min(fitting, key=left.__getitem__)] += width


def top_m(rule: ObjectRule, size: Size) -> float:
    """Return how high a thing at a wall reaches, about; 0 for what has no wall of its own to find, such as a curtain."""
    if rule.mount == "floor" and (rule.wall or rule.in_run):
        return size[2]
    if rule.mount == "wall" and rule.centre_height_m is not None and not set(rule.cores or ()) & set(OPENINGS):
        return rule.centre_height_m.mean + 0.5 * size[2]
    return 0.0
