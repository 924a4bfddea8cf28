"""A labelled drawing of a room from above: walls, doors and their swing, windows, furniture and its front, groups, the camera's path.

North is up: x grows to the right, y upwards.  Objects have the display colours of their NYU40 classes, paler when they stand on something,
and are dashed when they hang from the ceiling; dashed lines across the floor tell where a sloped ceiling is 1 and 2 m high.  What is higher
covers what is below it, and supported objects cover all that stand on the floor.  Objects of one functional group have outlines of one
colour.  Where a name does not fit, the object's id stands in its place, and the legend explains it.
"""

import math
from collections.abc import Sequence

from grammar.drawing.shapes import Drawing, Point, area, dot, line, words
from grammar.drawing.top_view_plan import (
    BORDER,
    DOOR,
    FONT_SIZE,
    INK,
    LEGEND_WIDTH,
    LINE_HEIGHT,
    PATH,
    PIXELS_PER_METRE,
    SLOPE,
    SLOPE_LINES_M,
    TITLE,
    Label,
    Plan,
    door_swing,
    label_objects,
    offset_outline,
    wall_point,
)
from scene_description import NYU40, Opening, Room, SceneDescription, SceneObject
from scene_description.ceilings import height_lines_m
from scene_description.poses import rotation_from_quaternion

_WALL, _FLOOR = "#6b6b6b", "#f4f0e8"
_LAYERS = ("floor", "wall", "object", "ceiling")


def top_view(scene: SceneDescription) -> Drawing:
    """Return the drawing of a room; the same scene gives the same drawing."""
    plan = Plan(scene.room)
    _draw_room(plan, scene.room)
    color = group_colors(scene)
    objects = sorted(scene.objects, key=lambda item: (_LAYERS.index(item.support.kind), item.position_m[2] + item.size_m[2], item.id))
    for item in objects:
        _draw_object(plan, item, color.get(item.id))
    _draw_camera_path(plan, scene)
    labels = label_objects(objects, {item.id: plan.points(_corners(item)) for item in objects})
    plan.shapes.extend(words(label.point, label.text, label.size, fill="#111111", halo=True) for label in labels)
    verdict = "valid" if scene.validity.valid else "NOT VALID"
    title = f"{scene.category.replace('_', ' ')} {scene.index}, seed {scene.seed}: {len(scene.objects)} objects, {verdict}"
    plan.shapes.append(words((0.5 * plan.width, 0.5 * TITLE), title, 16.0))
    _draw_scale(plan)
    bottom = draw_legend(plan, scene, color, labels)
    return Drawing(width=plan.width + LEGEND_WIDTH, height=max(plan.height, bottom + 20.0), shapes=tuple(plan.shapes))


def _draw_room(plan: Plan, room: Room) -> None:
    outline = list(room.polygon_m)
    plan.shapes.append(area(plan.points(offset_outline(outline, room.wall_thickness_m)), _WALL))
    plan.shapes.append(area(plan.points(outline), _FLOOR, stroke="#333333"))
    for height_m in SLOPE_LINES_M:
        plan.shapes.extend(line(plan.points(ends), SLOPE, 1.6, (9.0, 5.0)) for ends in height_lines_m(room, height_m))
    for opening in room.openings:
        _draw_opening(plan, room, opening)


def _draw_opening(plan: Plan, room: Room, opening: Opening) -> None:
    near, far, t = opening.offset_m, opening.offset_m + opening.width_m, room.wall_thickness_m
    gap = [wall_point(room, opening, *point) for point in ((near, 0.0), (far, 0.0), (far, t), (near, t))]
    window = opening.category == "window"
    plan.shapes.append(area(plan.points(gap), "#bfe0f2" if window else "#ffffff", stroke="#333333"))
    if window:
        glass = [wall_point(room, opening, along, 0.5 * t) for along in (near, far)]
        plan.shapes.append(line(plan.points(glass), "#3a7ca5", 2.0))
        return
    if opening.category == "garage_door":
        leaf = [wall_point(room, opening, along, 0.5 * t) for along in (near, far)]
        plan.shapes.append(line(plan.points(leaf), DOOR, 3.0))
        return
    hinge, *arc = plan.points(door_swing(room, opening))
    plan.shapes.append(line(arc, DOOR, 1.2, (4.0, 3.0)))
    plan.shapes.append(line([hinge, arc[-1]], DOOR, 3.0))


