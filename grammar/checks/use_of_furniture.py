"""Faults of use about furniture: screens that no seat faces, chairs at no table, blocked fronts, backs that stand free of walls."""

from __future__ import annotations

import math

import numpy as np

from grammar.checks.furnished import Furnished, back_gap, in_boxes, taken_share, whole_box, world_points
from grammar.geometry.boxes import footprint_penetration
from scene_description import SceneObject

VIEW_RAD, VIEW_M = math.radians(60.0), 8.0
FACING_RAD, FACING_M = math.radians(40.0), 0.6
FRONT_SHARE, FRONT_GAP_M, FRONT_DEPTH_M = 0.5, 0.05, 0.35
OFF_WALL_M = {"shelf": 0.1, "wardrobe": 0.1, "bed": 0.15, "fridge": 0.15}
BEDSIDE_M = 0.3


def screen_unseen(found: Furnished) -> list[int]:
    """Return screens that no seat looks at: within ``VIEW_RAD`` of the directions that both look in, and within ``VIEW_M``."""
    seats = found.having("seat")
    return [item.id for item in found.having("screen") if not any(_face_each_other(item, seat) for seat in seats)]


def _face_each_other(screen: SceneObject, seat: SceneObject) -> bool:
    dx, dy = screen.position_m[0] - seat.position_m[0], screen.position_m[1] - seat.position_m[1]
    if math.hypot(dx, dy) > VIEW_M:
        return False
    to_screen = math.atan2(dy, dx)
    turned = (seat.yaw_rad - to_screen, screen.yaw_rad - to_screen - math.pi)
    return all(abs(math.remainder(angle, 2.0 * math.pi)) <= VIEW_RAD for angle in turned)


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


def front_blocked(found: Furnished) -> list[int]:
    """Return stores and appliances whose front is blocked to more than ``FRONT_SHARE``."""
    return [item.id for item in found.standing("store") if taken_share(found, item, "front", FRONT_GAP_M, FRONT_DEPTH_M) > FRONT_SHARE]


def shelf_off_wall(found: Furnished) -> list[int]:
    """Return shelves with no wall behind their backs; back to back with another one is as good."""
    shelves = found.standing("shelf")
    return [item.id for item in shelves if back_gap(found, item) > OFF_WALL_M["shelf"] and not _back_to_back(item, shelves)]


def _back_to_back(item: SceneObject, others: list[SceneObject]) -> bool:
    behind = world_points(item, np.array([-0.5 * item.size_m[0] - OFF_WALL_M["shelf"]]), np.zeros(1))
    return any(
        other.id != item.id
        and abs(math.remainder(other.yaw_rad - item.yaw_rad - math.pi, 2.0 * math.pi)) < VIEW_RAD
        and bool(in_boxes(behind, whole_box(other)[None])[0])
        for other in others
    )


def wardrobe_off_wall(found: Furnished) -> list[int]:
    """Return wardrobes with no wall behind their backs."""
    return [item.id for item in found.standing("wardrobe") if back_gap(found, item) > OFF_WALL_M["wardrobe"]]


def bed_off_wall(found: Furnished) -> list[int]:
    """Return beds whose head is not at a wall."""
    return [item.id for item in found.standing("bed") if back_gap(found, item) > OFF_WALL_M["bed"]]


def fridge_off_wall(found: Furnished) -> list[int]:
    """Return refrigerators with no wall behind their backs."""
    return [item.id for item in found.standing("fridge") if back_gap(found, item) > OFF_WALL_M["fridge"]]


def bedside_astray(found: Furnished) -> list[int]:
    """Return nightstands further than ``BEDSIDE_M`` from any bed of a room that has one."""
    beds = [whole_box(item) for item in found.standing("bed")]
    stands = found.standing("bedside")
    return [item.id for item in stands if beds and max(footprint_penetration(whole_box(item), bed) for bed in beds) < -BEDSIDE_M]


def no_bathing(found: Furnished) -> list[int]:
    """Return the room (0) if it is a bathroom without bath and shower."""
    return [0] if found.room_type == "bathroom" and not found.having("bathing") else []
