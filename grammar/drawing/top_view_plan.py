"""The plan of a top view: its scale and colours, from world metres to pixels, and the outlines of walls and doors."""

from __future__ import annotations

import math
from collections.abc import Sequence

from grammar.drawing.shapes import Point, Shape
from scene_description import Opening, Room

PIXELS_PER_METRE = 120.0
BORDER, TITLE, FOOT, LEGEND_WIDTH = 24.0, 48.0, 24.0, 230.0
LINE_HEIGHT, FONT_SIZE = 16.0, 12.0
INK, PATH, DOOR, SLOPE = "#222222", "#d4145a", "#a0522d", "#4a6fa5"
SLOPE_LINES_M = (1.0, 2.0)
"""Heights of a sloped ceiling whose lines are drawn."""


class Plan:
    """The drawing while it is made: from world metres to pixels, and the shapes so far."""

    def __init__(self, room: Room) -> None:
        leaves = [point for opening in room.openings if opening.category == "door" for point in door_swing(room, opening)]
        xs, ys = zip(*offset_outline(list(room.polygon_m), room.wall_thickness_m), *leaves, strict=True)
        self.low, self.high = (min(xs), min(ys)), (max(xs), max(ys))
        self.width = (self.high[0] - self.low[0]) * PIXELS_PER_METRE + 2.0 * BORDER
        self.height = (self.high[1] - self.low[1]) * PIXELS_PER_METRE + BORDER + TITLE + FOOT
        self.shapes: list[Shape] = []

    def point(self, point: Point) -> Point:
        """Return a point in pixels."""
        x, y = (point[0] - self.low[0]) * PIXELS_PER_METRE, (self.high[1] - point[1]) * PIXELS_PER_METRE
        return BORDER + x, TITLE + y

    def points(self, points: Sequence[Point]) -> list[Point]:
        """Return points in pixels."""
        return [self.point(point) for point in points]


def offset_outline(outline: list[Point], distance_m: float) -> list[Point]:
    """Return the outline moved outwards by the thickness of the walls, corners mitred."""
    moved = []
    for i, (x, y) in enumerate(outline):
        (nx, ny), (mx, my) = (_outward(outline, k) for k in (i - 1, i))
        stretch = distance_m / max(1.0 + nx * mx + ny * my, 0.2)
        moved.append((x + (nx + mx) * stretch, y + (ny + my) * stretch))
    return moved


def _outward(outline: list[Point], wall: int) -> Point:
    (ax, ay), (bx, by) = outline[wall % len(outline)], outline[(wall + 1) % len(outline)]
    length = max(math.hypot(bx - ax, by - ay), 1e-9)
    return (by - ay) / length, (ax - bx) / length


def wall_point(room: Room, opening: Opening, along_m: float, outward_m: float) -> Point:
    """Return the point at a distance along an opening's wall and out of the room."""
    outline = list(room.polygon_m)
    (ax, ay), (nx, ny) = outline[opening.wall], _outward(outline, opening.wall)
    return ax - ny * along_m + nx * outward_m, ay + nx * along_m + ny * outward_m


def door_swing(room: Room, opening: Opening) -> list[Point]:
    """Return the hinge of a door and the arc of its latch from closed to open."""
    near, far = opening.offset_m, opening.offset_m + opening.width_m
    hinge, latch = (near, far) if opening.hinge == "start" else (far, near)
    side, edge = (-1.0, 0.0) if opening.swing == "in" else (1.0, room.wall_thickness_m)
    angles = [0.5 * math.pi * k / 12 for k in range(13)]
    arc = [(hinge + (latch - hinge) * math.cos(a), edge + side * opening.width_m * math.sin(a)) for a in angles]
    return [wall_point(room, opening, *point) for point in ((hinge, edge), *arc)]
