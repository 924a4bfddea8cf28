"""Faults of use of what is built in: bathroom fixtures out of reach or hemmed in, gaps in rows of kitchen units, what a room lacks."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from grammar.checks.furnished import Against, Furnished, against_wall, back_gap, clusters, taken_share, wall_distance, world_points
from grammar.geometry.boxes import footprint_penetration
from grammar.geometry.solids import whole_box
from grammar.geometry.walls import ALONG_X, ALONG_Y, NORMAL_X, NORMAL_Y, START_X, START_Y
from grammar.spec.categories import BACK_GAP_M, SIDE_GAP_M
from scene_description import SceneObject

REACH_M = 0.9
MAT_BEFORE_M, MAT_ASIDE_SHARE = 0.55, 0.6
KNEES_SHARE, KNEES_GAP_M, KNEES_DEPTH_M = 0.3, 0.02, 0.35
ELBOW_SHARE, ELBOW_M = 0.5, 0.1
SLACK_M = 0.01
DEEP_M, HEAD_M, OVER_M = 0.25, 2.0, 0.1
TOUCHING_M = 0.05
GAP_LOW_M, GAP_HIGH_M = 0.03, 0.35
AT_WALL_M = 0.3
HOOD_OFF_M = 0.1


def paper_out_of_reach(found: Furnished) -> list[int]:
    """Return paper holders with a toilet in the room, but none within ``REACH_M``, middle to middle."""
    toilets = found.having("toilet")
    return [
        item.id
        for item in found.having("paper")
        if toilets and min(math.dist(item.position_m[:2], toilet.position_m[:2]) for toilet in toilets) > REACH_M
    ]


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


def cramped(found: Furnished, item: SceneObject) -> bool:
    """Return whether a toilet has too little room for knees before it, or more than half of a side at something."""
    knees = taken_share(found, item, "front", KNEES_GAP_M, KNEES_DEPTH_M)
    return knees > KNEES_SHARE or any(taken_share(found, item, side, 0.0, ELBOW_M) > ELBOW_SHARE for side in ("left", "right"))


def off_corner(found: Furnished, item: SceneObject) -> bool:
    """Return whether a bath or shower does not stand with the back to a wall and a side to another one."""
    half = 0.5 * item.size_m[1]
    depths = np.array([0.0, 0.3]) * item.size_m[0]
    sides = [wall_distance(found, world_points(item, depths, np.full(2, side * half))) for side in (-1.0, 1.0)]
    return back_gap(found, item) > BACK_GAP_M["bathing"] + SLACK_M or min(sides) > SIDE_GAP_M["bathing"] + SLACK_M


def cabinet_overhead(found: Furnished) -> list[int]:
    """Return what hangs lower than ``HEAD_M``, reaches more than ``DEEP_M`` into the room, and is over a toilet, bath, shower or basin."""
    fixtures = [whole_box(item) for item in found.standing("toilet", "bathing", "basin")]
    low = {item.id for item in found.objects if item.support.kind == "wall" and 0.5 < item.position_m[2] < HEAD_M}
    low -= {item.id for item in found.having("wall_unit")}
    hung = [item for item in found.objects if item.id in low and item.size_m[0] > DEEP_M]
    return [item.id for item in hung if any(footprint_penetration(whole_box(item), box) > OVER_M for box in fixtures)]


def unit_rows_of(found: Furnished) -> list[tuple[SceneObject, ...]]:
    """Return the groups of base units that stand within ``TOUCHING_M`` of one another, tall units between them counted as links."""
    units = found.standing("unit", "fridge")
    group = clusters([whole_box(item) for item in units], TOUCHING_M)
    members = [tuple(unit for unit, key in zip(units, group, strict=True) if key == name) for name in dict.fromkeys(group)]
    fridges = {item.id for item in found.having("fridge")}
    return [row for row in members if any(unit.id not in fridges for unit in row)]


def gap_in_run(found: Furnished) -> list[int]:
    """Return base units with a gap of ``GAP_LOW_M`` to ``GAP_HIGH_M`` to their neighbour at the same wall that nothing fills."""
    bad = []
    for wall in range(len(found.wall)):
        row = sorted(_at_wall(found, found.standing("unit", "fridge"), wall), key=lambda pair: pair[1].low_m)
        for (_, left), (item, right) in itertools.pairwise(row):
            if GAP_LOW_M < right.low_m - left.high_m <= GAP_HIGH_M and not _filled(found, wall, left.high_m, right.low_m):
                bad.append(item.id)
    return bad


def run_in_pieces(found: Furnished) -> list[int]:
    """Return the first unit of every further run at a wall that has one already with no door between them, and of runs of one unit."""
    rows, bad = unit_rows_of(found), set()
    for wall in range(len(found.wall)):
        here = [[at for _, at in _at_wall(found, row, wall)] for row in rows]
        spans = sorted((min(at.low_m for at in ats), max(at.high_m for at in ats), k) for k, ats in enumerate(here) if ats)
        for (_, end, _), (begin, _, k) in itertools.pairwise(spans):
            if not _door_between(found, wall, end, begin):
                bad.add(rows[k][0].id)
    if len(rows) > 1:
        bad |= {row[0].id for row in rows if len(row) == 1 and max(row[0].size_m[:2]) < 0.9}
    return sorted(bad)


def _at_wall(found: Furnished, units: Sequence[SceneObject], wall: int) -> list[tuple[SceneObject, Against]]:
    pairs = ((item, against_wall(found, item)) for item in units)
    return [(item, at) for item, at in pairs if at is not None and at.wall == wall and at.gap_m < AT_WALL_M]


def _filled(found: Furnished, wall: int, low_m: float, high_m: float) -> bool:
    """Return whether something that stands at a wall reaches into a stretch of it for more than half."""
    row, covered = found.wall[wall], 0.0
    for item in found.objects:
        if item.support.kind == "floor" and not found.categories[item.category].underlay:
            dx, dy = item.position_m[0] - row[START_X], item.position_m[1] - row[START_Y]
            turn = item.yaw_rad - math.atan2(row[NORMAL_Y], row[NORMAL_X])
            half_into = 0.5 * (item.size_m[0] * abs(math.cos(turn)) + item.size_m[1] * abs(math.sin(turn)))
            half = 0.5 * (item.size_m[1] * abs(math.cos(turn)) + item.size_m[0] * abs(math.sin(turn)))
            if dx * row[NORMAL_X] + dy * row[NORMAL_Y] - half_into < AT_WALL_M:
                along = dx * row[ALONG_X] + dy * row[ALONG_Y]
                covered += max(min(along + half, high_m) - max(along - half, low_m), 0.0)
    return covered > 0.5 * (high_m - low_m)


def _door_between(found: Furnished, wall: int, low_m: float, high_m: float) -> bool:
    return any(
        opening.wall == wall and opening.category == "door" and low_m - 0.1 <= opening.offset_m + 0.5 * opening.width_m <= high_m + 0.1
        for opening in found.room.openings
    )


def kitchen_lacks(found: Furnished) -> list[int]:
    """Return the room (0) if it needs a sink or a hob and has none."""
    return found.lacking("sink", "hob")


def hood_off_hob(found: Furnished) -> list[int]:
    """Return hoods whose middle is further than ``HOOD_OFF_M`` along the wall from that of any hob."""
    hobs, bad = found.having("hob"), []
    for item in found.having("hood"):
        c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
        offsets = [
            (abs((hob.position_m[1] - item.position_m[1]) * c - (hob.position_m[0] - item.position_m[0]) * s),
             (hob.position_m[0] - item.position_m[0]) * c + (hob.position_m[1] - item.position_m[1]) * s)
            for hob in hobs
        ]  # fmt: skip
        if not any(along <= HOOD_OFF_M and abs(into) < 1.0 for along, into in offsets):
            bad.append(item.id)
    return bad


def no_vehicle_door(found: Furnished) -> list[int]:
    """Return the room (0) if it needs a door that a car fits through and has none."""
    widest = max((opening.width_m for opening in found.room.openings if opening.category != "window"), default=0.0)
    return [0] if widest < found.needs.door_m else []