def _corners(item: SceneObject) -> list[Point]:
    depth, width, _ = item.size_m
    return [_in_world(item, u * 0.5 * depth, v * 0.5 * width) for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1))]


def _draw_object(plan: Plan, item: SceneObject, group: str | None) -> None:
    depth, width, _ = item.size_m
    corners, stroke, thickness = plan.points(_corners(item)), group or INK, 2.2 if group else 1.0
    if item.support.kind == "ceiling":
        plan.shapes.append(area(corners, "#ffe9a8", opacity=0.25))
        plan.shapes.append(line([*corners, corners[0]], stroke, thickness, (5.0, 4.0)))
        return
    carried = item.support.kind == "object"
    plan.shapes.append(area(corners, fill_color(item), opacity=0.92, stroke=stroke, width=0.7 * thickness if carried else thickness))
    if min(depth, width) >= 0.12 or (item.support.kind == "wall" and width >= 0.3):
        tip, back, half = 0.46 * depth, 0.46 * depth - min(0.1, 0.4 * depth), min(0.08, 0.2 * width)
        arrow = [_in_world(item, tip, 0.0), _in_world(item, back, half), _in_world(item, back, -half)]
        plan.shapes.append(area(plan.points(arrow), INK, opacity=0.75))


def fill_color(item: SceneObject) -> str:
    """Return the colour of an object: that of its class, paler for supported objects."""
    pale = 0.5 if item.support.kind == "object" else 0.0
    return "#{:02x}{:02x}{:02x}".format(*(round(c + pale * (255 - c)) for c in NYU40[item.label].color))


def _in_world(item: SceneObject, forward_m: float, left_m: float) -> Point:
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    return item.position_m[0] + forward_m * c - left_m * s, item.position_m[1] + forward_m * s + left_m * c


def _draw_camera_path(plan: Plan, scene: SceneDescription) -> None:
    points = [(pose.position_m[0], pose.position_m[1]) for pose in scene.camera_path]
    plan.shapes.append(line(plan.points(points), PATH, 2.0))
    for i, pose in enumerate(scene.camera_path):
        forward = rotation_from_quaternion(pose.orientation)[:, 2]
        x, y = points[i]
        ends = i in (0, len(points) - 1)
        reach, width = (0.3, 1.5) if ends else (0.15, 0.8)
        plan.shapes.append(line(plan.points([(x, y), (x + reach * float(forward[0]), y + reach * float(forward[1]))]), PATH, width))
    for fill, point in (("#ffffff", points[-1]), (PATH, points[0])):
        plan.shapes.append(dot(plan.point(point), 5.0, fill, PATH, 2.0))


def _draw_scale(plan: Plan) -> None:
    """Draw a bar of one metre with a mark every decimetre."""
    x, y = BORDER, plan.height - 20.0
    for k in range(10):
        shade = "#333333" if k % 2 == 0 else "#ffffff"
        left, right = x + 0.1 * k * PIXELS_PER_METRE, x + 0.1 * (k + 1) * PIXELS_PER_METRE
        plan.shapes.append(area([(left, y - 4), (right, y - 4), (right, y + 4), (left, y + 4)], shade, stroke="#333333", width=0.8))
    plan.shapes.append(words((x + PIXELS_PER_METRE + 10.0, y), "1 m", FONT_SIZE, anchor="start"))


_GROUP_COLORS = ("#c0392b", "#1f6fb4", "#2a8f45", "#8e44ad", "#d2791a", "#0f8b8d", "#b5338a", "#6b6f1d")


def _roots(scene: SceneDescription) -> dict[int, int]:
    """Return for every object of a functional group the id of the group's outermost core, an object or an opening."""
    core = {item.id: item.group for item in scene.objects}
    roots = {}
    for item in scene.objects:
        root = item.id
        while (above := core.get(root)) is not None:
            root = above
        roots[item.id] = root
    gathered = {root for key, root in roots.items() if key != root}
    return {key: root for key, root in roots.items() if root in gathered}


