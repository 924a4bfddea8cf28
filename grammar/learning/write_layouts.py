"""Our own layout format: from scene descriptions to observed rooms, and those to lines of JSON."""

import json

from grammar.geometry.walls import ALONG_X, ALONG_Y, START_X, START_Y, wall_rows
from grammar.learning.observed import ObservedObject, ObservedOpening, ObservedRoom
from grammar.learning.read_layouts import LAYOUT_SCHEMA
from scene_description import SceneDescription
from scene_description.types import Room, SceneObject


def layout_from_scene(scene: SceneDescription) -> ObservedRoom:
    """Return the layout of a scene, so that one can learn from sampled or edited rooms."""
    return layout_from_objects(scene.id, scene.category, scene.room, scene.objects)


def layout_from_objects(identifier: str, room_type: str, room: Room, objects: tuple[SceneObject, ...]) -> ObservedRoom:
    """Return the layout of a room and its objects; every room is a house of its own."""
    index = {item.id: i for i, item in enumerate(objects)}
    return ObservedRoom(
        id=identifier,
        house=identifier,
        room_type=room_type,
        polygon_m=room.polygon_m,
        height_m=room.height_m,
        objects=tuple(
            ObservedObject(
                category=item.category,
                size_m=item.size_m,
                position_m=item.position_m,
                yaw_rad=item.yaw_rad,
                on=index.get(item.support.id) if item.support.kind == "object" and item.support.id is not None else None,
            )
            for item in objects
        ),
        openings={
            kind: tuple(
                ObservedOpening(wall=o.wall, offset_m=o.offset_m, width_m=o.width_m, height_m=o.height_m, sill_m=o.sill_m)
                for o in room.openings
                if o.category == kind
            )
            for kind in ("door", "window")
        },
    )


def layout_line(room: ObservedRoom) -> str:
    """Return a room as one line of JSON, without the line's end."""
    objects = []
    for item in room.objects:
        entry = {"category": item.category, "size_m": item.size_m, "position_m": item.position_m, "yaw_rad": item.yaw_rad}
        objects.append(entry if item.on is None else entry | {"on": item.on})
    document = {
        "schema": LAYOUT_SCHEMA,
        "id": room.id,
        "house": room.house,
        "room_type": room.room_type,
        "polygon_m": room.polygon_m,
        "height_m": room.height_m,
        "objects": objects,
    } | {f"{kind}s": [_box(kind, opening, room) for opening in found] for kind, found in room.openings.items()}
    return json.dumps(document, allow_nan=False)


def _box(kind: str, opening: ObservedOpening, room: ObservedRoom) -> list[str | float]:
    """Return an opening as its kind and the lower and upper corner of the flat box that it fills in the wall's plane."""
    wall = wall_rows(room.polygon_m)[opening.wall]
    ends = [
        (wall[START_X] + wall[ALONG_X] * along, wall[START_Y] + wall[ALONG_Y] * along)
        for along in (opening.offset_m, opening.offset_m + opening.width_m)
    ]
    low, high = [min(pair) for pair in zip(*ends, strict=True)], [max(pair) for pair in zip(*ends, strict=True)]
    return [kind, *map(float, low), opening.sill_m, *map(float, high), opening.sill_m + opening.height_m]
