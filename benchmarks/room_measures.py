"""Measures of furnished rooms with one definition for sampled rooms and for real ones of layout files."""

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from shapely import Polygon, union_all
from shapely.geometry.base import BaseGeometry

from grammar.checks.furnished import Furnished, furnished
from grammar.checks.use_of_fixtures import unit_rows_of
from grammar.geometry.boxes import footprint_corners
from grammar.geometry.solids import whole_box
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_rows
from grammar.learning.category_map import CategoryMap
from grammar.learning.layout_fields import UnfitError, read_number, read_openings, read_polygon
from grammar.learning.layout_objects import read_objects
from grammar.learning.observed import ObservedObject, ObservedRoom
from grammar.learning.read_layouts import lines_by_house, with_shared_doors
from grammar.spec.categories import Categories, Category
from scene_description import ModelReference, Opening, Room, SceneObject, Support
from scene_description.types import Point2

AT_WALL_M = 0.4
"""Furniture nearer than this covers a wall."""
NICHE_M = 0.15
"""Outlines lose steps smaller than this, such as those of door jambs, before walls are counted."""
HUNG_M = 0.3
"""What begins higher and stands on nothing hangs."""
ROOM_TYPES = {"livingroom": "living_room", "diningroom": "dining_room", "utility": "storage"}
"""Names of layout files -> ours, where they differ."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomMeasures:
    """Measures of one room: lengths in metres, areas in square metres, ``by_category`` the objects of each category."""

    room_type: str
    area_m2: float
    proportion: float
    walls: int
    covered: float
    bare_wall_m: float
    objects: int
    on_floor: int
    doors: int
    windows: int
    base_units: int
    wall_units: int
    runs: int
    by_category: Mapping[str, int]


MEASURES = {
    "area_m2": "area of the floor, m2",
    "proportion": "short over long side of the bounding rectangle",
    "walls": "walls, steps below 0.15 m left out",
    "covered": "share of the floor below what stands on it",
    "bare_wall_m": "longest stretch of wall without door, window or furniture, m",
    "objects": "objects",
    "on_floor": "objects that stand on the floor",
    "doors": "doors",
    "windows": "windows",
    "base_units": "base units of a kitchen with sink, hob and dishwasher",
    "wall_units": "wall cabinets",
    "runs": "groups of base units that touch",
}
"""Field -> what it is."""


def measure_room(found: Furnished) -> RoomMeasures:
    """Return the measures of a room."""
    outline = _without_niches(found.room.polygon_m)
    xs, ys = zip(*found.room.polygon_m, strict=True)
    sides = sorted((max(xs) - min(xs), max(ys) - min(ys)))
    area = Polygon(found.room.polygon_m).area
    standing = [item for item in found.objects if item.support.kind == "floor" and not found.categories[item.category].underlay]
    feet: BaseGeometry = union_all([Polygon(footprint_corners(whole_box(item))) for item in standing])
    return RoomMeasures(
        room_type=found.room_type,
        area_m2=area,
        proportion=sides[0] / sides[1],
        walls=len(outline),
        covered=feet.intersection(Polygon(found.room.polygon_m)).area / area,
        bare_wall_m=longest_bare_wall_m(found.room, outline, standing),
        objects=len(found.objects),
        on_floor=len(standing),
        doors=sum(opening.category == "door" for opening in found.room.openings),
        windows=sum(opening.category == "window" for opening in found.room.openings),
        base_units=len(found.standing("unit")),
        wall_units=len(found.having("wall_unit")),
        runs=len(unit_rows_of(found)),
        by_category=dict(Counter(item.category for item in found.objects)),
    )


def only(found: Furnished, categories: Collection[str]) -> Furnished:
    """Return a room without what is of other categories."""
    return furnished(found.room_type, found.room, [item for item in found.objects if item.category in categories], found.categories)


def _without_niches(polygon_m: Sequence[Point2]) -> list[Point2]:
    """Return an outline without steps smaller than ``NICHE_M``."""
    points = list(polygon_m)
    middle = np.mean(points, 0)
    first = int(np.argmax(((np.array(points) - middle) ** 2).sum(1)))
    turned = points[first:] + points[:first]
    return [(float(x), float(y)) for x, y in Polygon(turned).simplify(NICHE_M).exterior.coords[:-1]]


def longest_bare_wall_m(room: Room, outline: Sequence[Point2], standing: Sequence[SceneObject]) -> float:
    """Return the longest stretch of a wall before which neither a door, a window nor furniture is.

    Args:
        room: with its openings.
        outline: whose walls count; an opening belongs to the wall that it is nearest to.
        standing: furniture; it covers what is within ``AT_WALL_M`` of it.
    """
    corners = [footprint_corners(whole_box(item)) for item in standing]
    own = wall_rows(room.polygon_m)
    for opening in room.openings:
        row = own[opening.wall]
        ends = row[[START_X, START_Y]] + np.outer([opening.offset_m, opening.offset_m + opening.width_m], row[[ALONG_X, ALONG_Y]])
        corners.append(ends)
    longest = 0.0
    for row in wall_rows(outline):
        taken = []
        for points in corners:
            delta = points - row[[START_X, START_Y]]
            along, into = delta @ row[[ALONG_X, ALONG_Y]], delta @ row[[NORMAL_X, NORMAL_Y]]
            if into.min() < AT_WALL_M and into.max() > -AT_WALL_M:
                taken.append((float(along.min()), float(along.max())))
        reached = 0.0
        for low, high in [*sorted(taken), (float(row[LENGTH]), np.inf)]:
            longest = max(longest, min(low, float(row[LENGTH])) - reached)
            reached = max(reached, high)
    return longest


def real_rooms(path: Path, names: CategoryMap, categories: Categories) -> Iterator[Furnished]:
    """Yield the rooms of a layout file; categories that the table lacks are kept under the file's names.

    Raises:
        OSError: the file cannot be read.
    """
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    houses = lines_by_house(lines)
    for data in lines:
        try:
            polygon, height = read_polygon(data.get("polygon")), read_number(data.get("height"), "room: no height", 1.5, 10.0)
        except UnfitError:
            continue
        room_type = ROOM_TYPES.get(data["room_type"], data["room_type"])
        items, _ = read_objects(data["objects"], _keeping(names, room_type, data["objects"]), room_type, polygon, own=False)
        seen = read_openings(with_shared_doors(data, houses), polygon, [])
        yield as_furnished(
            ObservedRoom(
                id="", house="", room_type=room_type, polygon_m=tuple(polygon), height_m=height, objects=tuple(items), openings=seen
            ),
            categories,
        )


def as_furnished(room: ObservedRoom, categories: Categories) -> Furnished:
    """Return an observed room as the checks and measures of sampled ones need it; categories that the table lacks are plain things."""
    table = {item.category: Category(label="otherprop") for item in room.objects} | dict(categories)
    openings = [
        Opening(
            id=1000 + k, category=kind, label=0, wall=o.wall, offset_m=o.offset_m, sill_m=o.sill_m, width_m=o.width_m,
            height_m=o.height_m, swing="out", model=ModelReference(generator=kind), parts=(),
        )
        for kind, found in room.openings.items()
        for k, o in enumerate(found)
    ]  # fmt: skip
    shell = Room(polygon_m=room.polygon_m, height_m=room.height_m, wall_thickness_m=0.1, openings=tuple(openings), surfaces=())
    return furnished(room.room_type, shell, [_placed(k, item) for k, item in enumerate(room.objects)], table)


def _keeping(names: CategoryMap, room_type: str, objects: Sequence[Mapping[str, object]]) -> CategoryMap:
    """Return a table that leaves nothing out: names that it lacks, or maps to nothing, stand for themselves."""
    named = {str(item.get("cat")): str(item.get("cat")) for item in objects}
    known = {key: value for key, value in names.names.items() if value}
    rooms = {key: value for key, value in names.rooms.get(room_type, {}).items() if value}
    return replace(names, names=named | known, rooms={room_type: rooms}, raw={key: value for key, value in names.raw.items() if value})


def _placed(index: int, item: ObservedObject) -> SceneObject:
    if item.on is not None:
        support = Support(kind="object", id=item.on + 1)
    else:
        support = Support(kind="wall", wall=0) if item.position_m[2] > HUNG_M else Support(kind="floor")
    return SceneObject(
        id=index + 1,
        category=item.category,
        label=0,
        size_m=item.size_m,
        position_m=item.position_m,
        yaw_rad=item.yaw_rad,
        support=support,
        model=ModelReference(generator=item.category),
        parts=(),
    )
