"""Faults of use about doors, windows and what hangs: switches, pictures, rugs, things before windows."""

from __future__ import annotations

import math

import numpy as np

from grammar.checks.furnished import Furnished, behind_doors, in_boxes, swept_points, whole_box, world_points
from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, Z_HIGH, Z_LOW, X, Y
from grammar.geometry.zones import opening_frame

HIDDEN_SHARE, HIDDEN_DEPTH_M = 0.25, 0.6
WINDOW_SHARE, WINDOW_DEPTH_M = 0.15, 0.5
_GRID = 12


def switch_behind_door(found: Furnished) -> list[int]:
    """Return light switches on the hinge side of a door into the room, where the open door covers them."""
    return [item.id for item in found.having("switch") if bool(behind_doors(found.room, np.array([item.position_m[:2]]))[0])]


def shown_behind_door(found: Furnished) -> list[int]:
    """Return what hangs to be seen and is half or more behind an open door."""
    along = np.linspace(-0.45, 0.45, 7)
    bad = []
    for item in found.having("shown"):
        points = world_points(item, np.full(7, 0.5 * item.size_m[0]), along * item.size_m[1])
        if behind_doors(found.room, points).mean() >= 0.5:
            bad.append(item.id)
    return bad


def shown_hidden(found: Furnished) -> list[int]:
    """Return what hangs to be seen and is covered to more than ``HIDDEN_SHARE`` by things up to ``HIDDEN_DEPTH_M`` before it."""
    bad = []
    for item in found.having("shown"):
        if item.support.kind in ("wall", "floor"):
            x, y = world_points(item, np.array([0.5 * item.size_m[0]]), np.zeros(1))[0]
            boxes = found.boxes[found.owner != item.id]
            low, high = item.position_m[2], item.position_m[2] + item.size_m[2]
            if _covered(boxes, (x, y, item.yaw_rad), item.size_m[1], (low, high), HIDDEN_DEPTH_M).any(0).mean() > HIDDEN_SHARE:
                bad.append(item.id)
    return bad


def before_window(found: Furnished) -> list[int]:
    """Return things other than curtains and radiators that cover more than ``WINDOW_SHARE`` of a window."""
    draped = {item.id for item in found.having("drape")} | {item.id for item in found.objects if item.support.kind == "ceiling"}
    bad: set[int] = set()
    keep = ~np.isin(found.owner, list(draped))
    boxes, owner = found.boxes[keep], found.owner[keep]
    for opening in found.room.openings:
        if opening.category == "window" and len(boxes):
            heights = (opening.sill_m, opening.sill_m + opening.height_m)
            covered = _covered(boxes, opening_frame(found.room, opening), opening.width_m, heights, WINDOW_DEPTH_M)
            bad.update(int(key) for key in np.unique(owner) if covered[owner == key].any(0).mean() > WINDOW_SHARE)
    return sorted(bad)


def rug_in_swing(found: Furnished) -> list[int]:
    """Return rugs and mats that lie where a door into the room swings."""
    flat = [item for item in found.objects if found.categories[item.category].underlay and item.support.kind == "floor"]
    swept = list(swept_points(found.room))
    return [item.id for item in flat if any(in_boxes(points, whole_box(item)[None]).any() for points in swept)]


def _covered(boxes: Boxes, frame: tuple[float, float, float], width_m: float, heights_m: tuple[float, float], depth_m: float) -> Floats:
    """Return (m, n) which of a grid of points of an upright face each box stands before, within a depth.

    Args:
        boxes: (m, 8) in the world.
        frame: x, y of the face's middle and the yaw of the direction that it looks in.
        width_m: of the face.
        heights_m: of its lower and upper edge.
        depth_m: how far before it boxes count.
    """
    c, s = math.cos(frame[2]), math.sin(frame[2])
    dx, dy = boxes[:, X] - frame[0], boxes[:, Y] - frame[1]
    turn_c = np.abs(boxes[:, COS_YAW] * c + boxes[:, SIN_YAW] * s)
    turn_s = np.abs(boxes[:, SIN_YAW] * c - boxes[:, COS_YAW] * s)
    half_into = boxes[:, HALF_DEPTH] * turn_c + boxes[:, HALF_WIDTH] * turn_s
    half_along = boxes[:, HALF_DEPTH] * turn_s + boxes[:, HALF_WIDTH] * turn_c
    into, left = dx * c + dy * s, dy * c - dx * s
    before = (into + half_into > 0.0) & (into - half_into < depth_m)
    along = ((np.arange(_GRID) + 0.5) / _GRID - 0.5) * width_m
    up = heights_m[0] + (np.arange(_GRID) + 0.5) / _GRID * (heights_m[1] - heights_m[0])
    a, z = (grid.ravel() for grid in np.meshgrid(along, up))
    inside = (np.abs(a - left[:, None]) < half_along[:, None]) & (z > boxes[:, Z_LOW, None]) & (z < boxes[:, Z_HIGH, None])
    return np.asarray(inside & before[:, None])