def group_colors(scene: SceneDescription) -> dict[int, str]:
    """Return object id -> colour of its functional group, for objects of groups."""
    roots = _roots(scene)
    order = {root: k for k, root in enumerate(sorted(set(roots.values())))}
    return {key: _GROUP_COLORS[order[root] % len(_GROUP_COLORS)] for key, root in roots.items()}


def draw_legend(plan: Plan, scene: SceneDescription, color: dict[int, str], labels: Sequence[Label]) -> float:
    """Draw groups, numbers and signs to the right of the plan; return the y of the last line in pixels."""
    x, y = plan.width + 4.0, TITLE + 10.0
    name = {item.id: item.category.replace("_", " ") for item in scene.objects} | {
        opening.id: opening.category for opening in scene.room.openings
    }
    rows = _group_rows(scene, name, color)
    if rows:
        plan.shapes.append(words((x, y), "groups", FONT_SIZE, fill="#666666", anchor="start"))
    for shown, text in rows:
        y += LINE_HEIGHT
        if shown:
            plan.shapes.append(area([(x + 1, y - 5), (x + 11, y - 5), (x + 11, y + 5), (x + 1, y + 5)], "#ffffff", stroke=shown, width=2.2))
        plan.shapes.append(words((x + 18, y), text, FONT_SIZE, anchor="start"))
    numbered = [f"{label.text} {name[label.object_id]}" for label in labels if label.numbered]
    if numbered:
        y += 1.6 * LINE_HEIGHT
        plan.shapes.append(words((x, y), "numbers", FONT_SIZE, fill="#666666", anchor="start"))
    for text in numbered:
        y += LINE_HEIGHT
        plan.shapes.append(words((x, y), text, FONT_SIZE, anchor="start"))
    return _draw_signs(plan, x, y + 1.6 * LINE_HEIGHT, sloped=scene.room.slopes is not None)


def _group_rows(scene: SceneDescription, name: dict[int, str], color: dict[int, str]) -> list[tuple[str, str]]:
    """Return the lines of the legend about functional groups: the group's colour, empty from the second line on, and the text."""
    roots = _roots(scene)
    rows: list[tuple[str, str]] = []
    for root in sorted(set(roots.values())):
        members = [name[key] for key in sorted(roots) if roots[key] == root and key != root]
        shown = next(color[key] for key in roots if roots[key] == root)
        lines = _wrap(f"{name[root]}: {', '.join(members)}", 34)
        rows.extend((shown if k == 0 else "", text) for k, text in enumerate(lines))
    return rows


def _draw_signs(plan: Plan, x: float, y: float, *, sloped: bool) -> float:
    plan.shapes.append(words((x, y), "signs", FONT_SIZE, fill="#666666", anchor="start"))
    front = area([(x + 11, y + 16), (x + 2, y + 11), (x + 2, y + 21)], INK, opacity=0.75)
    pale = area(_square(x, y + 27), "#dddddd", stroke=INK, width=0.7)
    hangs = line([*_square(x, y + 43), (x, y + 43)], INK, 1.0, (4.0, 3.0))
    door = line([(x, y + 64), (x + 12, y + 64)], DOOR, 3.0)
    path = (line([(x, y + 80), (x + 12, y + 80)], PATH, 2.0), dot((x, y + 80), 4.0, PATH))
    slope = line([(x, y + 96), (x + 14, y + 96)], SLOPE, 1.6, (5.0, 3.0))
    signs = [
        ((front,), "front"),
        ((pale,), "paler: stands on something"),
        ((hangs,), "hangs from the ceiling"),
        ((door,), "door leaf, open"),
        (path, "camera's path from its start"),
        *([((slope,), f"ceiling {' and '.join(f'{height:g}' for height in SLOPE_LINES_M)} m high")] if sloped else []),
    ]
    for shapes, text in signs:
        y += LINE_HEIGHT
        plan.shapes.extend(shapes)
        plan.shapes.append(words((x + 18, y), text, FONT_SIZE, anchor="start"))
    return y


def _square(x: float, y: float) -> list[Point]:
    return [(x, y), (x + 12, y), (x + 12, y + 10), (x, y + 10)]


def _wrap(text: str, most: int) -> list[str]:
    lines = [""]
    for word in text.split(" "):
        if lines[-1] and len(lines[-1]) + 1 + len(word) > most:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines
