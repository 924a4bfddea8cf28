"""Faults of use about seats and what belongs to them: chairs and their places at tables, sofas and coffee tables, screens."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from grammar.checks.furnished import Furnished, in_boxes, outside, taken_share, wall_distance, world_points
from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import (
    COS_YAW,
    HALF_DEPTH,
    HALF_WIDTH,
    SIN_YAW,
    Z_HIGH,
    Z_LOW,
    X,
    Y,
    box_rows,
    footprint_corners,
    footprint_penetration,
)
from grammar.geometry.solids import whole_box
from grammar.geometry.zones import opening_frame
from grammar.layout.frames import aslant
from scene_description import SceneObject

VIEW_RAD, VIEW_M = math.radians(60.0), 8.0
FACING_RAD, FACING_M = math.radians(40.0), 0.6
REACH_M, ASIDE_M = 1.0, 0.3
LEGROOM_M, LEGROOM_SHARE, KNEE_M = 0.6, 0.3, 0.6
COMPANY_M = 4.0
GLARE_SHARE, SCREEN_WINDOW_M = 0.2, 0.9
ASIDE_RAD = math.radians(40.0)
FEET_M, TABLE_OFF_M, CRAMPED_SHARE, SHIN_M = 0.35, 0.06, 0.3, 0.2
NEAR_M, ASKEW_RAD = 0.6, math.radians(35.0)
ELBOWS_M, PLACE_DEPTH_M, SHARED_M = 0.5, 0.2, 0.12
CORNER_M = 0.17
SEATED_M, BODY_M, SEATED_SHARE, BEHIND_CHAIR_M = 0.35, 0.4, 0.1, 0.3
"""A seated person's trunk is 0.33 m deep at most (95th percentile of men: Pheasant and Haslegrave, Bodyspace)."""
BEHIND_STEP_M, BEHIND_MOST_M = 0.02, 2.0
BEFORE_M, FILLER_M = 0.4, 0.08


def screen_unseen(found: Furnished) -> list[int]:
    """Return screens that no seat looks at: within ``VIEW_RAD`` of the directions that both look in, and within ``VIEW_M``.

    Who is on a machine looks over its console, at its back.
    """
    machines = {item.id for item in found.having("machine")}
    seats = [replace(item, yaw_rad=item.yaw_rad + math.pi * (item.id in machines)) for item in found.having("seat")]
    return [item.id for item in found.having("screen") if not any(_face_each_other(item, seat) for seat in seats)]


def _face_each_other(screen: SceneObject, seat: SceneObject) -> bool:
    return _looks_at(seat, screen, VIEW_M) and _looks_at(screen, seat, VIEW_M)


def _looks_at(item: SceneObject, other: SceneObject, within_m: float) -> bool:
    """Return whether an object's middle is within ``VIEW_RAD`` of the direction that another one looks in, and near enough."""
    dx, dy = other.position_m[0] - item.position_m[0], other.position_m[1] - item.position_m[1]
    turned = abs(math.remainder(item.yaw_rad - math.atan2(dy, dx), 2.0 * math.pi))
    return math.hypot(dx, dy) <= within_m and turned <= VIEW_RAD


def second_screen(found: Furnished) -> list[int]:
    """Return the screens of a room beyond the largest one."""
    screens = sorted(found.having("screen"), key=lambda item: (-item.size_m[1], item.id))
    return [item.id for item in screens[1:]]


def chair_at_no_table(found: Furnished) -> list[int]:
    """Return chairs and stools before which no table or desk stands within ``FACING_M`` and ``FACING_RAD``."""
    tables = box_rows(whole_box(item) for item in found.standing("table"))
    angle, reach = np.meshgrid(np.linspace(-FACING_RAD, FACING_RAD, 5), np.linspace(0.0, 1.0, 10))
    bad = []
    for item in found.standing("pulled_up"):
        away = reach * (0.5 * item.size_m[0] + FACING_M)
        if not in_boxes(world_points(item, away * el.cos(angle), away * el.sin(angle)), tables).any():
            bad.append(item.id)
    return bad


