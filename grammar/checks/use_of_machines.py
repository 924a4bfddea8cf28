"""Faults of use about what needs room around it, machines and mats for exercise and cars, and about small things in the way or in heaps."""

from __future__ import annotations

import math

import numpy as np

from grammar.checks.furnished import Furnished, in_boxes, taken_share, whole_box, world_points
from grammar.geometry.arrays import Boxes
from grammar.geometry.boxes import HALF_DEPTH, Z_HIGH, Z_LOW, X, Y, footprint_penetration
from grammar.geometry.zones import opening_frame, side_rectangle
from scene_description import SceneObject

MOUNT_SHARE, MOUNT_GAP_M, MOUNT_DEPTH_M = 0.4, 0.02, 0.4
MAT_SHARE, MAT_GAP_M, MAT_DEPTH_M = 0.3, 0.01, 0.12
DOOR_SHARE, DOOR_GAP_M, DOOR_DEPTH_M = 0.3, 0.02, 0.4
TOUCHED_M, OVER_CURB_M, HUNG_M = 0.12, 0.12, 1.0
ASKEW_RAD, ASKEW_GAP_M = math.radians(6.0), 0.6
HUDDLE_M, HUDDLE = 0.3, 3
BEFORE_DEPTH_M, BEFORE_SHARE = 0.4, 0.3
_STEPS = (np.arange(12) + 0.5) / 6.0 - 1.0


def machine_hemmed(found: Furnished) -> list[int]:
    """Return machines that nobody gets on or off: the front is blocked, or both sides are."""
    return [item.id for item in found.standing("machine") if _hemmed(found, item)]


def _hemmed(found: Furnished, item: SceneObject) -> bool:
    front, left, right = (taken_share(found, item, side, MOUNT_GAP_M, MOUNT_DEPTH_M) for side in ("front", "left", "right"))
    return front > MOUNT_SHARE or min(left, right) > MOUNT_SHARE


def mat_hemmed(found: Furnished) -> list[int]:
    """Return mats for exercise near which, by ``MAT_DEPTH_M``, machines or furniture stand, or another mat lies askew."""
    mats = found.standing("floor_work")
    if not mats:
        return []
    standing = found.boxes[(found.boxes[:, Z_HIGH] > OVER_CURB_M) & (found.boxes[:, Z_LOW] < HUNG_M)]
    taken = [mat.id for mat in mats if any(_taken(standing, mat, side) > MAT_SHARE for side in ("front", "back", "left", "right"))]
    return sorted({*taken, *(mat.id for mat in mats if any(_askew(mat, other) for other in mats))})


def _askew(mat: SceneObject, other: SceneObject) -> bool:
    """Return whether two mats are near each other and not parallel."""
    apart = -footprint_penetration(whole_box(mat), whole_box(other))
    return abs(math.sin(mat.yaw_rad - other.yaw_rad)) > ASKEW_RAD and apart < ASKEW_GAP_M


def _taken(standing: Boxes, mat: SceneObject, side: str) -> float:
    """Return the share of the strip along a side of a mat that boxes (n, 8) take; walls do not count."""
    x, y, half_d, half_w = side_rectangle(side, MAT_DEPTH_M, mat.size_m)
    u, v = np.meshgrid(x + np.sign(x) * MAT_GAP_M + half_d * _STEPS, y + np.sign(y) * MAT_GAP_M + half_w * _STEPS)
    return float(in_boxes(world_points(mat, u, v), standing).mean())


def car_shut_in(found: Furnished) -> list[int]:
    """Return vehicles whose doors open at neither side, with things nearer than ``TOUCHED_M``, or with things in the way out."""
    return [item.id for item in found.standing("vehicle") if _doors_blocked(found, item) or _way_out_blocked(found, item)]


def _doors_blocked(found: Furnished, item: SceneObject) -> bool:
    others = found.boxes[(found.owner != item.id) & (found.boxes[:, Z_LOW] < HUNG_M)]
    touched = any(footprint_penetration(whole_box(item), other) > -TOUCHED_M for other in others)
    return touched or all(taken_share(found, item, side, DOOR_GAP_M, DOOR_DEPTH_M) > DOOR_SHARE for side in ("left", "right"))


def _way_out_blocked(found: Furnished, item: SceneObject) -> bool:
    """Return whether something stands on the strip between a vehicle and the door for it, as wide as the vehicle."""
    standing = found.boxes[(found.owner != item.id) & (found.boxes[:, Z_LOW] < HUNG_M)]
    for opening in found.room.openings:
        if opening.category == "garage_door":
            x, y, _ = opening_frame(found.room, opening)
            dx, dy = x - item.position_m[0], y - item.position_m[1]
            ahead = dx * math.cos(item.yaw_rad) + dy * math.sin(item.yaw_rad)
            u, v = np.meshgrid(np.linspace(0.0, 1.0, 24) * ahead, 0.45 * item.size_m[1] * _STEPS)
            return bool(in_boxes(world_points(item, u, v), standing).any())
    return False


def fillers_huddled(found: Furnished) -> list[int]:
    """Return plants, vases, bins, lamps and balls of which ``HUDDLE`` or more stand on the floor ``HUDDLE_M`` or less from the next."""
    items = found.standing("filler")
    boxes, group = [whole_box(item) for item in items], list(range(len(items)))
    for i in range(len(items)):
        for j in range(i):
            if footprint_penetration(boxes[i], boxes[j]) > -HUDDLE_M:
                old, new = group[i], group[j]
                group = [new if one == old else one for one in group]
    return [item.id for item, one in zip(items, group, strict=True) if group.count(one) >= HUDDLE]


def thing_before_front(found: Furnished) -> list[int]:
    """Return plants, vases, bins, lamps, balls and machines that stand before the front of a store or appliance."""
    u, v = np.meshgrid(0.5 * _STEPS, 0.5 * _STEPS)
    stores = [_strip_before(item) for item in found.standing("store")]
    bad = []
    for item in found.standing("filler", "machine") if stores else []:
        points = world_points(item, u * item.size_m[0], v * item.size_m[1])
        if in_boxes(points, np.array(stores)).mean() > BEFORE_SHARE:
            bad.append(item.id)
    return bad


def _strip_before(item: SceneObject) -> Boxes:
    """Return the box (8,) of the floor before the front of a store."""
    box = whole_box(item)
    box[[X, Y]] = world_points(item, np.array([0.5 * (item.size_m[0] + BEFORE_DEPTH_M)]), np.zeros(1))[0]
    box[HALF_DEPTH] = 0.5 * BEFORE_DEPTH_M
    return box
