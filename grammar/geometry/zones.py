"""Space that must stay free: before doors, windows and pictures, and where people use furniture."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Boxes
from grammar.geometry.boxes import box_rows
from grammar.geometry.solids import SHEET_M, Size
from grammar.spec.object_rules import Access, ObjectRule
from grammar.spec.room_rules import OpeningRule
from scene_description import Opening, Room
from scene_description.types import Point2

# Everything that hangs touches its wall and everything that blocks access stands on the floor, so these two bound no distance.
_FACE_DEPTH_M = 0.05
_ACCESS_HEIGHT_M = 1.8
_FOOTING_DEPTH_M, _GLARE_DEPTH_M, _APART_M = 0.3, 0.9, 0.2
OPEN_GAP_M, OPEN_DEPTH_M = 0.03, 0.4
"""Nearer to a front is a neighbour that juts out; a door or drawer opens over the depth behind that."""

ACCESS, VIEW, SWING, FACE, GLARE, APART = range(6)
"""Kinds of zones.  ACCESS: space that people need (soft); VIEW: kept free of what stands on the floor; SWING: kept free of everything;
FACE: kept free of what hangs on walls; GLARE: kept free of screens (soft); APART: kept free of what people lounge on and at (soft).
"""


class Zone(NamedTuple):
    """A box in the frame of its object or opening, metres: x, y of its middle, heights, half extents, kind of zone, depth."""

    x: float
    y: float
    z_low: float
    z_high: float
    half_depth: float
    half_width: float
    kind: int
    depth: float


def opening_zones(opening: Opening, rule: OpeningRule) -> list[Zone]:
    """Return what must stay free before an opening; the frame has its origin at the middle of the lower edge, x into the room.

    What a door into the room sweeps is free of rugs too, whose sheets lie below the floor, and nothing hangs where its leaf gets to behind
    it.
    """
    opens_in = opening.category == "door" and opening.swing == "in"
    depth = opening.width_m if opens_in else rule.clear_depth_m
    kind = VIEW if opening.category == "window" else SWING
    half_width, casing = 0.5 * opening.width_m, rule.casing_m
    clear = Zone(0.5 * depth, 0.0, rule.clear_above_sill_m, opening.height_m, 0.5 * depth, half_width, kind, depth)
    half = 0.5 * _FACE_DEPTH_M
    face = Zone(half, 0.0, 0.0, opening.height_m + casing, half, half_width + casing, FACE, _FACE_DEPTH_M)
    if not opens_in:
        return [clear, face]
    return [clear._replace(z_low=-SHEET_M), face, _behind(opening)]


def _behind(opening: Opening) -> Zone:
    """Return where the leaf of a door into the room gets to beyond a right angle."""
    half, hinge = 0.5 * opening.width_m, 1.0 if opening.hinge == "start" else -1.0
    return Zone(half, 2.0 * hinge * half, 0.0, opening.height_m, half, half, FACE, opening.width_m)


def leaf_boxes(polygon_m: Sequence[Point2], opening: Opening) -> list[Boxes]:
    """Return the boxes (8,) that the leaf of a door into the room gets to: up to a right angle, and behind it; of others none."""
    if opening.category != "door" or opening.swing != "in":
        return []
    half = 0.5 * opening.width_m
    swing = Zone(half, 0.0, 0.0, opening.height_m, half, half, SWING, opening.width_m)
    x, y, yaw = frame_in(polygon_m, opening)
    return list(placed_zones([swing, _behind(opening)], x, y, 0.0, yaw))


def face_box(polygon_m: Sequence[Point2], opening: Opening, beside_m: float) -> Boxes:
    """Return the flat box (8,) of an opening's own stretch of wall, and so much to both sides."""
    half = 0.5 * _FACE_DEPTH_M
    x, y, yaw = frame_in(polygon_m, opening)
    zone = Zone(half, 0.0, 0.0, opening.height_m, half, 0.5 * opening.width_m + beside_m, FACE, _FACE_DEPTH_M)
    return np.asarray(placed_zones([zone], x, y, 0.0, yaw)[0])