def chair_behind_chair(found: Furnished) -> list[int]:
    """Return chairs and stools with another one that looks the same way between them and their table."""
    chairs = found.standing("pulled_up")
    tables = box_rows(whole_box(item) for item in found.standing("table"))
    bad = []
    for item in chairs:
        others = [other for other in chairs if other is not item and abs(math.remainder(other.yaw_rad - item.yaw_rad, math.tau)) < VIEW_RAD]
        if others:
            reach = np.linspace(0.0, 0.5 * item.size_m[0] + FACING_M, 24)
            points = world_points(item, reach, np.zeros(24))
            at_table, at_chair = in_boxes(points, tables), in_boxes(points, np.array([whole_box(other) for other in others]))
            if at_chair.any() and not at_table[: int(at_chair.argmax()) + 1].any():
                bad.append(item.id)
    return bad


def coffee_table_astray(found: Furnished) -> list[int]:
    """Return low tables that no sofa or armchair stands within ``REACH_M`` of; where one has such a seat, others may stand at walls."""
    seats = box_rows(whole_box(item) for item in found.standing("lounge"))
    low = found.standing("low_table")
    astray = [item for item in low if not any(footprint_penetration(whole_box(item), seat) > -REACH_M for seat in seats)]
    served = len(astray) < len(low)
    return [item.id for item in astray if not served or wall_distance(found, footprint_corners(whole_box(item))) > ASIDE_M]


def coffee_table_aside(found: Furnished) -> list[int]:
    """Return low tables away from walls that lie before no sofa or armchair: neither middle is between the other's sides."""
    return [
        item.id
        for item in found.standing("low_table")
        if wall_distance(found, footprint_corners(whole_box(item))) > ASIDE_M
        and found.standing("lounge")
        and not any(_lies_before(item, seat) for seat in found.standing("lounge"))
    ]


def _lies_before(item: SceneObject, seat: SceneObject) -> bool:
    dx, dy = item.position_m[0] - seat.position_m[0], item.position_m[1] - seat.position_m[1]
    ahead, aside = dx * math.cos(seat.yaw_rad) + dy * math.sin(seat.yaw_rad), dy * math.cos(seat.yaw_rad) - dx * math.sin(seat.yaw_rad)
    return ahead > 0.0 and abs(aside) < 0.5 * max(seat.size_m[1], min(item.size_m[:2]))


def seat_faces_wall(found: Furnished) -> list[int]:
    """Return sofas and armchairs with a wall, or things higher than ``KNEE_M`` but for such seats, in a third of their legroom."""
    seats = found.standing("lounge")
    high = found.only((found.boxes[:, Z_HIGH] > KNEE_M) & ~np.isin(found.owner, [seat.id for seat in seats]))
    return [seat.id for seat in seats if taken_share(high, seat, "front", 0.05, LEGROOM_M) > LEGROOM_SHARE]


def seat_alone(found: Furnished) -> list[int]:
    """Return sofas and armchairs that need company and look at no low table, screen or other such seat within ``COMPANY_M``."""
    seats = found.standing("lounge") if found.needs.company else []
    company = [*found.having("screen"), *found.standing("low_table"), *seats]
    return [seat.id for seat in seats if not any(other is not seat and _looks_at(seat, other, COMPANY_M) for other in company)]


def before_window(found: Furnished, item: SceneObject) -> bool:
    """Return whether a screen stands before a window or its curtain with more than ``GLARE_SHARE`` of its width."""
    points = world_points(item, np.zeros(9), np.linspace(-0.5, 0.5, 9) * item.size_m[1])
    for opening in found.room.openings:
        x, y, yaw = opening_frame(found.room, opening)
        into = (points[:, 0] - x) * math.cos(yaw) + (points[:, 1] - y) * math.sin(yaw)
        left = (points[:, 1] - y) * math.cos(yaw) - (points[:, 0] - x) * math.sin(yaw)
        near = (into > -0.1) & (into < SCREEN_WINDOW_M) & (np.abs(left) < 0.5 * opening.width_m)
        if opening.category == "window" and near.mean() > GLARE_SHARE:
            return True
    return False


def screen_aside(found: Furnished) -> list[int]:
    """Return screens further than ``ASIDE_RAD`` aside of the largest sofa or bed.

    The chain's term ``screen_aside`` measures the same angle against a tighter bound; a sofa goes before a larger bed there.
    """
    seats = found.standing("lounge", "bed")
    if not seats:
        return []
    best = max(item.size_m[0] * item.size_m[1] for item in seats)
    main = [item for item in seats if item.size_m[0] * item.size_m[1] > 0.9 * best]
    return [item.id for item in found.having("screen") if min(map(lambda seat: _aslant(item, seat), main)) > ASIDE_RAD]


