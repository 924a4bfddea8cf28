"""Doors and windows, drawn on the walls of a room.

A wall is drawn with a probability proportional to its length or a power of that; along it an opening lies either near one end or anywhere.
Openings that come too close to each other or to the ceiling are rejected, as are those that an open door would get before, and the caller
draws again.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.derivation.densities import draw_index, draw_truncated_normal, draw_with_log_density, truncated_normal_log_density
from grammar.derivation.parse_tree import Attribute, RejectedError
from grammar.geometry.boxes import footprint_penetration
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, REFLEX, START_X, START_Y, wall_lengths, wall_rows
from grammar.geometry.zones import face_box, leaf_boxes
from grammar.spec.categories import Categories
from grammar.spec.room_rules import OPENINGS, OpeningRule
from grammar.spec.rules import Grammar
from scene_description import ModelReference, Opening, Room
from scene_description.ceilings import stretches_below_m
from scene_description.products import dot
from scene_description.types import OpeningKind, Point2

COUNT = "_count"
"""Behind the kind of an opening, the name of the attribute node whose choice is the number of such openings."""

_MAX_SEED = 2**63 - 1
_PARALLEL = 1e-9
_TRIES, _TRIES_BELOW_SLOPES = 12, 10
"""Places that are drawn for an opening before the room is rejected, or rooms with more openings would come out too rarely."""
_WINDOW_SCALES = (1.0, 0.8, 0.65, 0.5)
_BEYOND_M = 1.0
"""What is beyond an opening is no part of the same room for this far."""
_CURTAIN_BESIDE_M, _CURTAIN_ABOVE_M = 0.3, 0.1
"""What curtains take beside and above their window, about."""
_PIER_M, _CURTAIN_PIER_M = 0.12, 0.37
"""Wall beside a window of a bay; beside the front one with room for curtains, where it has that."""
_LEAST_WIDTH_M, _LEAST_FRONT_M = 0.4, 0.8


class DrawnOpening(NamedTuple):
    """An opening and how it was drawn."""

    opening: Opening
    attributes: tuple[Attribute, ...]


class SpecialWalls(NamedTuple):
    """Walls of a bay, the front one in the middle, and walls that have no openings."""

    bay: tuple[int, ...] = ()
    closed: tuple[int, ...] = ()


class FreeWalls(NamedTuple):
    """Where an opening may lie.

    polygon_m: floor outline, counter-clockwise, world; height_m: of the ceiling; others: openings drawn before, with the ids 1, 2, ...;
    closed: walls that it may not lie in; stretches: from where to where along each wall, metres from its start, one may lie whose top is
    so high (m); None: anywhere.
    """

    polygon_m: Sequence[Point2]
    height_m: float
    others: Sequence[Opening] = ()
    closed: Collection[int] = ()
    stretches: Callable[[float], Sequence[tuple[float, float]]] | None = None


def draw_numbers(grammar: Grammar, room: Room, rng: np.random.Generator) -> dict[str, int]:
    """Return how many openings of each kind a room has."""
    return {kind: draw_index(rng, _odds_of_numbers(grammar.openings[kind], room)) for kind in OPENINGS if kind in grammar.openings}


def numbers_fit(grammar: Grammar, room: Room, numbers: Mapping[str, int]) -> bool:
    """Return whether a room may have so many openings of each kind."""
    return all(_odds_of_numbers(grammar.openings[kind], room)[number] > 0.0 for kind, number in numbers.items())


def _odds_of_numbers(rule: OpeningRule, room: Room) -> Sequence[float]:
    """Return the odds of numbers of openings, without those for which the walls are too short."""
    if rule.wall_m <= 0.0:
        return rule.multiplicity
    most = sum(wall_lengths(room.polygon_m)) / rule.wall_m
    odds = [share if number <= most else 0.0 for number, share in enumerate(rule.multiplicity)]
    total = sum(odds)
    return [share / total for share in odds] if total > 0.0 else rule.multiplicity


def draw_openings(
    grammar: Grammar,
    categories: Categories,
    room: Room,
    rng: np.random.Generator,
    special: SpecialWalls,
    numbers: Mapping[str, int],
    counted: Collection[str] = (),
) -> tuple[list[DrawnOpening], list[Attribute]]:
    """Return the openings of a room, so many of each kind as ``numbers`` has, and the odds of that.

    A bay is in an outer wall: its walls and those beside it have no door.  Its windows count as one, unless a request counts windows.

    ``counted``: kinds whose number a request bounds.

    Raises:
        RejectedError: an opening does not fit.
    """
    bay = special.bay
    drawn: list[DrawnOpening] = []
    counts: list[Attribute] = []
    for kind in OPENINGS:
        rule = grammar.openings.get(kind)
        if rule is None:
            continue
        copies = numbers[kind]
        counts.append(Attribute(f"{kind}{COUNT}", str(copies), math.log(_odds_of_numbers(rule, room)[copies])))
        label, walls = categories[kind].label_id, FreeWalls(room.polygon_m, room.height_m)
        if bay and kind == "window" and copies:
            windows = _draw_bay_windows(rule, len(drawn) + 1, label, walls, bay, 1 if kind in counted else len(bay), rng)
            drawn.extend(windows)
            copies -= bool(windows)
        outer = bay if kind == "window" or not bay else range(bay[0] - 1, bay[-1] + 2)
        for _ in range(copies):
            walls = walls._replace(others=[one.opening for one in drawn], closed=(*special.closed, *outer))
            if room.slopes is None:
                opening = _first_that_fits(kind, rule, label, walls, rng, _TRIES)
            else:
                opening = _draw_below_slopes(grammar, room, kind, label, walls, rng)
            if opening is None:
                raise RejectedError(f"a wall with space for a {kind}")
            drawn.append(opening)
    return drawn, counts


def _first_that_fits(
    kind: OpeningKind, rule: OpeningRule, label: int, walls: FreeWalls, rng: np.random.Generator, tries: int
) -> DrawnOpening | None:
    return next((drawn for drawn in (draw_opening(kind, rule, label, walls, rng) for _ in range(tries)) if drawn is not None), None)


def _draw_below_slopes(
    grammar: Grammar, room: Room, kind: OpeningKind, label: int, walls: FreeWalls, rng: np.random.Generator
) -> DrawnOpening | None:
    """Return an opening that fits below a sloped ceiling with its casing and its curtains; None: none did.

    It is drawn along the parts of the walls that are high enough, so that slopes do not make the room rarer.  Where no window of its usual
    size fits, smaller ones are drawn.
    """
    rule = grammar.openings[kind]
    curtained = kind == "window" and any("window" in (one.cores or ()) and one.mount == "wall" for one in grammar.objects.values())
    beside, above = (_CURTAIN_BESIDE_M, max(rule.casing_m, _CURTAIN_ABOVE_M)) if curtained else (rule.casing_m, rule.casing_m)
    lengths, spare = wall_lengths(room.polygon_m), beside - rule.end_gap_m

    def stretches(top_m: float) -> list[tuple[float, float]]:
        # below a slope an opening keeps off where that gets too low, not off an end of its wall
        high_enough = zip(stretches_below_m(room, top_m + above), lengths, strict=True)
        return [(low + spare * (low > 0.0), high - spare * (0.0 < high < length)) for (low, high), length in high_enough]

    walls = walls._replace(stretches=stretches)
    for scale in _WINDOW_SCALES if kind == "window" else (1.0,):
        scaled = replace(rule, width_m=rule.width_m.times(scale), height_m=rule.height_m.times(scale))
        drawn = _first_that_fits(kind, scaled, label, walls, rng, _TRIES_BELOW_SLOPES)
        if drawn is not None:
            return drawn
    return None


def draw_opening(kind: OpeningKind, rule: OpeningRule, label: int, walls: FreeWalls, rng: np.random.Generator) -> DrawnOpening | None:
    """Draw one opening of a class ``label`` by its rule, or None where it does not fit."""
    (width, width_log), (tall, tall_log), (sill, sill_log) = (
        draw_with_log_density(rng, normal) for normal in (rule.width_m, rule.height_m, rule.sill_m)
    )
    place = _draw_place(rule, walls, width, sill + tall, rng)
    if place is None:
        return None
    swings_in = bool(rng.random() < rule.swing_in)
    if _is_too_close(rule, walls, place, width):
        return None
    opening = Opening(
        id=len(walls.others) + 1,
        category=kind,
        label=label,
        wall=place.wall,
        offset_m=place.offset_m,
        sill_m=sill,
        width_m=width,
        height_m=tall,
        hinge="start" if 2.0 * place.along_m < place.slack_m else "end",
        swing="in" if swings_in else "out",
        model=ModelReference(generator=kind, seed=int(rng.integers(_MAX_SEED))),
        parts=(),
    )
    if _leads_back(walls.polygon_m, opening) or any(_in_the_way(walls.polygon_m, opening, other) for other in walls.others):
        return None
    attributes = [
        Attribute("size", f"{width:.3f} x {tall:.3f} m, sill {sill:.3f} m", width_log + tall_log + sill_log),
        Attribute("wall", str(place.wall), math.log(place.share)),
        Attribute("offset", f"{place.offset_m:.3f} m", _offset_log_density(place.along_m, rule, place.slack_m)),
    ]
    if kind == "door":
        attributes.append(Attribute("swing", opening.swing, math.log(rule.swing_in if swings_in else 1.0 - rule.swing_in)))
    return DrawnOpening(opening, tuple(attributes))


class _Place(NamedTuple):
    """A place in a wall: the wall and its probability, metres from its start, metres along what is free of it, and what that leaves."""

    wall: int
    share: float
    offset_m: float
    along_m: float
    slack_m: float


def _draw_place(rule: OpeningRule, walls: FreeWalls, width: float, top: float, rng: np.random.Generator) -> _Place | None:
    """Draw a wall that is long enough and the place along it; None where no wall is, or the ceiling is too low."""
    spans = [(0.0, length) for length in wall_lengths(walls.polygon_m)] if walls.stretches is None else walls.stretches(top)
    lengths = [high - low for low, high in spans]
    excluded = set(walls.closed)
    if rule.wall_without_door:
        excluded |= {other.wall for other in walls.others if other.category != "window"}
    if rule.floor_depth_m > 0.0:
        excluded |= {wall for wall, depth in enumerate(_floor_depths(walls.polygon_m)) if depth < rule.floor_depth_m}
    usable = [
        0.0 if i in excluded or length < width + 2.0 * rule.end_gap_m else math.pow(length, rule.length_power)
        for i, length in enumerate(lengths)
    ]
    if sum(usable) <= 0.0 or top > walls.height_m - rule.casing_m:
        return None
    shares = [length / sum(usable) for length in usable]
    wall = draw_index(rng, shares)
    slack = lengths[wall] - width
    along = _draw_offset(rng, rule, slack)
    return _Place(wall, shares[wall], spans[wall][0] + along, along, slack)


def _is_too_close(rule: OpeningRule, walls: FreeWalls, place: _Place, width: float) -> bool:
    """Return whether an opening is too close to an end of its wall or to another opening."""
    first, last = _end_gaps(walls.polygon_m, place.wall, rule)
    return not first <= place.along_m <= place.slack_m - last or any(
        other.wall == place.wall
        and place.offset_m < other.offset_m + other.width_m + 2.0 * rule.casing_m
        and other.offset_m < place.offset_m + width + 2.0 * rule.casing_m
        for other in walls.others
    )


def _end_gaps(polygon_m: Sequence[Point2], wall: int, rule: OpeningRule) -> tuple[float, float]:
    """Return the least distances of an opening from both ends of its wall.

    At a corner that juts into the room its casing stays on the wall.
    """
    if rule.end_gap_m >= rule.casing_m:
        return rule.end_gap_m, rule.end_gap_m
    juts = wall_rows(polygon_m)[:, REFLEX]
    first, last = (rule.casing_m if juts[corner % len(juts)] else rule.end_gap_m for corner in (wall, wall + 1))
    return first, last


def _leads_back(polygon_m: Sequence[Point2], opening: Opening) -> bool:
    """Return whether another wall of the same room is close behind an opening, as in the slit between the arms of a U."""
    rows = wall_rows(polygon_m)
    own = rows[opening.wall]
    offsets = opening.offset_m + opening.width_m * np.array([0.0, 0.5, 1.0])
    points = own[[START_X, START_Y]] + np.outer(offsets, own[[ALONG_X, ALONG_Y]])
    outward = -own[[NORMAL_X, NORMAL_Y]]
    others = np.delete(rows, opening.wall, axis=0)
    delta = others[:, None, [START_X, START_Y]] - points
    along = others[:, None, [ALONG_X, ALONG_Y]]
    crossed = along[..., 0] * outward[1] - along[..., 1] * outward[0]
    safe = np.where(np.abs(crossed) < _PARALLEL, 1.0, crossed)
    reach = (along[..., 0] * delta[..., 1] - along[..., 1] * delta[..., 0]) / safe
    place = (outward[0] * delta[..., 1] - outward[1] * delta[..., 0]) / safe
    hit = (np.abs(crossed) >= _PARALLEL) & (reach > 0.0) & (reach < _BEYOND_M) & (place >= 0.0) & (place <= others[:, None, LENGTH])
    return bool(hit.any())


def _in_the_way(polygon_m: Sequence[Point2], opening: Opening, other: Opening) -> bool:
    """Return whether the leaf of one of two openings, a door into the room, gets before the other one or meets its leaf."""
    pairs = []
    for one, two in ((opening, other), (other, opening)):
        face = face_box(polygon_m, two, _CURTAIN_BESIDE_M if two.category == "window" else 0.0)
        pairs += [(leaf, face) for leaf in leaf_boxes(polygon_m, one)]
    swings = [leaf_boxes(polygon_m, one)[:1] for one in (opening, other)]
    pairs += [(a, b) for a in swings[0] for b in swings[1]]
    return any(footprint_penetration(a, b) > 0.0 for a, b in pairs)


def _floor_depths(polygon_m: Sequence[Point2]) -> list[float]:
    """Return how far the floor reaches at most from the line of each wall, metres."""
    points = np.array(polygon_m)
    along = np.roll(points, -1, axis=0) - points
    inward = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    depths: list[float] = np.max(dot(points[None] - points[:, None], inward[:, None]), axis=1).tolist()
    return depths


def _draw_offset(rng: np.random.Generator, rule: OpeningRule, slack: float) -> float:
    """Draw the distance of an opening from the start of its wall; ``slack`` is the wall's length less the opening's width."""
    corner, u = rule.corner_gap_m, rng.random()
    if u < rule.near_corner:
        gap = draw_truncated_normal(rng, corner.mean, corner.sd, corner.low, corner.high)
        return gap if u < 0.5 * rule.near_corner else slack - gap
    return rule.end_gap_m + (slack - 2.0 * rule.end_gap_m) * rng.random()


def _offset_log_density(offset: float, rule: OpeningRule, slack: float) -> float:
    """Return the log-density of :func:`_draw_offset`: a mixture of both ends and the uniform distribution."""
    corner = rule.corner_gap_m
    ends = (truncated_normal_log_density(end, corner.mean, corner.sd, corner.low, corner.high) for end in (offset, slack - offset))
    density = 0.5 * rule.near_corner * sum(math.exp(log) for log in ends)
    free = slack - 2.0 * rule.end_gap_m
    if free > 0.0 and rule.end_gap_m <= offset <= slack - rule.end_gap_m:
        density += (1.0 - rule.near_corner) / free
    return math.log(max(density, 1e-300))


def _draw_bay_windows(
    rule: OpeningRule, first: int, label: int, walls: FreeWalls, bay: Sequence[int], most: int, rng: np.random.Generator
) -> list[DrawnOpening]:
    """Draw the windows of a bay: one in its front wall, and where its sides are long enough one in each of them, all at one height.

    ``first``: object id of the first one; ``bay``: walls, the front one in the middle; ``most``: how many, the front first.

    Raises:
        RejectedError: they do not fit below the ceiling.
    """
    (tall, tall_log), (sill, sill_log) = (draw_with_log_density(rng, normal) for normal in (rule.height_m, rule.sill_m))
    if sill + tall > walls.height_m - rule.casing_m:
        raise RejectedError("a wall with space for a window")
    lengths = wall_lengths(walls.polygon_m)
    before, front, after = bay
    drawn: list[DrawnOpening] = []
    for wall in (front, before, after):
        length = lengths[wall]
        wide = wall == front and length - 2.0 * _CURTAIN_PIER_M >= _LEAST_FRONT_M
        width = length - 2.0 * (_CURTAIN_PIER_M if wide else _PIER_M)
        if width < _LEAST_WIDTH_M or len(drawn) == most:
            continue
        opening = Opening(
            id=first + len(drawn),
            category="window",
            label=label,
            wall=wall,
            offset_m=0.5 * (length - width),
            sill_m=sill,
            width_m=width,
            height_m=tall,
            hinge="end",
            swing="out",
            model=ModelReference(generator="window", seed=int(rng.integers(_MAX_SEED))),
            parts=(),
        )
        text = f"{width:.3f} x {tall:.3f} m, sill {sill:.3f} m"
        drawn.append(
            DrawnOpening(opening, (Attribute("size", text, 0.0 if drawn else tall_log + sill_log), Attribute("wall", str(wall), 0.0)))
        )
    return drawn
