"""Faults of use about seats and what belongs to them: chairs and tables, sofas and coffee tables, screens."""

from __future__ import annotations

import math

import numpy as np

from grammar.checks.furnished import Furnished, face_covered, in_boxes, taken_share, wall_distance, whole_box, world_points
from grammar.geometry.boxes import Z_HIGH, Z_LOW, footprint_corners, footprint_penetration
from grammar.geometry.zones import opening_frame
from scene_description import SceneObject

VIEW_RAD, VIEW_M = math.radians(60.0), 8.0
FACING_RAD, FACING_M = math.radians(40.0), 0.6
REACH_M, ASIDE_M = 1.0, 0.3
LEGROOM_M, LEGROOM_SHARE, KNEE_M = 0.6, 0.3, 0.6
COMPANY_M = 4.0
SCREEN_SHARE, SCREEN_DEPTH_M = 0.15, 0.6
GLARE_SHARE, SCREEN_WINDOW_M = 0.2, 0.9
ASIDE_RAD = math.radians(40.0)
FEET_M, TABLE_OFF_M, CRAMPED_SHARE, SHIN_M = 0.35, 0.06, 0.3, 0.2


def screen_unseen(found: Furnished) -> list[int]:
    """Return screens that no seat looks at: within ``VIEW_RAD`` of the directions that both look in, and within ``VIEW_M``."""
    seats = found.having("seat")
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


def screen_hidden(found: Furnished) -> list[int]:
    """Return screens that things within ``SCREEN_DEPTH_M`` of their faces cover to more than ``SCREEN_SHARE``."""
    bad = []
    for item in found.having("screen"):
        x, y = world_points(item, np.array([0.5 * item.size_m[0]]), np.zeros(1))[0]
        boxes = found.boxes[found.owner != item.id]
        heights = (item.position_m[2], item.position_m[2] + item.size_m[2])
        if face_covered(boxes, (x, y, item.yaw_rad), item.size_m[1], heights, SCREEN_DEPTH_M).any(0).mean() > SCREEN_SHARE:
            bad.append(item.id)
    return bad


def chair_at_no_table(found: Furnished) -> list[int]:
    """Return chairs and stools before which no table or desk stands within ``FACING_M`` and ``FACING_RAD``."""
    tables = np.array([whole_box(item) for item in found.standing("table")]).reshape(-1, 8)
    angle, reach = np.meshgrid(np.linspace(-FACING_RAD, FACING_RAD, 5), np.linspace(0.0, 1.0, 10))
    bad = []
    for item in found.standing("pulled_up"):
        away = reach * (0.5 * item.size_m[0] + FACING_M)
        if not in_boxes(world_points(item, away * np.cos(angle), away * np.sin(angle)), tables).any():
            bad.append(item.id)
    return bad


def chair_behind_chair(found: Furnished) -> list[int]:
    """Return chairs and stools with another one that looks the same way between them and their table."""
    chairs = found.standing("pulled_up")
    tables = np.array([whole_box(item) for item in found.standing("table")]).reshape(-1, 8)
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
    seats = np.array([whole_box(item) for item in found.standing("lounge")]).reshape(-1, 8)
    low = found.standing("low_table")
    astray = [item for item in low if not any(footprint_penetration(whole_box(item), seat) > -REACH_M for seat in seats)]
    served = len(astray) < len(low)
    return [item.id for item in astray if not served or wall_distance(found, footprint_corners(whole_box(item))) > ASIDE_M]


def seat_faces_wall(found: Furnished) -> list[int]:
    """Return sofas and armchairs with a wall, or things higher than ``KNEE_M`` but for such seats, in a third of their legroom."""
    seats = found.standing("lounge")
    high = found.only((found.boxes[:, Z_HIGH] > KNEE_M) & ~np.isin(found.owner, [seat.id for seat in seats]))
    return [seat.id for seat in seats if taken_share(high, seat, "front", 0.05, LEGROOM_M) > LEGROOM_SHARE]


def seat_alone(found: Furnished) -> list[int]:
    """Return sofas and armchairs of a living room that look at no low table, no screen and no other such seat within ``COMPANY_M``."""
    seats = found.standing("lounge") if found.room_type == "living_room" else []
    company = [*found.having("screen"), *found.standing("low_table"), *seats]
    return [seat.id for seat in seats if not any(other is not seat and _looks_at(seat, other, COMPANY_M) for other in company)]


def screen_before_window(found: Furnished) -> list[int]:
    """Return screens that stand before a window or its curtain with more than ``GLARE_SHARE`` of their width."""
    bad = []
    for item in found.having("screen"):
        for opening in found.room.openings:
            if opening.category != "window":
                continue
            x, y, yaw = opening_frame(found.room, opening)
            points = world_points(item, np.zeros(9), np.linspace(-0.5, 0.5, 9) * item.size_m[1])
            into = (points[:, 0] - x) * math.cos(yaw) + (points[:, 1] - y) * math.sin(yaw)
            left = (points[:, 1] - y) * math.cos(yaw) - (points[:, 0] - x) * math.sin(yaw)
            near = (into > -0.1) & (into < SCREEN_WINDOW_M) & (np.abs(left) < 0.5 * opening.width_m)
            if near.mean() > GLARE_SHARE:
                bad.append(item.id)
    return sorted(set(bad))


def screen_aside(found: Furnished) -> list[int]:
    """Return screens that the largest sofa or bed looks at aslant: further than ``ASIDE_RAD`` from straight ahead of either."""
    seats = found.standing("lounge", "bed")
    if not seats:
        return []
    best = max(item.size_m[0] * item.size_m[1] for item in seats)
    main = [item for item in seats if item.size_m[0] * item.size_m[1] > 0.9 * best]
    return [item.id for item in found.having("screen") if min(map(lambda seat: _aslant(item, seat), main)) > ASIDE_RAD]


def _aslant(a: SceneObject, b: SceneObject) -> float:
    """Return the larger of the angles between the directions that two objects look in and the line between their middles."""
    yaw = math.atan2(b.position_m[1] - a.position_m[1], b.position_m[0] - a.position_m[0])
    return max(abs(math.remainder(a.yaw_rad - yaw, math.tau)), abs(math.remainder(b.yaw_rad - yaw - math.pi, math.tau)))


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