def _aslant(screen: SceneObject, seat: SceneObject) -> float:
    dx, dy = seat.position_m[0] - screen.position_m[0], seat.position_m[1] - screen.position_m[1]
    return float(aslant(dx, dy, screen.yaw_rad, seat.yaw_rad))


def seat_cramped(found: Furnished) -> list[int]:
    """Return sofas and armchairs that leave no room for feet.

    Furniture or walls take more than ``CRAMPED_SHARE`` of ``FEET_M`` before them, or low tables, but for those in the corner of a sofa,
    of ``TABLE_OFF_M``.
    """
    tables = found.standing("low_table")
    solid = found.only(
        (found.boxes[:, Z_HIGH] > SHIN_M) & (found.boxes[:, Z_LOW] < KNEE_M) & ~np.isin(found.owner, [item.id for item in tables])
    )
    bad = []
    for seat in found.standing("lounge"):
        before = [item.id for item in tables if footprint_penetration(whole_box(item), whole_box(seat)) <= 0.01]
        low = found.only(np.isin(found.owner, before))
        if max(taken_share(solid, seat, "front", 0.03, FEET_M), taken_share(low, seat, "front", 0.0, TABLE_OFF_M)) > CRAMPED_SHARE:
            bad.append(seat.id)
    return bad


class Place(NamedTuple):
    """Where a chair is drawn up to a table: middles of its place and of that edge of the table, yaw out of the table, the edge's length."""

    chair: SceneObject
    table: SceneObject
    at_m: tuple[float, float]
    edge_at_m: tuple[float, float]
    out_rad: float
    edge_m: float

    @property
    def to_end_m(self) -> float:
        """How far the middle of the place is from the nearer end of the edge."""
        return 0.5 * self.edge_m - math.dist(self.at_m, self.edge_at_m)

    def strip(self, from_m: float, to_m: float, width_m: float) -> Boxes:
        """Return a box (8,) from ``from_m`` to ``to_m`` out of the table, about the middle of the place."""
        return _strip(self.at_m, self.out_rad, (from_m, to_m), width_m)


def _strip(at_m: tuple[float, float], out_rad: float, reach_m: tuple[float, float], width_m: float) -> Boxes:
    c, s, middle = math.cos(out_rad), math.sin(out_rad), 0.5 * sum(reach_m)
    return np.array([at_m[0] + middle * c, at_m[1] + middle * s, 0.0, 1.0, 0.5 * (reach_m[1] - reach_m[0]), 0.5 * width_m, c, s])


def places(found: Furnished) -> Iterator[Place]:
    """Yield the places of chairs and stools that face a table or desk within ``NEAR_M``."""
    tables = found.standing("table")
    for chair in found.standing("pulled_up"):
        best, least = None, 0.5 * chair.size_m[0] + NEAR_M
        for table in tables:
            met = _met(chair, table)
            if met is not None and met[0] < least:
                least, best = met[0], met[1]
        if best is not None:
            yield best


def _met(chair: SceneObject, table: SceneObject) -> tuple[float, Place] | None:
    """Return how far before a chair's middle its line of sight enters a table, and its place there; None if it misses the table."""
    box = whole_box(table)
    dx, dy = chair.position_m[0] - box[X], chair.position_m[1] - box[Y]
    start = (dx * box[COS_YAW] + dy * box[SIN_YAW], dy * box[COS_YAW] - dx * box[SIN_YAW])
    turn = chair.yaw_rad - table.yaw_rad
    ray, half = (math.cos(turn), math.sin(turn)), (box[HALF_DEPTH], box[HALF_WIDTH])
    enter, leave, side = -math.inf, math.inf, 0
    for axis in (0, 1):
        if abs(ray[axis]) < 1e-9:
            if abs(start[axis]) >= half[axis]:
                return None
            continue
        near, far = sorted(((-half[axis] - start[axis]) / ray[axis], (half[axis] - start[axis]) / ray[axis]))
        if near > enter:
            enter, side = near, axis
        leave = min(leave, far)
    if enter >= leave or leave <= 0.0:
        return None
    at, edge = [start[0] + enter * ray[0], start[1] + enter * ray[1]], [0.0, 0.0]
    edge[side] = at[side]
    out = table.yaw_rad + (0.5 * math.pi if side else 0.0) + (math.pi if ray[side] > 0.0 else 0.0)
    middles = [
        (float(box[X] + u * box[COS_YAW] - v * box[SIN_YAW]), float(box[Y] + u * box[SIN_YAW] + v * box[COS_YAW])) for u, v in (at, edge)
    ]
    return float(enter), Place(chair, table, middles[0], middles[1], out, float(2.0 * half[1 - side]))


