"""The shell of a room: its outline and height, its doors and windows, drawn from the grammar or taken from a request."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from grammar.derivation.densities import draw_index, draw_with_log_density
from grammar.derivation.openings import Attribute, DrawnOpening, draw_opening
from grammar.derivation.outlines import draw_outline
from grammar.derivation.rejection import RejectedError
from grammar.derivation.slopes import draw_below_slopes, draw_slopes
from grammar.spec.categories import Categories
from grammar.spec.request import SceneRequest
from grammar.spec.room_rules import OPENINGS, RoomRule
from grammar.spec.rules import Grammar
from scene_description import Opening, Room
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

_EITHER_WAY = 0.5
_LEAST_SHARE = 0.01


def draw_room(
    grammar: Grammar, request: SceneRequest, outline: tuple[Point2, ...], covered_m2: float, rng: np.random.Generator
) -> tuple[Room, list[Attribute]]:
    """Draw a room without openings, and tell how.

    Args:
        grammar: distributions of sides, height and shape.
        request: sides that it gives are not drawn.
        outline: the request's own or ().
        covered_m2: area that the furniture covers.
        rng: source of randomness.

    Raises:
        RejectedError: an arm of the room is too narrow, the area is out of bounds, or a sloped ceiling does not fit.
    """
    # draw the sides of the bounding rectangle, then the height, then the shape
    attributes: list[Attribute] = []
    sides: list[float] = []
    fitted_m2 = None
    if not (outline or request.room_width_m > 0.0 or request.room_depth_m > 0.0) and covered_m2 > 0.0:
        fitted_m2, sides, attributes = _fitted(grammar.room, covered_m2, rng)
    for name in () if outline or sides else ("width_m", "depth_m"):
        requested = getattr(request, f"room_{name}")
        side, log = (requested, 0.0) if requested > 0.0 else draw_with_log_density(rng, getattr(grammar.room, name))
        sides.append(side)
        attributes.append(Attribute(name, f"{side:.3f} m{' (requested)' if requested > 0.0 else ''}", log))
    height, log = draw_with_log_density(rng, grammar.room.height_m)
    attributes.append(Attribute("height_m", f"{height:.3f} m", log))
    polygon = outline
    if outline:
        attributes.append(Attribute("shape", f"outline with {len(outline)} walls (requested)", 0.0))
    else:
        drawn = draw_outline(rng, grammar.room.shapes, sides[0], sides[1])
        if drawn is None:
            raise RejectedError(f"no arm of the room narrower than {grammar.room.shapes.narrowest_m:g} m")
        polygon, shape = drawn
        attributes.append(shape)
        if fitted_m2 is not None:
            scale = math.sqrt(fitted_m2 / signed_area_m2(polygon))
            polygon = tuple((scale * x, scale * y) for x, y in polygon)
        low, high, area = grammar.room.area_low_m2, grammar.room.area_high_m2, signed_area_m2(polygon)
        if not (request.room_width_m > 0.0 and request.room_depth_m > 0.0) and not low <= area <= high:
            raise RejectedError(f"room area within [{low:g}, {high:g}] m2")
    room = Room(polygon_m=polygon, height_m=height, wall_thickness_m=grammar.room.wall_thickness_m, openings=(), surfaces=())
    grows = not (outline or request.room_width_m > 0.0 or request.room_depth_m > 0.0)
    return draw_slopes(grammar.room.slopes, room, attributes, rng, grows=grows)


def _fitted(room: RoomRule, covered_m2: float, rng: np.random.Generator) -> tuple[float | None, list[float], list[Attribute]]:
    """Return the area, the sides of a rectangle of that area, and how they were drawn; None and nothing for a room of given sides."""
    if room.floor_share is None or room.proportion is None:
        return None, [], []
    (share, share_log), (proportion, proportion_log) = (
        draw_with_log_density(rng, normal) for normal in (room.floor_share, room.proportion)
    )
    area = covered_m2 / max(share, _LEAST_SHARE)
    proportion = max(proportion, 1.0)
    long = math.sqrt(area * proportion)
    sides = [long, area / long]
    turned = bool(rng.random() < _EITHER_WAY)
    attributes = [
        Attribute("floor_share", f"{share:.3f}", share_log),
        Attribute("proportion", f"{proportion:.3f}{', turned' if turned else ''}", proportion_log + math.log(_EITHER_WAY)),
    ]
    return area, sides[::-1] if turned else sides, attributes


def draw_openings(
    grammar: Grammar, categories: Categories, room: Room, rng: np.random.Generator
) -> tuple[list[DrawnOpening], list[Attribute]]:
    """Return the openings of a room and how many of each kind were drawn.

    Raises:
        RejectedError: an opening does not fit.
    """
    drawn: list[DrawnOpening] = []
    counts: list[Attribute] = []
    for kind in OPENINGS:
        rule = grammar.openings.get(kind)
        if rule is None:
            continue
        copies = draw_index(rng, rule.multiplicity)
        counts.append(Attribute(f"{kind}_count", str(copies), math.log(rule.multiplicity[copies])))
        for _ in range(copies):
            others: list[Opening] = [one.opening for one in drawn]
            number, label = len(drawn) + 1, categories[kind].label_id
            draw = partial(draw_opening, kind, rule, number, label, room.polygon_m, room.height_m, others, rng)
            opening = draw_below_slopes(room, rule.casing_m, draw)
            if opening is None:
                raise RejectedError(f"a wall with space for a {kind}")
            drawn.append(opening)
    return drawn, counts
