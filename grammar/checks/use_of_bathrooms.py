"""Faults of use in bathrooms: what is out of reach, and fixtures that nobody gets to."""

from __future__ import annotations

import math

import numpy as np

from grammar.checks.furnished import Furnished, back_gap, taken_share, wall_distance, whole_box, world_points
from grammar.geometry.boxes import footprint_penetration
from scene_description import SceneObject

REACH_M = 0.9
MAT_BEFORE_M, MAT_ASIDE_SHARE = 0.55, 0.6
KNEES_SHARE, KNEES_GAP_M, KNEES_DEPTH_M = 0.3, 0.02, 0.35
ELBOW_SHARE, ELBOW_M = 0.5, 0.1
STEP_SHARE, STEP_GAP_M, STEP_DEPTH_M = 0.5, 0.05, 0.35
TOWEL_M = 1.6
CORNER_GAP_M = 0.2
DEEP_M, HEAD_M, OVER_M = 0.25, 2.0, 0.1


def paper_out_of_reach(found: Furnished) -> list[int]:
    """Return paper holders with a toilet in the room, but none within ``REACH_M``, middle to middle."""
    toilets = found.having("toilet")
    return [
        item.id
        for item in found.having("paper")
        if toilets and min(math.dist(item.position_m[:2], toilet.position_m[:2]) for toilet in toilets) > REACH_M
    ]


def towel_out_of_reach(found: Furnished) -> list[int]:
    """Return towel rails of a room with a bath, shower or basin that hang further than ``TOWEL_M`` from all of them."""
    wet = [whole_box(item) for item in found.standing("bathing", "basin")]
    return [item.id for item in found.having("towel") if wet and max(footprint_penetration(whole_box(item), box) for box in wet) < -TOWEL_M]


def mat_astray(found: Furnished) -> list[int]:
    """Return bath mats of a room with a bath, shower or basin that lie before the front of none of them."""
    wet = found.standing("bathing", "basin")
    return [mat.id for mat in found.standing("bath_mat") if wet and not any(_lies_before(mat, item) for item in wet)]


def _lies_before(mat: SceneObject, item: SceneObject) -> bool:
    """Return whether the middle of a mat is before the front of a thing, or beyond a side of it by a bit, and near enough to step on."""
    dx, dy = mat.position_m[0] - item.position_m[0], mat.position_m[1] - item.position_m[1]
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    before = dx * c + dy * s - 0.5 * item.size_m[0]
    return 0.0 < before < MAT_BEFORE_M and abs(dy * c - dx * s) < MAT_ASIDE_SHARE * item.size_m[1]


def toilet_cramped(found: Furnished) -> list[int]:
    """Return toilets with too little room for knees before them, or with more than half of a side at something."""
    return [item.id for item in found.standing("toilet") if _cramped(found, item)]


def _cramped(found: Furnished, item: SceneObject) -> bool:
    knees = taken_share(found, item, "front", KNEES_GAP_M, KNEES_DEPTH_M)
    return knees > KNEES_SHARE or any(taken_share(found, item, side, 0.0, ELBOW_M) > ELBOW_SHARE for side in ("left", "right"))


def fixture_blocked(found: Furnished) -> list[int]:
    """Return baths, showers and basins whose front is blocked to more than ``STEP_SHARE``."""
    wet = found.standing("bathing", "basin")
    return [item.id for item in wet if taken_share(found, item, "front", STEP_GAP_M, STEP_DEPTH_M) > STEP_SHARE]


def bathing_off_corner(found: Furnished) -> list[int]:
    """Return baths and showers that do not stand with the back to a wall and a side to another one."""
    return [item.id for item in found.standing("bathing") if not _in_corner(found, item)]


def _in_corner(found: Furnished, item: SceneObject) -> bool:
    half = 0.5 * item.size_m[1]
    depths = np.array([0.0, 0.3]) * item.size_m[0]
    sides = [wall_distance(found, world_points(item, depths, np.full(2, side * half))) for side in (-1.0, 1.0)]
    return back_gap(found, item) < CORNER_GAP_M and min(sides) < CORNER_GAP_M


def cabinet_overhead(found: Furnished) -> list[int]:
    """Return what hangs lower than ``HEAD_M``, reaches more than ``DEEP_M`` into the room, and is over a toilet, bath, shower or basin."""
    fixtures = [whole_box(item) for item in found.standing("toilet", "bathing", "basin")]
    low = {item.id for item in found.objects if item.support.kind == "wall" and 0.5 < item.position_m[2] < HEAD_M}
    low -= {item.id for item in found.having("wall_unit")}
    hung = [item for item in found.objects if item.id in low and item.size_m[0] > DEEP_M]
    return [item.id for item in hung if any(footprint_penetration(whole_box(item), box) > OVER_M for box in fixtures)]
