"""A room of boxes as description and flat scene, for tests of what is told of objects: every mesh fills its oriented box exactly."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from box_room import Piece, box, scene
from sample_scene import FLOOR, sample_scene

from renderer import CameraConfig, FlatScene, Frame, RenderConfig, Renderer
from renderer.annotations import Annotator
from scene_description import CameraPose, ModelReference, SceneDescription, SceneObject, Support
from scene_description.label_standards import StandardName
from scene_description.poses import quaternion_from_yaw, rotation_from_quaternion

ROOM = box((-5, -5, 0), (5, 5, 4), inside=True, name="0/shell", object_id=0)


def crate(
    key: int,
    at: tuple[float, float, float],
    size: tuple[float, float, float],
    yaw: float = 0.0,
    label: int = 29,
    support: Support = FLOOR,
    group: int | None = None,
) -> SceneObject:
    """A box, by the centre of its lower face."""
    return SceneObject(
        id=key, category=f"crate_{key}", label=label, size_m=size, position_m=at, yaw_rad=yaw, support=support, group=group,
        model=ModelReference(generator="box"), parts=(),
    )  # fmt: skip


def crates_scene(objects: Sequence[SceneObject]) -> tuple[SceneDescription, FlatScene]:
    """The boxes in a bare room of 10 x 10 x 4 m with its middle at the origin."""
    pieces: list[Piece] = [ROOM]
    for thing in objects:
        half = 0.5 * np.array(thing.size_m)
        piece = box(-half, half, name=f"{thing.id}/box", object_id=thing.id, label=thing.label)
        turn = rotation_from_quaternion(quaternion_from_yaw(thing.yaw_rad))
        pieces.append(piece._replace(vertices=piece.vertices @ turn.T + thing.position_m + (0.0, 0.0, half[2])))
    description = sample_scene()
    room = dataclasses.replace(description.room, openings=())
    return dataclasses.replace(description, room=room, objects=tuple(objects), lights=()), scene(*pieces)


def annotated(
    objects: Sequence[SceneObject],
    view: CameraPose,
    camera: CameraConfig | None = None,
    *,
    masks: bool = False,
    path: Sequence[CameraPose] = (),
    threads: int = 2,
    classes: StandardName = "nyu40",
) -> Frame:
    """A frame of the boxes: its instance image, and what is told of it."""
    camera = camera or CameraConfig(width=640, height=480)
    description, flat = crates_scene(objects)
    with (
        Renderer(flat, camera, RenderConfig(threads=threads), 0) as renderer,
        Annotator(flat, description, camera, masks=masks, classes=classes) as annotator,
    ):
        return renderer.render(view, 0, ("instance",), path=path, annotator=annotator)