def place_shared(found: Furnished) -> list[int]:
    """Return chairs too close to another one of their table.

    Those at one edge are nearer than ``ELBOWS_M``; those at two edges share more than ``SHARED_M`` of their places, each ``ELBOWS_M`` of
    the edge and ``PLACE_DEPTH_M`` deep.
    """
    taken = [(place, place.strip(-PLACE_DEPTH_M, 0.0, ELBOWS_M)) for place in places(found)]
    bad = set()
    for k, (place, box) in enumerate(taken):
        for other, another in taken[:k]:
            if other.table is not place.table:
                continue
            beside = math.dist(place.edge_at_m, other.edge_at_m) < 1e-6
            if math.dist(place.at_m, other.at_m) < ELBOWS_M if beside else footprint_penetration(box, another) > SHARED_M:
                bad |= {place.chair.id, other.chair.id}
    return sorted(bad)


def chair_at_corner(found: Furnished) -> list[int]:
    """Return chairs drawn up to a corner of their table.

    They are nearer than ``CORNER_M`` to the end of its edge, aslant by ``ASKEW_RAD``, or look past it straight ahead.
    """
    bad = []
    drawn_up = list(places(found))
    for place in drawn_up:
        aslant = abs(math.remainder(place.out_rad + math.pi - place.chair.yaw_rad, math.tau))
        if place.to_end_m < min(CORNER_M, 0.4 * place.edge_m) or aslant > ASKEW_RAD:
            bad.append(place.chair.id)
    at_none = {item.id for item in found.standing("pulled_up")} - {place.chair.id for place in drawn_up}
    return sorted([*bad, *at_none.difference(chair_at_no_table(found))])


def chair_wedged(found: Furnished) -> list[int]:
    """Return chairs that nobody can sit down on: less than ``SEATED_M`` between the edge of the table and what stands behind."""
    return [place.chair.id for place in places(found) if _taken_behind(found, place, SEATED_M)]


def behind_chairs_m(found: Furnished) -> list[float]:
    """Return for each chair at a table how far behind the table's edge something stands, to ``BEHIND_STEP_M``, ``BEHIND_MOST_M`` at most.

    With a greater limit :func:`chair_wedged` would find the chair wedged.
    """
    steps = np.arange(2.0 * BEHIND_STEP_M, BEHIND_MOST_M, BEHIND_STEP_M)
    return [next((float(m) for m in steps if _taken_behind(found, place, float(m))), BEHIND_MOST_M) for place in places(found)]


def _taken_behind(found: Furnished, place: Place, to_m: float) -> bool:
    """Return whether walls or things, but for chairs, take more than ``SEATED_SHARE`` of the strip behind the edge of a table."""
    chairs = [item.id for item in found.standing("pulled_up")]
    solid = (found.boxes[:, Z_HIGH] > BEHIND_CHAIR_M) & (found.boxes[:, Z_LOW] < 1.0) & ~np.isin(found.owner, [*chairs, place.table.id])
    points = _grid(place.strip(0.03, to_m, BODY_M))
    return bool((in_boxes(points, found.boxes[solid]) | outside(found, points)).mean() > SEATED_SHARE)


def filler_at_table(found: Furnished) -> list[int]:
    """Return plants, bins and lamps on the floor within ``BEFORE_M`` of an edge of a table that a chair is drawn up to."""
    fillers = [(item.id, whole_box(item)) for item in found.standing("filler")]
    bad: set[int] = set()
    for place in places(found) if fillers else ():
        strip = _strip(place.edge_at_m, place.out_rad, (0.0, BEFORE_M), place.edge_m)
        bad.update(number for number, box in fillers if footprint_penetration(strip, box) > FILLER_M)
    return sorted(bad)


def _grid(box: Boxes) -> Floats:
    """Return (144, 2) points of a box's footprint."""
    steps = (np.arange(12) + 0.5) / 6.0 - 1.0
    u, v = (grid.ravel() for grid in np.meshgrid(box[HALF_DEPTH] * steps, box[HALF_WIDTH] * steps))
    return np.column_stack([box[X] + u * box[COS_YAW] - v * box[SIN_YAW], box[Y] + u * box[SIN_YAW] + v * box[COS_YAW]])
