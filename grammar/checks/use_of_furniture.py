"""Faults of use about furniture: blocked fronts, backs that stand free of walls, what stands on mats or free on the floor."""

from __future__ import annotations

import math

import numpy as np

from grammar.checks.furnished import Furnished, against_wall, back_gap, in_boxes, taken_share, wall_distance, whole_box, world_points
from grammar.geometry.boxes import Z_LOW, footprint_corners, footprint_penetration
from grammar.geometry.walls import WALL_YAW
from grammar.spec.categories import BACK_GAP_M
from scene_description import SceneObject

VIEW_RAD = math.radians(60.0)
FRONT_SHARE, FRONT_GAP_M, FRONT_DEPTH_M = 0.5, 0.05, 0.35
BEDSIDE_M, BEDSIDE_FRONT_M = 0.3, 0.25
BEFORE_MIRROR_M = 0.8
MAT_SHARE, KNEE_HIGH_M, ASTRAY_M = 0.15, 0.3, 0.4
UNDER_M = 0.05
DOORS_M, DOORS_SHARE = 0.45, 0.2
AT_WALL_M, ASKEW_RAD, RUG_RAD, ON_RUG_M = 0.5, math.radians(1.2), math.radians(1.5), 0.08


def front_blocked(found: Furnished) -> list[int]:
    """Return stores and appliances whose front is blocked to more than ``FRONT_SHARE``."""
    return [item.id for item in found.standing("store") if taken_share(found, item, "front", FRONT_GAP_M, FRONT_DEPTH_M) > FRONT_SHARE]


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


def wardrobe_off_wall(found: Furnished) -> list[int]:
    """Return wardrobes with no wall behind their backs."""
    return [item.id for item in found.standing("wardrobe") if back_gap(found, item) > BACK_GAP_M["wardrobe"]]


def bed_off_wall(found: Furnished) -> list[int]:
    """Return beds whose head is not at a wall."""
    return [item.id for item in found.standing("bed") if back_gap(found, item) > BACK_GAP_M["bed"]]


def back_off_wall(found: Furnished) -> list[int]:
    """Return what else belongs with its back to a wall and has none behind it."""
    return [item.id for item in found.standing("backed") if back_gap(found, item) > BACK_GAP_M["backed"]]


def fridge_off_wall(found: Furnished) -> list[int]:
    """Return refrigerators with no wall behind their backs."""
    return [item.id for item in found.standing("fridge") if back_gap(found, item) > BACK_GAP_M["fridge"]]


def bedside_astray(found: Furnished) -> list[int]:
    """Return nightstands further than ``BEDSIDE_M`` from any bed of a room that has one."""
    beds = [whole_box(item) for item in found.standing("bed")]
    stands = found.standing("bedside")
    return [item.id for item in stands if beds and max(footprint_penetration(whole_box(item), bed) for bed in beds) < -BEDSIDE_M]


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
    """Return the room (0) if it is a bathroom without bath and shower."""
    return [0] if found.room_type == "bathroom" and not found.having("bathing") else []


def stands_on_mat(found: Furnished) -> list[int]:
    """Return mats for feet or exercise of which things on the floor take more than ``MAT_SHARE``."""
    steps = (np.arange(8) + 0.5) / 8.0 - 0.5
    u, v = np.meshgrid(steps, steps)
    bad = []
    for item in found.standing("mat"):
        low = found.boxes[(found.boxes[:, Z_LOW] < KNEE_HIGH_M) & (found.owner != item.id)]
        if in_boxes(world_points(item, u * item.size_m[0], v * item.size_m[1]), low).mean() > MAT_SHARE:
            bad.append(item.id)
    return bad


def _rugs(found: Furnished) -> list[SceneObject]:
    return [item for item in found.objects if found.categories[item.category].underlay and item.support.kind == "floor"]


def pot_on_rug_edge(found: Furnished) -> list[int]:
    """Return plants and vases that stand on a rug with a part of their foot only."""
    rugs = [whole_box(item) for item in _rugs(found)]
    bad = []
    for item in found.standing("pot") if rugs else []:
        box = whole_box(item)
        deepest = max(footprint_penetration(box, rug) for rug in rugs)
        if 0.02 < deepest and not in_boxes(footprint_corners(box), np.array(rugs)).all():
            bad.append(item.id)
    return bad


def stands_astray(found: Furnished) -> list[int]:
    """Return plants, vases, bins and lamps that stand free on the floor, further than ``ASTRAY_M`` from walls and furniture."""
    furniture = [item for item in found.objects if item.support.kind == "floor" and not found.categories[item.category].underlay]
    bad = []
    for item in found.standing("filler"):
        box = whole_box(item)
        near = any(footprint_penetration(box, whole_box(other)) > -ASTRAY_M for other in furniture if other is not item)
        if not near and wall_distance(found, footprint_corners(box)) > ASTRAY_M:
            bad.append(item.id)
    return bad


def pot_under_table(found: Furnished) -> list[int]:
    """Return plants and vases that stand below a table."""
    tables = [whole_box(item) for item in found.standing("table")]
    pots = found.standing("pot")
    return [item.id for item in pots if any(footprint_penetration(whole_box(item), table) > UNDER_M for table in tables)]


def wardrobe_shut(found: Furnished) -> list[int]:
    """Return wardrobes whose doors do not open: what stands before them takes more than ``DOORS_SHARE`` of ``DOORS_M``."""
    return [item.id for item in found.standing("wardrobe") if taken_share(found, item, "front", 0.02, DOORS_M) > DOORS_SHARE]


def askew(found: Furnished) -> list[int]:
    """Return beds and stores with their backs to a wall and turned from it by more than ``ASKEW_RAD``."""
    bad = []
    for item in found.standing("bed", "store"):
        wall = against_wall(found, item)
        turned = 0.0 if wall is None else abs(math.remainder(item.yaw_rad - found.wall[wall.wall, WALL_YAW], math.tau))
        if wall is not None and wall.gap_m < AT_WALL_M and turned > ASKEW_RAD:
            bad.append(item.id)
    return bad


def rug_askew(found: Furnished) -> list[int]:
    """Return rugs that are turned from the walls by more than ``RUG_RAD``."""
    quarter = 0.5 * math.pi
    return [
        item.id
        for item in _rugs(found)
        if min(abs(math.remainder(item.yaw_rad - yaw, quarter)) for yaw in found.wall[:, WALL_YAW]) > RUG_RAD
    ]


def store_on_rug_edge(found: Furnished) -> list[int]:
    """Return stores that stand on a rug with a part of their foot only, by ``ON_RUG_M`` and more."""
    rugs = [whole_box(item) for item in _rugs(found)]
    bad = []
    for item in found.standing("store") if rugs else []:
        box = whole_box(item)
        if max(footprint_penetration(box, rug) for rug in rugs) > ON_RUG_M and not in_boxes(footprint_corners(box), np.array(rugs)).all():
            bad.append(item.id)
    return bad


def bedside_blocked(found: Furnished) -> list[int]:
    """Return nightstands with other things than a bed in more than ``FRONT_SHARE`` of ``BEDSIDE_FRONT_M`` before them."""
    free = found.only(~np.isin(found.owner, [bed.id for bed in found.standing("bed")]))
    return [item.id for item in found.standing("bedside") if taken_share(free, item, "front", 0.02, BEDSIDE_FRONT_M) > FRONT_SHARE]
