"""What annotations know of a scene before any frame: the box of each object and opening, and how they are joined."""

import math
from typing import NamedTuple

import numpy as np

from renderer.annotations.object_meshes import ObjectMeshes
from renderer.core.arrays import Array
from renderer.scene.object_boxes import opening_extent
from scene_description import Opening, SceneDescription, SceneObject
from scene_description.annotations import OrientedBox, Relation
from scene_description.label_standards import LabelStandard
from scene_description.poses import Quaternion, conjugate_quaternion, multiply_quaternions, quaternion_from_yaw, rotation_from_quaternion
from scene_description.products import matmul
from scene_description.types import CameraPose

_MICROMETRES = 6
_SIGNS = np.array([(x, y, z) for z in (-1.0, 1.0) for x, y in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))])
"""Corners of a box of edge 2, in the order of ``ObjectAnnotation.corners``."""


class Thing(NamedTuple):
    """An object or an opening: its category, its class with its name, its box in the world, and its relations."""

    category: str
    label: int
    label_name: str
    box: OrientedBox
    relations: tuple[Relation, ...]


def things_of(scene: SceneDescription, meshes: ObjectMeshes, classes: LabelStandard) -> dict[int, Thing]:
    """Return all objects and openings that have triangles, by id.

    An object's box is that of the description.  The description tells an opening's width and height only, so its box is the tightest
    around its triangles whose front looks into the room.
    """
    found: dict[int, Thing] = {}
    there: list[Opening | SceneObject] = [*scene.room.openings, *scene.objects]
    for thing in there:
        if thing.id in meshes.ids:
            box = _opening_box(scene, thing, meshes) if isinstance(thing, Opening) else _object_box(thing)
            label = classes.class_of(thing.category, thing.label)
            found[thing.id] = Thing(thing.category, label, classes.classes[label].name, box, _relations(thing))
    return found


def corners_m(box: OrientedBox) -> Array:
    """Return the corners (8, 3) of a box, float64, in the frame that it is told in."""
    corners: Array = matmul(_SIGNS * (0.5 * np.asarray(box.size_m)), rotation_from_quaternion(box.orientation).T) + box.center_m
    return corners


def seen_from(box: OrientedBox, pose: CameraPose) -> OrientedBox:
    """Return a box of the world in the optical frame at a pose."""
    rotation = rotation_from_quaternion(pose.orientation)
    center = matmul(np.asarray(box.center_m) - pose.position_m, rotation)
    return _box(center, np.asarray(box.size_m), multiply_quaternions(conjugate_quaternion(pose.orientation), box.orientation))


def _object_box(thing: SceneObject) -> OrientedBox:
    x, y, z = thing.position_m
    return _box(np.array([x, y, z + 0.5 * thing.size_m[2]]), np.asarray(thing.size_m), quaternion_from_yaw(thing.yaw_rad))


def _opening_box(scene: SceneDescription, opening: Opening, meshes: ObjectMeshes) -> OrientedBox:
    axes, low, size = opening_extent(scene.room, opening, meshes.mesh(opening.id).vertices.astype(np.float64))
    return _box(matmul(low + 0.5 * size, axes), size, quaternion_from_yaw(math.atan2(axes[0, 1], axes[0, 0])))


def _box(center: Array, size: Array, orientation: Quaternion) -> OrientedBox:
    x, y, z = (round(float(value), _MICROMETRES) for value in center)
    depth, width, height = (round(float(value), _MICROMETRES) for value in size)
    a, b, c, w = (round(item if orientation[3] >= 0.0 else -item, 9) + 0.0 for item in orientation)
    return OrientedBox(center_m=(x + 0.0, y + 0.0, z + 0.0), size_m=(depth, width, height), orientation=(a, b, c, w))


def _relations(thing: SceneObject | Opening) -> tuple[Relation, ...]:
    """Return what joins a thing to others and to the room."""
    if isinstance(thing, Opening):
        return (Relation(subject=thing.id, kind="in_wall", wall=thing.wall),)
    support = thing.support
    first = {
        "floor": Relation(subject=thing.id, kind="on_floor"),
        "wall": Relation(subject=thing.id, kind="on_wall", wall=support.wall),
        "ceiling": Relation(subject=thing.id, kind="on_ceiling"),
        "object": Relation(subject=thing.id, kind="on", object=support.id),
    }[support.kind]
    return (first,) if thing.group is None else (first, Relation(subject=thing.id, kind="in_group", object=thing.group))
