"""A labelled drawing of a room from above, as SVG text: walls, doors and their swing, windows, furniture and its front, the camera's path.

North is up: x grows to the right, y upwards.  Objects have the display colours of their NYU40 classes; what stands higher covers what is
below it.
"""

from __future__ import annotations

import math
from xml.sax.saxutils import escape, quoteattr

from scene_description import NYU40, Opening, Room, SceneDescription, SceneObject
from scene_description.poses import rotation_from_quaternion

PIXELS_PER_METRE = 120.0
_MARGIN_M = 0.35
_TITLE_M = 0.3

Point = tuple[float, float]


class _Drawing:
    """Collects SVG elements; takes world metres, writes pixels with two decimals."""

    def __init__(self, low: Point, high: Point) -> None:
        self._low, self._high = low, high
        self._lines: list[str] = []

    def add(self, name: str, text: str = "", /, **attributes: object) -> None:
        listed = "".join(f" {key.replace('_', '-')}={quoteattr(str(value))}" for key, value in attributes.items())
        self._lines.append(f"<{name}{listed}>{escape(text)}</{name}>" if text else f"<{name}{listed}/>")

    def at(self, point: Point) -> str:
        return f"{(point[0] - self._low[0]) * PIXELS_PER_METRE:.2f},{(self._high[1] - point[1]) * PIXELS_PER_METRE:.2f}"

    def polygon(self, points: list[Point], **attributes: object) -> None:
        self.add("polygon", points=" ".join(map(self.at, points)), **attributes)

    def line(self, points: list[Point], **attributes: object) -> None:
        self.add("polyline", points=" ".join(map(self.at, points)), fill="none", **attributes)

    def text(self, point: Point, text: str, size_m: float, **attributes: object) -> None:
        x, y = self.at(point).split(",")
        self.add("text", text, x=x, y=y, font_size=f"{size_m * PIXELS_PER_METRE:.2f}", **attributes)

    def svg(self) -> str:
        width, height = ((high - low) * PIXELS_PER_METRE for low, high in zip(self._low, self._high, strict=True))
        head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.2f} {height:.2f}"'
        style = 'font-family="sans-serif" text-anchor="middle" dominant-baseline="central" stroke-linejoin="round"'
        return "\n".join([f"{head} {style}>", '<rect width="100%" height="100%" fill="#ffffff"/>', *self._lines, "</svg>", ""])


def top_view_svg(scene: SceneDescription) -> str:
    """Return the drawing of a room as SVG text; the same scene gives the same text."""
    border = _MARGIN_M + scene.room.wall_thickness_m
    xs, ys = zip(*scene.room.polygon_m, strict=True)
    drawing = _Drawing((min(xs) - border, min(ys) - border), (max(xs) + border, max(ys) + border + _TITLE_M))
    _draw_room(drawing, scene.room)
    objects = sorted(scene.objects, key=lambda thing: (thing.support.kind == "ceiling", thing.position_m[2] + thing.size_m[2], thing.id))
    for thing in objects:
        _draw_object(drawing, thing)
    _draw_camera_path(drawing, scene)
    carriers = {thing.support.id for thing in objects}
    for thing in objects:
        _draw_label(drawing, thing, thing.id in carriers)
    verdict = "valid" if scene.validity.valid else "NOT VALID"
    title = f"{scene.category} {scene.index}, seed {scene.seed}: {len(scene.objects)} objects, {verdict}"
    drawing.text((0.5 * (min(xs) + max(xs)), max(ys) + border + 0.02), title, 0.13, fill="#222222")
    return drawing.svg()


def _draw_room(drawing: _Drawing, room: Room) -> None:
    outline = list(room.polygon_m)
    drawing.polygon(_offset_outline(outline, room.wall_thickness_m), fill="#6b6b6b")
    drawing.polygon(outline, fill="#f4f0e8", stroke="#333333", stroke_width=1)
    for opening in room.openings:
        _draw_opening(drawing, room, opening)


def _offset_outline(outline: list[Point], distance_m: float) -> list[Point]:
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


