"""Where a camera stands, at places of a hand-made bedroom that are known to be in the air, in matter, or outside."""

from dataclasses import replace

import pytest
from box_room import box, scene
from sample_scene import sample_scene

from renderer.core.embree import EmbreeScene
from renderer.scene.flat_scene import FlatScene
from renderer.scene.flatten import flatten
from renderer.standpoint import standpoint
from scene_description import SceneDescription

ROOM = sample_scene()
FLAT = flatten(ROOM)


def place(position_m: tuple[float, float, float], description: SceneDescription = ROOM, flat: FlatScene = FLAT) -> str:
    with EmbreeScene(flat.mesh.vertices, flat.mesh.faces) as tree:
        return standpoint(tree.handle, flat, description, position_m)


@pytest.mark.parametrize(
    ("position_m", "expected"),
    [
        ((3.5, 0.6, 1.5), ""),
        ((3.99, 3.49, 0.01), ""),  # a corner of the room
        ((1.9, 3.45, 1.5), ""),  # before the window
        ((3.25, -0.13, 1.0), ""),  # in the hole of the door
        ((1.0, 1.8, 0.8), ""),  # a hand above the bed
        ((2.0, -0.07, 1.3), "inside the room's wall"),
        ((2.0, 1.0, 2.65), "inside the room's ceiling"),
        ((2.0, 0.5, -0.05), "inside the room's floor"),
        ((1.4, 1.8, 0.42), "inside object 3 (bed)"),
        ((2.0, -0.2, 1.3), "outside the room"),
        ((2.0, 1.0, 3.0), "outside the room"),
        ((2.0, 1.0, -0.5), "outside the room"),
        ((-9.0, 40.0, 1.0), "outside the room"),
    ],
)
def test_places_of_a_bedroom(position_m: tuple[float, float, float], expected: str) -> None:
    assert place(position_m) == expected


def test_an_alcove_of_an_outline_that_is_not_convex_is_outside() -> None:
    corner = replace(ROOM.room, polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 1.5), (2.0, 1.5), (2.0, 3.5), (0.0, 3.5)), openings=())
    described = replace(ROOM, room=corner, objects=(), lights=())
    flat = flatten(described)
    assert place((3.0, 2.5, 1.0), described, flat) == "outside the room"
    assert place((1.0, 2.5, 1.0), described, flat) == place((3.0, 1.0, 1.0), described, flat) == ""


def test_a_closed_cupboard_has_an_inside_and_a_scanned_room_is_one() -> None:
    """Fronts all around: of a thing of 0.2 m3 the camera is inside, one of the room's size is the room."""
    shell = scene(box((1.0, 1.0, 0.0), (1.5, 1.5, 0.8), inside=True, object_id=3))
    described = replace(ROOM, objects=(replace(ROOM.objects[0], category="wardrobe", size_m=(0.5, 0.5, 0.8)),), lights=())
    assert place((1.2, 1.2, 0.4), described, shell) == "inside object 3 (wardrobe)"
    scanned = scene(box((0.1, 0.1, 0.0), (3.9, 3.4, 2.5), inside=True, object_id=3))
    described = replace(described, objects=(replace(described.objects[0], size_m=(3.8, 3.3, 2.5)),))
    assert place((1.2, 1.2, 0.4), described, scanned) == ""


def test_an_open_scene_of_the_users_own_raises_no_alarm() -> None:
    """A floor and a box below an open sky: most directions meet nothing."""
    flat = scene(box((-1, -1, -0.1), (5, 5, 0.0), object_id=0), box((2, 2, 0), (3, 3, 1), object_id=3))
    assert place((1.0, 1.0, 1.5), flat=flat) == ""
