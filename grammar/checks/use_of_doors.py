"""Faults of use about doors, windows and what hangs: switches, pictures, hooks, rugs, things before windows."""

import math

import numpy as np

from grammar.checks.furnished import Furnished, behind_doors, covered, face_covered, in_boxes, swept_points, world_points
from grammar.geometry.solids import whole_box
from grammar.geometry.zones import opening_frame
from scene_description import SceneObject

HIDDEN_SHARE, HIDDEN_DEPTH_M = 0.25, 0.6
WINDOW_SHARE, WINDOW_DEPTH_M = 0.15, 0.5
AT_WINDOW_SHARE = 0.15
DOORWAY_M, DOORWAY_SHARE = 0.6, 0.05
CURTAIN_OFF_M = 0.12


def switch_behind_door(found: Furnished) -> list[int]:
    """Return light switches on the hinge side of a door into the room, where the open door covers them."""
    return [item.id for item in found.having("switch") if bool(behind_doors(found.room, np.array([item.position_m[:2]]))[0])]


def behind_door(found: Furnished, item: SceneObject) -> bool:
    """Return whether something that hangs is half or more behind an open door."""
    along = np.linspace(-0.45, 0.45, 7)
    points = world_points(item, np.full(7, 0.5 * item.size_m[0]), along * item.size_m[1])
    return bool(behind_doors(found.room, points).mean() >= 0.5)


def shown_hidden(found: Furnished) -> list[int]:
    """Return what hangs to be seen and is covered to more than ``HIDDEN_SHARE`` by things up to ``HIDDEN_DEPTH_M`` before it."""
    hidden = covered(HIDDEN_DEPTH_M, HIDDEN_SHARE)
    return [item.id for item in found.having("shown") if item.support.kind in ("wall", "floor") and hidden(found, item)]


def thing_in_doorway(found: Furnished) -> list[int]:
    """Return tables for meals, plants, bins, lamps and the like that stand within ``DOORWAY_M`` before a door: one walks into them."""
    u, v = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.45, 0.45, 5), np.linspace(-0.45, 0.45, 5)))
    ways = []
    for opening in found.room.openings:
        if opening.category == "door":
            x, y, yaw = opening_frame(found.room, opening)
            middle = x + 0.5 * DOORWAY_M * math.cos(yaw), y + 0.5 * DOORWAY_M * math.sin(yaw)
            ways.append((*middle, 0.0, 1.0, 0.5 * DOORWAY_M, 0.5 * opening.width_m, math.cos(yaw), math.sin(yaw)))
    things = found.standing("filler", "dining") if ways else []
    points = [world_points(item, u * item.size_m[0], v * item.size_m[1]) for item in things]
    return [item.id for item, at in zip(things, points, strict=True) if in_boxes(at, np.array(ways)).mean() > DOORWAY_SHARE]


def before_window(found: Furnished) -> list[int]:
    """Return things other than curtains and radiators that cover more than ``WINDOW_SHARE`` of a window."""
    draped = {item.id for item in found.having("drape")} | {item.id for item in found.objects if item.support.kind == "ceiling"}
    bad: set[int] = set()
    keep = ~np.isin(found.owner, list(draped))
    boxes, owner = found.boxes[keep], found.owner[keep]
    for opening in found.room.openings:
        if opening.category == "window" and len(boxes):
            heights = (opening.sill_m, opening.sill_m + opening.height_m)
            hidden = face_covered(boxes, opening_frame(found.room, opening), opening.width_m, heights, WINDOW_DEPTH_M)
            bad.update(int(key) for key in np.unique(owner) if hidden[owner == key].any(0).mean() > WINDOW_SHARE)
    return sorted(bad)


def door_in_corner(found: Furnished) -> list[int]:
    """Return sofas into whose corner a door opens: it sweeps their box, though none of their solids."""
    swept = list(swept_points(found.room))
    return [item.id for item in found.standing("lounge") if any(in_boxes(points, whole_box(item)[None]).any() for points in swept)]


def at_window(found: Furnished, item: SceneObject) -> bool:
    """Return whether something hangs above or below a window with more than ``AT_WINDOW_SHARE`` of its width."""
    for opening in found.room.openings:
        if item.support.kind == "wall" and opening.category == "window" and opening.wall == item.support.wall:
            x, y, yaw = opening_frame(found.room, opening)
            left = (item.position_m[1] - y) * math.cos(yaw) - (item.position_m[0] - x) * math.sin(yaw)
            if 0.5 * (item.size_m[1] + opening.width_m) - abs(left) > AT_WINDOW_SHARE * item.size_m[1]:
                return True
    return False


def curtain_off_window(found: Furnished) -> list[int]:
    """Return curtains whose middle is further than ``CURTAIN_OFF_M`` from that of every window in their wall."""
    bad = []
    for item in found.having("curtain"):
        windows = [opening for opening in found.room.openings if opening.category == "window" and opening.wall == item.support.wall]
        frames = [opening_frame(found.room, opening) for opening in windows]
        if not any(math.hypot(item.position_m[0] - x, item.position_m[1] - y) < CURTAIN_OFF_M + item.size_m[0] for x, y, _ in frames):
            bad.append(item.id)
    return bad


def rug_in_swing(found: Furnished) -> list[int]:
    """Return rugs and mats that lie where a door into the room swings."""
    flat = [item for item in found.objects if found.categories[item.category].underlay and item.support.kind == "floor"]
    swept = list(swept_points(found.room))
    return [item.id for item in flat if any(in_boxes(points, whole_box(item)[None]).any() for points in swept)]
