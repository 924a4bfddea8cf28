"""Rooms under a roof: which walls their ceilings fall to, how low and how steep, and doors and windows below them.

The floor grows by what a low ceiling takes from it: of floor below 1 m nothing counts, below 2 m a half (German ordinance on floor space,
WoFlV, section 4), and what counts is as large as the floor that was drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from shapely import Polygon

from grammar.derivation.densities import draw_index, draw_with_log_density
from grammar.derivation.openings import Attribute, DrawnOpening
from grammar.derivation.rejection import RejectedError
from grammar.geometry.boxes import footprint_corners
from grammar.geometry.slopes import low_ceiling
from grammar.geometry.walls import NORMAL_X, NORMAL_Y, wall_lengths, wall_rows
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.room_rules import SlopeRule
from grammar.spec.rules import Grammar
from grammar.spec.values import TruncatedNormal
from scene_description import Room, Slope
from scene_description.ceilings import OUTSIDE_M, distance_into_room_m, stretches_below_m
from scene_description.polygons import signed_area_m2
from scene_description.types import OpeningKind

_TRIES = 6
_OPENING_TRIES = 10
_WINDOW_SCALES = (1.0, 0.8, 0.65, 0.5)
_SIDES = {"flat": (0.0, 0.0), "one_slope": (1.0, 0.0), "two_slopes": (1.0, 1.0)}
"""Probabilities of slopes, and of two of them, that a request for a ceiling stands for."""
_OPPOSITE = -1.0 + 1e-6
_SLIM = 1.9
"""A floor does not grow to a longer proportion than this."""
_NOT_COUNTED_M, _HALF_COUNTED_M = 1.0, 2.0
_CURTAIN_BESIDE_M, _CURTAIN_ABOVE_M = 0.3, 0.1
"""What curtains take beside and above their window, about."""


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

    Args:
        rule: of the slopes.
        room: with a flat ceiling.
        attributes: of the room.
        rng: source of randomness.
        grows: whether the floor grows by what does not count below the slopes.
        raised: share of their range by which the lowest eaves are raised, for rooms and furniture that do not fit below lower ones.

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
    facing = [w for w in walls if float(rows[w, [NORMAL_X, NORMAL_Y]] @ rows[wall, [NORMAL_X, NORMAL_Y]]) <= _OPPOSITE]
    return sorted(facing, key=lambda w: lengths[w])[-1:]


def _high_area_m2(room: Room, high_m: float) -> float:
    """Return the area of the floor over which the ceiling is at least so high."""
    high = Polygon(room.polygon_m)
    for strip in low_ceiling(room, high_m):
        high = high.difference(Polygon(footprint_corners(strip)))
    return float(high.area)


def draw_below_slopes(grammar: Grammar, room: Room, kind: OpeningKind, draw: Callable[..., DrawnOpening | None]) -> DrawnOpening | None:
    """Return an opening that fits below a sloped ceiling with its casing and its curtains; None: none did.

    It is drawn along the parts of the walls that are high enough, so that slopes do not make the room rarer.  Where no window of its usual
    size fits, smaller ones are drawn.

    Args:
        grammar: with the rule of the opening, and what belongs to it.
        room: with slopes.
        kind: of the opening.
        draw: draws one by a rule, and by ``stretches`` of the walls: :func:`grammar.derivation.openings.draw_opening`.
    """
    rule = grammar.openings[kind]
    curtained = kind == "window" and any("window" in (one.cores or ()) and one.mount == "wall" for one in grammar.objects.values())
    beside, above = (_CURTAIN_BESIDE_M, max(rule.casing_m, _CURTAIN_ABOVE_M)) if curtained else (rule.casing_m, rule.casing_m)
    lengths, spare = wall_lengths(room.polygon_m), beside - rule.end_gap_m

    def stretches(top_m: float) -> list[tuple[float, float]]:
        # below a slope an opening keeps off where that gets too low, not off an end of its wall
        found = zip(stretches_below_m(room, top_m + above), lengths, strict=True)
        return [(low + spare * (low > 0.0), high - spare * (0.0 < high < length)) for (low, high), length in found]

    for scale in _WINDOW_SCALES if kind == "window" else (1.0,):
        scaled = replace(rule, width_m=_times(rule.width_m, scale), height_m=_times(rule.height_m, scale))
        for _ in range(_OPENING_TRIES):
            drawn = draw(scaled, stretches=stretches)
            if drawn is not None:
                return drawn
    return None


def _times(normal: TruncatedNormal, scale: float) -> TruncatedNormal:
    return TruncatedNormal(mean=scale * normal.mean, sd=scale * normal.sd, low=scale * normal.low, high=scale * normal.high)
