"""Places for the names of a top view's objects, so that none covers another; where a name has no place, a number stands for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from grammar.drawing.shapes import TEXT_WIDTH, Point
from scene_description import SceneObject

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
