"""One model alone in a small room, and views that it fills."""

import numpy as np
from box_room import box, pose, quad, scene
from model_sizes import SIZES

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import merged
from renderer.models import build_model
from renderer.scene.flat_scene import FlatScene, tabulate_materials
from scene_description import Material
from scene_description.types import CameraPose


def room_size(generator: str) -> tuple[float, float]:
    """The edge of a model's room, two and a half times the model's, and its height, in metres."""
    depth, width, height = SIZES[generator]
    return max(2.5 * max(depth, width), 1.5), max(1.6 * height, 1.5)


def lit_room(generator: str, style: str, albedo: float = 0.5) -> FlatScene:
    """A model, matt and grey, amid the floor of a grey room under a lamp."""
    edge, height = room_size(generator)
    low, high = (-0.5 * edge, -0.5 * edge, 0), (0.5 * edge, 0.5 * edge, height)
    lamp = quad((-0.2 * edge, -0.2 * edge, height - 0.02), (0, 0.4 * edge, 0), (0.4 * edge, 0, 0), object_id=2, emission=(2e3,) * 3)
    return with_model(scene(box(low, high, inside=True, object_id=0), lamp), generator, style, albedo)


def furnace(generator: str, style: str) -> FlatScene:
    """A model that reflects all light in a room whose surfaces glow evenly, so that luminance is the same everywhere."""
    edge, height = room_size(generator)
    low, high = (-0.5 * edge, -0.5 * edge, 0), (0.5 * edge, 0.5 * edge, height)
    return with_model(scene(box(low, high, inside=True, object_id=0, glow_cd_m2=1.0, color=(1.0,) * 3)), generator, style, 1.0)


def with_model(room: FlatScene, generator: str, style: str, albedo: float) -> FlatScene:
    """A room with a model as object 3, one part after the other."""
    parts, first = build_model(generator, style, 1, SIZES[generator]), len(room.part_names)
    count, meshes = len(parts), [Mesh(*mesh[:3]) for mesh in parts.values()]
    mesh = merged(Mesh(*room.mesh[:3]), *meshes)
    table, numbers = room.parts, np.ones(count)
    rows, material = room.materials, Material(id="model", family="test", base_color=(albedo,) * 3, roughness=1.0, ior=1.0)
    return room._replace(
        mesh=mesh._replace(uvs=np.ascontiguousarray(mesh.vertices[:, :2])),
        face_part=np.concatenate([room.face_part, np.repeat(np.arange(first, first + count), [len(m.faces) for m in meshes])]).astype(
            np.int32
        ),
        parts=table._replace(
            object_id=np.append(table.object_id, 3 * numbers).astype(np.uint16),
            label=np.append(table.label, numbers).astype(np.uint8),
            material=np.append(table.material, first * numbers).astype(np.int32),
            emission=np.concatenate([table.emission, np.zeros((count, 3), np.float32)]),
            portal=np.append(table.portal, np.zeros(count, np.bool_)),
        ),
        part_names=(*room.part_names, *(f"3/{name}" for name in parts)),
        materials=type(rows)(*(np.concatenate(pair) for pair in zip(rows, tabulate_materials([material]), strict=True))),
    )


def views(generator: str) -> list[CameraPose]:
    """Views of it from before and above, and from behind."""
    edge, room_height = room_size(generator)
    height = SIZES[generator][2]
    far = min(1.1 * float(np.linalg.norm(SIZES[generator])), 0.68 * edge)
    up = min(0.5 * height + 0.55 * far, 0.95 * room_height)
    return [pose((side * 0.65 * far, side * 0.5 * far, up), (0, 0, 0.5 * height)) for side in (1.0, -1.0)]
