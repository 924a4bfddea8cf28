"""The shell of a room: its outline and height, its doors and windows, drawn from the grammar or taken from a request."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from grammar.derivation.densities import draw_index, draw_truncated_normal, draw_with_log_density, truncated_normal_log_density
from grammar.derivation.openings import SpecialWalls
from grammar.derivation.outlines import draw_arms, draw_outline
from grammar.derivation.parse_tree import Attribute, RejectedError, UnfitFurnitureError
from grammar.spec.request import SceneRequest
from grammar.spec.room_rules import ARMED, SHAPES, RoomRule, RoomShapes, RoomSize
from grammar.spec.rules import Grammar
from grammar.spec.values import TruncatedNormal
from scene_description import Room
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

ROOM_SIZE = "room_size"
"""Name of the attribute node whose choice begins with the number of the component."""

_SHORTEST_M, _LONGEST_M = 0.7, 50.0
_BARE = 1.0
"""A room is bare if furniture covers less of the floor than so many standard deviations of that share."""

_EITHER_WAY = 0.5
_LEAST_SHARE = 0.01
_ROUNDING = 1e-6


def may_be_bare(size: RoomSize) -> bool:
    """Return whether rooms of a component may have no furniture."""
    return size.floor_share is None or size.floor_share <= _BARE * size.share_sd


class DrawnSize(NamedTuple):
    """The size of a room as it was drawn.

    ``area_m2`` of the floor; ``sides_m`` along x and y of a rectangle of that area or, with ``arm_m``, of the one that bounds a room with
    arms of that width; ``component`` of the mixture that it was drawn from, if it was.
    """

    area_m2: float
    sides_m: list[float]
    attributes: Sequence[Attribute]
    arm_m: float | None = None
    component: RoomSize | None = None


def draw_room_size(sizes: Sequence[RoomSize], rng: np.random.Generator) -> DrawnSize:
    """Return a size drawn from a mixture."""
    chosen = draw_index(rng, [size.probability for size in sizes])
    size = sizes[chosen]
    drawn = [draw_truncated_normal(rng, mean, sd, _SHORTEST_M, _LONGEST_M) for mean, sd in zip(size.mean_m, size.sd_m, strict=True)]
    log = math.log(size.probability * _EITHER_WAY) + sum(
        truncated_normal_log_density(side, mean, sd, _SHORTEST_M, _LONGEST_M)
        for side, mean, sd in zip(drawn, size.mean_m, size.sd_m, strict=True)
    )
    area, arm = drawn[0] * drawn[1], None
    if size.arm_m is not None:
        arm = draw_truncated_normal(rng, size.arm_m, size.arm_sd_m, _SHORTEST_M, _LONGEST_M)
        log += truncated_normal_log_density(arm, size.arm_m, size.arm_sd_m, _SHORTEST_M, _LONGEST_M)
        area = arm * (sum(drawn) - arm)
    turned = bool(rng.random() < _EITHER_WAY)
    sides = drawn[::-1] if turned else drawn
    text = f"{chosen}, {sides[0]:.3f} x {sides[1]:.3f} m" + ("" if arm is None else f", arms {arm:.3f} m")
    return DrawnSize(area, sides, [Attribute(ROOM_SIZE, text, log)], arm, size)


def draw_covered_m2(size: DrawnSize | None, rng: np.random.Generator) -> tuple[float, float]:
    """Draw the least and the greatest area that furniture covers in a room of this size.

    Furniture that covers a share x standard deviations off that of the component lies between them with the probability exp(-x^2 / 2).
    """
    component = size and size.component
    if size is None or component is None or component.floor_share is None:
        return 0.0, math.inf
    reach = component.share_sd * math.sqrt(-2.0 * math.log1p(-rng.random()))
    return size.area_m2 * (component.floor_share - reach), size.area_m2 * (component.floor_share + reach)


def check_covered(room: RoomRule, bounds_m2: tuple[float, float], covered_m2: float) -> None:
    """Reject furniture that covers more or less than it may; where no size of the mixture may be bare, bare rooms have other sizes.

    Raises:
        UnfitFurnitureError: the furniture covers another share of the floor than in rooms of that size.
    """
    is_bare = covered_m2 <= 0.0 and not any(map(may_be_bare, room.sizes))
    if not (bounds_m2[0] <= covered_m2 <= bounds_m2[1] or is_bare):
        raise UnfitFurnitureError("furniture on as much of the floor as in rooms of that size")


def draw_extent(room: RoomRule, request: SceneRequest, rng: np.random.Generator) -> DrawnSize | None:
    """Draw the extent of a room whose grammar says how large it is; None where furniture or a request decides, or the sides are drawn."""
    if room.sizes and not is_given(request):
        return draw_room_size(room.sizes, rng)
    if room.area_m2 is None or room.proportion is None or is_given(request):
        return None
    area, log = draw_with_log_density(rng, room.area_m2)
    # the short side is no narrower than an arm of the floor may be
    longest = max(area / room.shapes.narrowest_m**2, room.proportion.low + _ROUNDING)
    proportions = replace(room.proportion, high=min(room.proportion.high, longest))
    return _extent(area, Attribute("area", f"{area:.3f} m2", log), proportions, rng)


def is_given(request: SceneRequest) -> bool:
    """Return whether a request says how large the floor is along one side at least."""
    return bool(request.room_polygon_m) or request.room_width_m > 0.0 or request.room_depth_m > 0.0


def draw_room(
    grammar: Grammar,
    request: SceneRequest,
    outline: tuple[Point2, ...],
    covered_m2: float,
    rng: np.random.Generator,
    extent: DrawnSize | None = None,
) -> tuple[Room, list[Attribute], SpecialWalls]:
    """Draw a room with a flat ceiling and without openings, tell how, and return the walls of its bay and of its chimney breast.

    ``outline``: the request's own or (); ``extent``: drawn before; None: from the furniture, or the sides.

    Raises:
        RejectedError: an arm of the room is too narrow, the area is out of bounds, or it has a bay and is to have slopes.
    """
    fitted = None if is_given(request) else _fitted(grammar.room, covered_m2, extent, rng)
    sides, attributes = ([], []) if outline else _draw_sides(grammar.room, request, fitted, rng)
    height, log = draw_with_log_density(rng, grammar.room.height_m)
    attributes.append(Attribute("height_m", f"{height:.3f} m", log))
    polygon, special = outline, SpecialWalls()
    if outline:
        attributes.append(Attribute("shape", f"outline with {len(outline)} walls (requested)", 0.0))
    else:
        polygon, special, shape = _draw_shape(grammar.room, sides, fitted, rng)
        attributes.append(shape)
        low, high, area = grammar.room.area_low_m2, grammar.room.area_high_m2, signed_area_m2(polygon)
        if not (request.room_width_m > 0.0 and request.room_depth_m > 0.0) and not low <= area <= high:
            raise RejectedError(f"room area within [{low:g}, {high:g}] m2")
    room = Room(polygon_m=polygon, height_m=height, wall_thickness_m=grammar.room.wall_thickness_m, openings=(), surfaces=())
    if special.bay and grammar.room.slopes.probability >= 1.0:
        raise RejectedError("a sloped ceiling in a room without a bay")
    return room, attributes, special


def _draw_sides(
    room: RoomRule, request: SceneRequest, fitted: DrawnSize | None, rng: np.random.Generator
) -> tuple[list[float], list[Attribute]]:
    """Return the sides of the bounding rectangle: those that furniture or the area ask for, those of the request, or drawn ones."""
    if fitted is not None:
        return fitted.sides_m, list(fitted.attributes)
    sides, attributes = [], []
    for name in ("width_m", "depth_m"):
        requested = getattr(request, f"room_{name}")
        side, log = (requested, 0.0) if requested > 0.0 else draw_with_log_density(rng, getattr(room, name))
        sides.append(side)
        attributes.append(Attribute(name, f"{side:.3f} m{' (requested)' if requested > 0.0 else ''}", log))
    return sides, attributes


def _draw_shape(
    room: RoomRule, sides: Sequence[float], fitted: DrawnSize | None, rng: np.random.Generator
) -> tuple[tuple[Point2, ...], SpecialWalls, Attribute]:
    """Return an outline within a bounding rectangle, as large as the furniture asks for."""
    arm = None if fitted is None else fitted.arm_m
    if arm is not None:
        drawn = draw_arms(rng, room.shapes, sides[0], sides[1], arm)
    else:
        drawn = draw_outline(rng, _shapes_left(room, fitted is not None), sides[0], sides[1])
    if drawn is None:
        raise RejectedError(f"no arm of the room narrower than {room.shapes.narrowest_m:g} m")
    polygon = drawn.points_m
    if fitted is not None and arm is None:
        scale = math.sqrt(fitted.area_m2 / signed_area_m2(polygon))
        polygon = tuple((scale * x, scale * y) for x, y in polygon)
    return polygon, SpecialWalls(drawn.bay, drawn.closed), drawn.attribute


def _shapes_left(room: RoomRule, fitted: bool) -> RoomShapes:
    """Return the odds of shapes of a room whose size has no arms: where other components of the mixture have, it is none of these.

    Raises:
        RejectedError: it can only have arms.
    """
    if not fitted or all(size.arm_m is None for size in room.sizes):
        return room.shapes
    left = math.fsum(getattr(room.shapes, name) for name in SHAPES if name not in ARMED)
    if left <= 0.0:
        raise RejectedError("a size with arms for a room of that shape")
    odds: dict[str, Any] = {name: 0.0 if name in ARMED else getattr(room.shapes, name) / left for name in SHAPES}
    return replace(room.shapes, **odds)


def _fitted(room: RoomRule, covered_m2: float, extent: DrawnSize | None, rng: np.random.Generator) -> DrawnSize | None:
    """Return the size of a room that its furniture or its area asks for; None for a room of given sides."""
    if extent is not None and extent.component is not None and covered_m2 <= 0.0 and not any(map(may_be_bare, room.sizes)):
        return None
    if extent is None and room.floor_share is not None and room.proportion is not None and covered_m2 > 0.0:
        share, log = draw_with_log_density(rng, room.floor_share)
        return _extent(covered_m2 / max(share, _LEAST_SHARE), Attribute("floor_share", f"{share:.3f}", log), room.proportion, rng)
    return extent


def _extent(area_m2: float, attribute: Attribute, proportions: TruncatedNormal, rng: np.random.Generator) -> DrawnSize:
    """Return an area with a drawn proportion, turned or not."""
    proportion, log = draw_with_log_density(rng, proportions)
    proportion = max(proportion, 1.0)
    turned = bool(rng.random() < _EITHER_WAY)
    told = Attribute("proportion", f"{proportion:.3f}{', turned' if turned else ''}", log + math.log(_EITHER_WAY))
    long = math.sqrt(area_m2 * proportion)
    sides = [long, area_m2 / long]
    return DrawnSize(area_m2, sides[::-1] if turned else sides, (attribute, told))
