"""A room from above as plain numbers, world metres: what the page's script draws, and the table of objects beside it."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from nav_msgs.msg import OccupancyGrid
from PIL import Image as Picture

from grammar.drawing.shapes import Point
from grammar.drawing.top_view import fill_color
from grammar.drawing.top_view_plan import SLOPE_LINES_M, door_swing, label_objects, offset_outline, wall_point
from scene_description import NYU40, Opening, Room, SceneDescription, SceneObject
from scene_description.ceilings import height_lines_m
from scene_description.polygons import signed_area_m2
from scene_description.poses import rotation_from_quaternion
from scene_synth_ros.cli.page.page_images import PageImageError
from scene_synth_ros.pages.document import data_uri

PIXELS_PER_METRE = 90.0
"""For the layout of names only."""
MAX_CELLS = 4_000_000
_HEIGHTS = ("floor", "wall", "object", "ceiling")
_CELL_COLORS = {0: (70, 160, 90, 70), 100: (0, 0, 0, 0), -1: (0, 0, 0, 0)}


def room_plan(scene: SceneDescription) -> dict[str, Any]:
    """Return the outlines of a room: walls, floor, openings, swings of doors, boxes of objects in the order of painting, names, path.

    Of a sloped ceiling also the lines along which it is 1 and 2 m high.
    """
    room = scene.room
    walls = offset_outline(list(room.polygon_m), room.wall_thickness_m)
    swings = [door_swing(room, opening) for opening in room.openings if opening.category == "door"]
    xs, ys = zip(*walls, *(point for swing in swings for point in swing), strict=True)
    things = sorted(scene.objects, key=lambda item: (_HEIGHTS.index(item.support.kind), item.position_m[2] + item.size_m[2], item.id))
    corners = {item.id: _corners(item) for item in things}
    sheet = {key: [(x * PIXELS_PER_METRE, -y * PIXELS_PER_METRE) for x, y in points] for key, points in corners.items()}
    return {
        "view": [_short(value) for value in (min(xs), min(ys), max(xs), max(ys))],
        "walls": _points(walls),
        "floor": _points(room.polygon_m),
        "openings": [{"id": item.id, "window": item.category == "window", "points": _points(_gap(room, item))} for item in room.openings],
        "swings": [_points(swing) for swing in swings],
        "slopes": [_points(ends) for height_m in SLOPE_LINES_M for ends in height_lines_m(room, height_m)],
        "objects": [
            {"id": item.id, "kind": item.support.kind, "color": fill_color(item), "points": _points(corners[item.id])} for item in things
        ],
        "names": [
            {
                "x": _short(label.point[0] / PIXELS_PER_METRE),
                "y": _short(-label.point[1] / PIXELS_PER_METRE),
                "size": _short(label.size / PIXELS_PER_METRE),
                "text": label.text,
            }
            for label in label_objects(things, sheet)
        ],
        "path": _points((x, y) for x, y, _ in (pose.position_m for pose in scene.camera_path)),
    }


def object_rows(scene: SceneDescription) -> list[dict[str, Any]]:
    """Return a row for each opening and object: id, category, class, what it stands on, size and position in metres."""
    room, names = scene.room, {item.id: item.category for item in scene.objects}
    rows = []
    for opening in room.openings:
        size_m = (room.wall_thickness_m, opening.width_m, opening.height_m)
        rows.append(_row(opening, f"wall {opening.wall}", size_m, (*_middle(room, opening), opening.sill_m)))
    for item in scene.objects:
        on = f"{names[item.support.id]} {item.support.id}" if item.support.id in names else item.support.kind
        rows.append(_row(item, on, item.size_m, item.position_m))
    return rows


def _row(item: Opening | SceneObject, on: str, size_m: Sequence[float], position_m: Sequence[float]) -> dict[str, Any]:
    size, position = ([_short(value) for value in values] for values in (size_m, position_m))
    return {"id": item.id, "category": item.category, "class": NYU40[item.label].name, "on": on, "size": size, "position": position}


def room_facts(scene: SceneDescription) -> list[tuple[str, str]]:
    """Return what is told of a room in a line: name -> text."""
    failed = [check.name for check in scene.validity.checks if not check.passed]
    return [
        ("type", scene.category.replace("_", " ")),
        ("index", str(scene.index)),
        ("seed", str(scene.seed)),
        ("floor", f"{signed_area_m2(scene.room.polygon_m):.1f} m², {scene.room.height_m:.2f} m high{_eaves(scene.room)}"),
        ("objects", str(len(scene.objects))),
        ("validity", "valid" if scene.validity.valid else f"not valid: {', '.join(failed)}"),
        ("layout energy", f"{scene.parse_graph.energy:.3f}"),
    ]


def _eaves(room: Room) -> str:
    """Return how low a sloped ceiling gets, as a text to go on with; nothing of a flat one."""
    return f", {min(slope.eaves_height_m for slope in room.slopes):.2f} m at the eaves" if room.slopes else ""


def map_picture(grid: OccupancyGrid) -> dict[str, Any]:
    """Return an occupancy grid as a picture, free floor tinted, and its rectangle in the world.

    Raises:
        PageImageError: its numbers of rows, columns and cells do not agree, or its place is not finite.
    """
    width, height, cells = grid.info.width, grid.info.height, np.frombuffer(grid.data, np.int8)
    place = (grid.info.origin.position.x, grid.info.origin.position.y, grid.info.resolution)
    if width * height != cells.size or not 0 < cells.size <= MAX_CELLS:
        raise PageImageError(f"map: expected {width} x {height} cells, at most {MAX_CELLS}, got {cells.size}")
    if not all(map(math.isfinite, place)) or place[2] <= 0.0:
        raise PageImageError(f"map: expected a finite origin and a resolution above 0, got {place}")
    colors = np.zeros((256, 4), np.uint8)
    for value, color in _CELL_COLORS.items():
        colors[value % 256] = color
    rows = np.flipud(cells.view(np.uint8).reshape(height, width))
    x, y, step = place
    return {
        "picture": data_uri(Picture.fromarray(colors[rows])),
        "rectangle": [_short(value) for value in (x, y, x + width * step, y + height * step)],
    }


def camera_pose(position: tuple[float, float, float], orientation: tuple[float, float, float, float]) -> dict[str, Any] | None:
    """Return position (metres) and the rows of the rotation world <- optical frame; None if they are no pose."""
    values = (*position, *orientation)
    if not all(map(math.isfinite, values)) or abs(math.hypot(*orientation) - 1.0) > 0.01:
        return None
    rotation = rotation_from_quaternion(orientation)
    return {"position": [round(value, 5) for value in position], "rotation": [[round(float(v), 6) for v in row] for row in rotation]}


def _gap(room: Room, item: Opening) -> list[Point]:
    near, far, t = item.offset_m, item.offset_m + item.width_m, room.wall_thickness_m
    return [wall_point(room, item, *point) for point in ((near, 0.0), (far, 0.0), (far, t), (near, t))]


def _middle(room: Room, item: Opening) -> Point:
    return wall_point(room, item, item.offset_m + 0.5 * item.width_m, 0.5 * room.wall_thickness_m)


def _corners(item: SceneObject) -> list[Point]:
    (depth, width, _), c, s = item.size_m, math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    x, y, _ = item.position_m
    ends = [(0.5 * u * depth, 0.5 * v * width) for u, v in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    return [(x + a * c - b * s, y + a * s + b * c) for a, b in ends]


def _points(points: Iterable[Point]) -> list[list[float]]:
    return [[_short(x), _short(y)] for x, y in points]


def _short(value: float) -> float:
    return round(float(value), 4)
