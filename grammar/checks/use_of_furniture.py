"""Faults of use about furniture, machines and cars: blocked fronts and sides, backs off walls, small things astray or in the way."""

import math

import numpy as np

from grammar.checks.furnished import (
    AtFault,
    Furnished,
    against_wall,
    back_gap,
    clusters,
    in_boxes,
    strip_points,
    taken_share,
    wall_distance,
    world_points,
)
from grammar.geometry.arrays import Boxes
from grammar.geometry.boxes import HALF_DEPTH, Z_HIGH, Z_LOW, X, Y, footprint_corners, footprint_penetration
from grammar.geometry.solids import whole_box
from grammar.geometry.walls import WALL_YAW
from grammar.geometry.zones import OPEN_DEPTH_M, OPEN_GAP_M, opening_frame
from grammar.spec.categories import BACK_GAP_M
from scene_description import SceneObject

VIEW_RAD = math.radians(60.0)
FRONT_SHARE = 0.5
BEDSIDE_FRONT_M = 0.25
BEFORE_MIRROR_M = 0.8
MAT_SHARE, KNEE_HIGH_M, ASTRAY_M = 0.15, 0.3, 0.4
AT_WALL_M, ASKEW_RAD, RUG_RAD = 0.5, math.radians(1.2), math.radians(1.5)
MOUNT_SHARE, MOUNT_GAP_M, MOUNT_DEPTH_M = 0.4, 0.02, 0.4
HEMMED_SHARE, HEMMED_GAP_M, HEMMED_DEPTH_M = 0.3, 0.01, 0.12
DOOR_SHARE, DOOR_GAP_M, DOOR_DEPTH_M = 0.3, 0.02, 0.4
TOUCHED_M, OVER_CURB_M, HUNG_M = 0.12, 0.12, 1.0
MAT_ASKEW_RAD, MAT_ASKEW_GAP_M = math.radians(6.0), 0.6
HUDDLE_M, HUDDLE = 0.3, 3
BEFORE_DEPTH_M, BEFORE_SHARE = 0.4, 0.3
SHUT_SHARE = 0.1
"""Of 115 appliances and cabinets of RobotAtVirtualHome two have more of their front blocked."""
_STEPS, _EIGHTHS = (np.arange(12) + 0.5) / 6.0 - 1.0, (np.arange(8) + 0.5) / 8.0 - 0.5


def shelf_off_wall(found: Furnished) -> list[int]:
    """Return shelves with no wall behind their backs; back to back with another one is as good."""
    shelves = found.standing("shelf")
    return [item.id for item in shelves if back_gap(found, item) > BACK_GAP_M["shelf"] and not _back_to_back(item, shelves)]


def _back_to_back(item: SceneObject, others: list[SceneObject]) -> bool:
    behind = world_points(item, np.array([-0.5 * item.size_m[0] - BACK_GAP_M["shelf"]]), np.zeros(1))
    return any(
        other.id != item.id
        and abs(math.remainder(other.yaw_rad - item.yaw_rad - math.pi, 2.0 * math.pi)) < VIEW_RAD
        and bool(in_boxes(behind, whole_box(other)[None])[0])
        for other in others
    )


def basin_off_mirror(found: Furnished) -> list[int]:
    """Return washbasins of a room with mirrors, of which none hangs over any of them."""
    basins, mirrors = found.standing("basin"), found.having("mirror")
    if not basins or not mirrors:
        return []
    shown = [_before(mirror, basin) for mirror in mirrors for basin in basins]
    return [] if any(shown) else [basin.id for basin in basins]


def _before(mirror: SceneObject, basin: SceneObject) -> bool:
    """Return whether the middle of a basin is before a mirror, by half its own width at most to a side, and looks as that does."""
    dx, dy = basin.position_m[0] - mirror.position_m[0], basin.position_m[1] - mirror.position_m[1]
    c, s = math.cos(mirror.yaw_rad), math.sin(mirror.yaw_rad)
    turned = abs(math.remainder(basin.yaw_rad - mirror.yaw_rad, 2.0 * math.pi))
    return turned < VIEW_RAD and 0.0 <= dx * c + dy * s < BEFORE_MIRROR_M and abs(dy * c - dx * s) <= 0.5 * basin.size_m[1]


def no_bathing(found: Furnished) -> list[int]:
    """Return the room (0) if it needs a bath or shower and has none."""
    return found.lacking("bathing")


def stood_on(found: Furnished, item: SceneObject) -> bool:
    """Return whether things on the floor take more than ``MAT_SHARE`` of a mat for feet or exercise."""
    u, v = np.meshgrid(_EIGHTHS, _EIGHTHS)
    low = found.boxes[(found.boxes[:, Z_LOW] < KNEE_HIGH_M) & (found.owner != item.id)]
    return bool(in_boxes(world_points(item, u * item.size_m[0], v * item.size_m[1]), low).mean() > MAT_SHARE)


def _rugs(found: Furnished) -> list[SceneObject]:
    return [item for item in found.objects if found.categories[item.category].underlay and item.support.kind == "floor"]


def on_rug_edge(by_m: float) -> AtFault:
    """Return whether something stands on a rug, by more than a length, but with a part of its foot only."""

    def is_on_edge(found: Furnished, item: SceneObject) -> bool:
        box, rugs = whole_box(item), [whole_box(rug) for rug in _rugs(found)]
        deepest = max((footprint_penetration(box, rug) for rug in rugs), default=0.0)
        return deepest > by_m and not in_boxes(footprint_corners(box), np.array(rugs)).all()

    return is_on_edge