def object_zones(rule: ObjectRule, size_m: Size, usual: Sequence[Access] = ()) -> list[Zone]:
    """Return the accessible space of an object and what must stay free before it; ``usual``: the access of a rule that names none."""
    zones = []
    for access in rule.access or usual:
        x, y, u, v = side_rectangle(access.side, access.depth_m, size_m)
        zones.append(Zone(x, y, 0.0, _ACCESS_HEIGHT_M, u, v, VIEW if access.side == "over" else ACCESS, access.depth_m))
    if rule.view_depth_m > 0.0:
        x, y, u, v = side_rectangle("front", rule.view_depth_m, size_m)
        zones.append(Zone(x, y, 0.0, size_m[2], u, v, VIEW, rule.view_depth_m))
    return zones


def opening_front(size_m: Size) -> Zone:
    """Return the space that the doors or drawers of an object open into, over its full width but for the edges."""
    half_d, half_w, half = 0.5 * size_m[0], 0.5 * size_m[1] - OPEN_GAP_M, 0.5 * OPEN_DEPTH_M
    return Zone(half_d + OPEN_GAP_M + half, 0.0, 0.0, size_m[2], half, half_w, VIEW, OPEN_DEPTH_M)


def footing_zone(size_m: Size) -> Zone:
    """Return the floor below an object that rugs shall not reach under: it would stand aslant on their edges."""
    return Zone(0.0, 0.0, -SHEET_M, 0.0, 0.5 * size_m[0], 0.5 * size_m[1], ACCESS, _FOOTING_DEPTH_M)


def glare_zone(opening: Opening) -> Zone:
    """Return the space before a window, from the floor to its top, in which a screen has the light behind it."""
    half = 0.5 * _GLARE_DEPTH_M
    return Zone(half, 0.0, -opening.sill_m, opening.height_m, half, 0.5 * opening.width_m, GLARE, _FOOTING_DEPTH_M)


def headroom_zone(size_m: Size, bottom_m: float) -> Zone:
    """Return the space below something deep that hangs: who sits, stands or lies there hits it with the head."""
    return Zone(0.0, 0.0, -bottom_m, 0.0, 0.5 * size_m[0], 0.5 * size_m[1], VIEW, size_m[0])


def apart_zone(size_m: Size) -> Zone:
    """Return the space on and around a table for meals that sofas, armchairs and low tables keep out of."""
    return Zone(0.0, 0.0, 0.0, size_m[2], 0.5 * size_m[0] + _APART_M, 0.5 * size_m[1] + _APART_M, APART, _APART_M)


def side_rectangle(side: str, depth_m: float, size_m: Size) -> tuple[float, float, float, float]:
    """Return x, y, half depth, half width (object's frame) of the strip ``depth_m`` deep along a side of an object (or under, over it)."""
    half_d, half_w, half = 0.5 * size_m[0], 0.5 * size_m[1], 0.5 * depth_m
    return {
        "front": (half_d + half, 0.0, half, half_w),
        "back": (-half_d - half, 0.0, half, half_w),
        "left": (0.0, half_w + half, half_d, half),
        "right": (0.0, -half_w - half, half_d, half),
        "under": (0.0, 0.0, half_d, half_w),
        "over": (0.0, 0.0, half_d, half_w),
    }[side]


def opening_frame(room: Room, opening: Opening) -> tuple[float, float, float]:
    """Return x, y of the middle of an opening on its wall and the yaw of the direction into the room."""
    return frame_in(room.polygon_m, opening)


def frame_in(polygon_m: Sequence[Point2], opening: Opening) -> tuple[float, float, float]:
    """Return :func:`opening_frame` in the room of a floor outline."""
    (ax, ay), (bx, by) = polygon_m[opening.wall], polygon_m[(opening.wall + 1) % len(polygon_m)]
    length = math.hypot(bx - ax, by - ay)
    along = (opening.offset_m + 0.5 * opening.width_m) / length
    return ax + along * (bx - ax), ay + along * (by - ay), math.atan2(bx - ax, ay - by)


def placed_zones(zones: list[Zone], x_m: float, y_m: float, z_m: float, yaw_rad: float) -> Boxes:
    """Return the (n, 8) world boxes of zones whose object or opening has the given pose."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    rows = [
        (x_m + z.x * c - z.y * s, y_m + z.x * s + z.y * c, z_m + z.z_low, z_m + z.z_high, z.half_depth, z.half_width, c, s) for z in zones
    ]
    return box_rows(rows)
