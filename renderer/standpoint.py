"""Where a camera stands: in the room, outside of it, or inside something, told by the surfaces that it sees all around.

Surfaces show their fronts to whoever stands where a camera belongs.  From a place inside a solid most directions meet the back of one of
its surfaces; in a closed cupboard all of them meet the cupboard.  What lies outside is known from the room's outline and height.
"""

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry
from renderer.core.ray_packet import INVALID_ID, LANES, Packet, make_packet
from renderer.scene.flat_scene import FlatScene
from renderer.scene.room_shell import SLAB_M
from scene_description import SceneDescription
from scene_description.ceilings import ceiling_height_m
from scene_description.polygons import distance_outside_m, signed_area_m2
from scene_description.types import Point3

_RAYS = 4 * LANES
_MOST, _ALL = _RAYS // 2, _RAYS - 2
"""More rays than half are most; two may slip through the gaps of doors, and the others count as all."""
_ROOM, _NOTHING = 0, -1
"""Object ids of the room's shell and of what is not there."""
_ZERO, _INFINITE = np.float32(0.0), np.float32(np.inf)


def standpoint(tree: SceneHandle, flat: FlatScene, scene: SceneDescription, position_m: Point3) -> str:
    """Return ``outside the room`` or ``inside ...`` for a camera that is not in the room's air, an empty text for one that is.

    The holes of doors and windows count as the room's air, and so do places under a table or in an open shelf.  An object that encloses
    the camera with the fronts of its surfaces is told only if it has less than half the room's volume: larger ones are rooms themselves,
    as a scanned room is.

    ``position_m``: of the lens, in the world; ``scene``: for the room's outline and the names of objects.
    """
    x, y, z = position_m
    room = scene.room
    if not -SLAB_M <= z <= ceiling_height_m(room, x, y) + SLAB_M or distance_outside_m(room.polygon_m, x, y) > room.wall_thickness_m:
        return "outside the room"
    parts, behind = seen_around(tree, flat, position_m)
    owners = np.where(parts >= 0, flat.parts.object_id[parts].astype(np.int64), _NOTHING)
    owner, count = _commonest(owners[behind])
    if count > _MOST:
        name = flat.part_names[int(parts[behind & (owners == owner)][0])]
        return f"inside the room's {name.partition('/')[2]}" if owner == _ROOM else f"inside {_described(scene, owner)}"
    owner, count = _commonest(owners)
    sizes = {thing.id: float(np.prod(thing.size_m)) for thing in scene.objects}
    small = owner in sizes and sizes[owner] < 0.5 * signed_area_m2(room.polygon_m) * room.height_m
    return f"inside {_described(scene, owner)}" if count >= _ALL and small else ""


def _commonest(owners: NDArray[np.int64]) -> tuple[int, int]:
    """Return the object id that most of some rays meet, and how many do."""
    ids, counts = np.unique(owners, return_counts=True)
    return (int(ids[counts.argmax()]), int(counts.max())) if len(ids) else (_NOTHING, 0)


def _described(scene: SceneDescription, owner: int) -> str:
    """Return the id and category of an object, a door or a window."""
    categories = {opening.id: opening.category for opening in scene.room.openings} | {thing.id: thing.category for thing in scene.objects}
    return f"object {owner} ({categories[owner]})"


def seen_around(tree: SceneHandle, flat: FlatScene, position_m: Point3) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Return what rays in even directions from a place meet: the part, -1 for nothing, and whether it is met from behind; (64,) each."""
    number = np.arange(_RAYS)
    height, turn = 1.0 - (2.0 * number + 1.0) / _RAYS, number * np.pi * (3.0 - np.sqrt(5.0))
    level = np.sqrt(1.0 - height * height)
    directions = np.column_stack([level * el.cos(turn), level * el.sin(turn), height]).astype(np.float32)
    triangles, facing = np.full(_RAYS, -1, np.int64), np.zeros(_RAYS, np.float32)
    _look_around(tree, make_packet(), np.array(position_m, np.float32), directions, triangles, facing)
    return np.where(triangles >= 0, flat.face_part[triangles], -1), (triangles >= 0) & (facing > 0.0)


@entry
def _look_around(
    scene: SceneHandle,
    packet: Packet,
    position: NDArray[np.float32],
    directions: NDArray[np.float32],
    triangles: NDArray[np.int64],
    facing: NDArray[np.float32],
) -> None:
    """Fill ``triangles`` with what rays from ``position`` hit, and ``facing`` with normal times direction: positive from behind."""
    real, integer = packet.real, packet.integer
    for first in range(0, len(directions), LANES):
        for k in range(LANES):
            for axis in range(3):
                real[ray.ORG_X + LANES * axis + k] = position[axis]
                real[ray.DIR_X + LANES * axis + k] = directions[first + k, axis]
            real[ray.TNEAR + k], real[ray.TFAR + k], integer[ray.GEOM_ID + k] = _ZERO, _INFINITE, INVALID_ID
        intersect16(packet.alive.ctypes.data, scene.address, real.ctypes.data, scene.incoherent)
        for k in range(LANES):
            if integer[ray.GEOM_ID + k] != INVALID_ID:
                triangles[first + k] = integer[ray.PRIM_ID + k]
                for axis in range(3):
                    facing[first + k] += real[ray.NG_X + LANES * axis + k] * directions[first + k, axis]