def astray(found: Furnished, item: SceneObject) -> bool:
    """Return whether something on the floor stands free, further than ``ASTRAY_M`` from walls and furniture."""
    furniture = [other for other in found.objects if other.support.kind == "floor" and not found.categories[other.category].underlay]
    near = any(footprint_penetration(whole_box(item), whole_box(other)) > -ASTRAY_M for other in furniture if other is not item)
    return not near and wall_distance(found, footprint_corners(whole_box(item))) > ASTRAY_M


def askew(found: Furnished, item: SceneObject) -> bool:
    """Return whether furniture has its back to a wall and is turned from it by more than ``ASKEW_RAD``."""
    wall = against_wall(found, item)
    if wall is None or wall.gap_m >= AT_WALL_M:
        return False
    return abs(math.remainder(item.yaw_rad - found.wall[wall.wall, WALL_YAW], math.tau)) > ASKEW_RAD


def rug_askew(found: Furnished) -> list[int]:
    """Return rugs that are turned from the walls by more than ``RUG_RAD``."""
    quarter = 0.5 * math.pi
    return [
        item.id
        for item in _rugs(found)
        if min(abs(math.remainder(item.yaw_rad - yaw, quarter)) for yaw in found.wall[:, WALL_YAW]) > RUG_RAD
    ]


def bedside_blocked(found: Furnished) -> list[int]:
    """Return nightstands with other things than a bed in more than ``FRONT_SHARE`` of ``BEDSIDE_FRONT_M`` before them."""
    free = found.only(~np.isin(found.owner, [bed.id for bed in found.standing("bed")]))
    return [item.id for item in found.standing("bedside") if taken_share(free, item, "front", 0.02, BEDSIDE_FRONT_M) > FRONT_SHARE]


def hemmed(found: Furnished, item: SceneObject) -> bool:
    """Return whether nobody gets on or off a machine: its front is blocked, or both its sides are."""
    front, left, right = (taken_share(found, item, side, MOUNT_GAP_M, MOUNT_DEPTH_M) for side in ("front", "left", "right"))
    return front > MOUNT_SHARE or min(left, right) > MOUNT_SHARE


def mat_hemmed(found: Furnished) -> list[int]:
    """Return mats for exercise near which, by ``HEMMED_DEPTH_M``, machines or furniture stand, or another mat lies askew."""
    mats = found.standing("floor_work")
    if not mats:
        return []
    standing = found.boxes[(found.boxes[:, Z_HIGH] > OVER_CURB_M) & (found.boxes[:, Z_LOW] < HUNG_M)]
    taken = [mat.id for mat in mats if any(_taken(standing, mat, side) > HEMMED_SHARE for side in ("front", "back", "left", "right"))]
    return sorted({*taken, *(mat.id for mat in mats if any(_askew(mat, other) for other in mats))})


def _askew(mat: SceneObject, other: SceneObject) -> bool:
    """Return whether two mats are near each other and not parallel."""
    apart = -footprint_penetration(whole_box(mat), whole_box(other))
    return abs(math.sin(mat.yaw_rad - other.yaw_rad)) > MAT_ASKEW_RAD and apart < MAT_ASKEW_GAP_M


def _taken(standing: Boxes, mat: SceneObject, side: str) -> float:
    """Return the share of the strip along a side of a mat that boxes (n, 8) take; walls do not count."""
    return float(in_boxes(strip_points(mat, side, HEMMED_GAP_M, HEMMED_DEPTH_M), standing).mean())


def shut_in(found: Furnished, item: SceneObject) -> bool:
    """Return whether the doors of a vehicle open at neither side, things are nearer than ``TOUCHED_M``, or stand in its way out."""
    return _doors_blocked(found, item) or _way_out_blocked(found, item)


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
    group = clusters([whole_box(item) for item in items], HUDDLE_M)
    return [item.id for item, one in zip(items, group, strict=True) if group.count(one) >= HUDDLE]


def front_shut(found: Furnished) -> list[int]:
    """Return what does not open: doors and drawers whose front is blocked to more than ``SHUT_SHARE``, however much else is free."""
    stores = (item for item in found.standing("store") if found.categories[item.category].opens)
    return [item.id for item in stores if taken_share(found, item, "front", OPEN_GAP_M, OPEN_DEPTH_M) > SHUT_SHARE]


def before_front(found: Furnished, item: SceneObject) -> bool:
    """Return whether something stands before the front of a store or appliance."""
    stores = [_strip_before(store) for store in found.standing("store")]
    u, v = np.meshgrid(0.5 * _STEPS, 0.5 * _STEPS)
    points = world_points(item, u * item.size_m[0], v * item.size_m[1])
    return bool(stores) and bool(in_boxes(points, np.array(stores)).mean() > BEFORE_SHARE)


def _strip_before(item: SceneObject) -> Boxes:
    """Return the box (8,) of the floor before the front of a store."""
    box = whole_box(item)
    box[[X, Y]] = world_points(item, np.array([0.5 * (item.size_m[0] + BEFORE_DEPTH_M)]), np.zeros(1))[0]
    box[HALF_DEPTH] = 0.5 * BEFORE_DEPTH_M
    return box
