"""The plan of a top view: scale and colours, world metres to pixels, outlines of walls and doors, places for names that cover no other."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from grammar.drawing.shapes import TEXT_WIDTH, Point, Shape
from scene_description import Opening, Room, SceneObject

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


_SIZES = (13.0, 12.0, 11.0)
_NUMBER_SIZE = 11.5
_SHARES = (0.0, -0.25, 0.25, -0.36, 0.36)
_GAP = 1.5

Box = tuple[float, float, float, float]


class Label(NamedTuple):
    """A text about ``point`` (pixels) for an object; ``numbered``: it is the object's id, not its name."""

    object_id: int
    text: str
    point: Point
    size: float
    numbered: bool


def label_objects(objects: Sequence[SceneObject], outline: Mapping[int, Sequence[Point]]) -> list[Label]:
    """Return the labels of all objects.

    Args:
        objects: in the order in which they are painted.
        outline: object id -> corners in pixels.
    """
    boxes = {item.id: _bounds(outline[item.id]) for item in objects}
    above = {item.id: [boxes[other.id] for other in objects[k + 1 :] if other.support.kind != "ceiling"] for k, item in enumerate(objects)}
    taken: list[Box] = []
    labels = []
    for item in sorted(objects, key=lambda item: (-item.size_m[0] * item.size_m[1], item.id)):
        label = _name(item, boxes[item.id], above[item.id], taken) or _number(item, boxes[item.id], taken)
        taken.append(_text_box(label.text, label.point, label.size))
        labels.append(label)
    return sorted(labels, key=lambda label: label.object_id)


def _bounds(points: Sequence[Point]) -> Box:
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def _text_box(text: str, point: Point, size: float) -> Box:
    half = 0.5 * TEXT_WIDTH * size * len(text) + _GAP
    return point[0] - half, point[1] - 0.5 * size - _GAP, point[0] + half, point[1] + 0.5 * size + _GAP


def _overlap(a: Box, b: Box) -> float:
    return max(min(a[2], b[2]) - max(a[0], b[0]), 0.0) * max(min(a[3], b[3]) - max(a[1], b[1]), 0.0)


def _name(item: SceneObject, box: Box, above: Sequence[Box], taken: Sequence[Box]) -> Label | None:
    """Return the object's name at the place within the object's bounds where it hides least of higher objects, or None if none is free."""
    text, best, least = item.category.replace("_", " "), None, 0.0
    width, height = box[2] - box[0], box[3] - box[1]
    for size in _SIZES:
        for down in _SHARES:
            for right in _SHARES:
                point = (0.5 * (box[0] + box[2]) + right * width, 0.5 * (box[1] + box[3]) + down * height)
                cover = _text_box(text, point, size)
                fits = cover[0] >= box[0] - 4.0 and cover[2] <= box[2] + 4.0 and cover[1] >= box[1] - 4.0 and cover[3] <= box[3] + 4.0
                if not fits or any(_overlap(cover, other) for other in taken):
                    continue
                cost = sum(_overlap(cover, other) for other in above) + 40.0 * (abs(down) + abs(right)) + 30.0 * (_SIZES[0] - size)
                if best is None or cost < least:
                    best, least = Label(item.id, text, point, size, False), cost
    return best


def _number(item: SceneObject, box: Box, taken: Sequence[Box]) -> Label:
    """Return the object's id at its middle, or at the place around it that hides least of other labels."""
    middle, text = (0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])), str(item.id)
    steps = [(0.0, 0.0), *((dx, dy) for r in (9.0, 14.0, 20.0) for dx in (0.0, -r, r) for dy in (0.0, -r, r) if dx or dy)]
    points = [(middle[0] + dx, middle[1] + dy) for dx, dy in steps]

    def hidden(point: Point) -> float:
        return sum(_overlap(_text_box(text, point, _NUMBER_SIZE), other) for other in taken)

    return Label(item.id, text, min(points, key=hidden), _NUMBER_SIZE, True)