def _draw_opening(drawing: _Drawing, room: Room, opening: Opening) -> None:
    outline = list(room.polygon_m)
    (ax, ay), (nx, ny) = outline[opening.wall], _outward(outline, opening.wall)
    tx, ty = -ny, nx
    t = room.wall_thickness_m

    def place(along_m: float, outward_m: float) -> Point:
        return ax + tx * along_m + nx * outward_m, ay + ty * along_m + ny * outward_m

    near, far = opening.offset_m, opening.offset_m + opening.width_m
    gap = [place(near, 0.0), place(far, 0.0), place(far, t), place(near, t)]
    drawing.polygon(gap, fill="#bfe0f2" if opening.category == "window" else "#ffffff", stroke="#333333", stroke_width=1)
    if opening.category == "window":
        drawing.line([place(near, 0.5 * t), place(far, 0.5 * t)], stroke="#3a7ca5", stroke_width=2)
        return
    hinge, latch = (near, far) if opening.hinge == "start" else (far, near)
    side = -1.0 if opening.swing == "in" else 1.0
    edge = 0.0 if opening.swing == "in" else t
    arc = []
    for k in range(13):
        angle = 0.5 * math.pi * k / 12
        arc.append(place(hinge + (latch - hinge) * math.cos(angle), edge + side * opening.width_m * math.sin(angle)))
    drawing.line(arc, stroke="#a0522d", stroke_width=1.2, stroke_dasharray="4 3")
    drawing.line([place(hinge, edge), arc[-1]], stroke="#a0522d", stroke_width=3)


def _draw_object(drawing: _Drawing, thing: SceneObject) -> None:
    depth, width, _ = thing.size_m
    color = "#{:02x}{:02x}{:02x}".format(*NYU40[thing.label].color)
    hangs = thing.support.kind == "ceiling"
    corners = [_in_world(thing, u * 0.5 * depth, v * 0.5 * width) for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    dash = {"stroke_dasharray": "5 4"} if hangs else {}
    drawing.polygon(corners, fill=color, fill_opacity=0.12 if hangs else 0.8, stroke="#222222", stroke_width=1, **dash)
    tip, back, half = 0.46 * depth, 0.46 * depth - min(0.1, 0.3 * depth), min(0.08, 0.2 * width)
    arrow = [_in_world(thing, tip, 0.0), _in_world(thing, back, half), _in_world(thing, back, -half)]
    drawing.polygon(arrow, fill="#222222", fill_opacity=0.7)


def _draw_label(drawing: _Drawing, thing: SceneObject, carries: bool) -> None:
    size = min(max(1.5 * max(thing.size_m[:2]) / len(thing.category), 0.045), 0.1)
    halo = {"stroke": "#ffffff", "stroke_width": 2.5, "paint_order": "stroke", "fill": "#111111"}
    below_m = 0.4 * min(thing.size_m[:2]) if carries else 0.0  # what it carries has its own label in the middle
    drawing.text((thing.position_m[0], thing.position_m[1] - below_m), thing.category.replace("_", " "), size, **halo)


def _draw_camera_path(drawing: _Drawing, scene: SceneDescription) -> None:
    points = [(pose.position_m[0], pose.position_m[1]) for pose in scene.camera_path]
    drawing.line(points, stroke="#d4145a", stroke_width=2.5)
    for i, pose in enumerate(scene.camera_path):
        forward = rotation_from_quaternion(pose.orientation)[:, 2]
        x, y = points[i]
        ends = i in (0, len(points) - 1)
        reach, width = (0.3, 1.5) if ends else (0.15, 0.8)
        drawing.line([(x, y), (x + reach * float(forward[0]), y + reach * float(forward[1]))], stroke="#d4145a", stroke_width=width)
    for name, point in (("end", points[-1]), ("start", points[0])):
        cx, cy = drawing.at(point).split(",")
        drawing.add("circle", cx=cx, cy=cy, r=5, fill="#d4145a" if name == "start" else "#ffffff", stroke="#d4145a", stroke_width=2)


def _in_world(thing: SceneObject, forward_m: float, left_m: float) -> Point:
    c, s = math.cos(thing.yaw_rad), math.sin(thing.yaw_rad)
    return thing.position_m[0] + forward_m * c - left_m * s, thing.position_m[1] + forward_m * s + left_m * c
