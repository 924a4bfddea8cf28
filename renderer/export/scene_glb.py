"""A scene as a GLB file: room, objects and parts as nodes, materials, lamps, the camera along its path.

glTF has y up, so one root node turns our frame (z up): below it every object stands in the frame of the scene description.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.camera.config import CameraConfig
from renderer.export.glb_writer import GlbWriter
from renderer.export.materials import LUMINAIRE, MaterialExport, is_luminaire
from renderer.export.punctual import PunctualLight, punctual_lights
from renderer.export.textures import image_coordinates
from renderer.geometry.mesh import Mesh
from renderer.scene.flat_scene import FlatScene
from renderer.textures.apply import AppliedTexture
from scene_description import CameraPose, SceneDescription, SceneObject
from scene_description.labels import NYU40, part_ids
from scene_description.products import matmul

GENERATOR = "scene_synth_ros"
_HALF = math.sqrt(0.5)
Y_UP = [-_HALF, 0.0, 0.0, _HALF]
"""Quaternion (x, y, z, w) that turns z up to y up."""


def scene_to_glb(scene: SceneDescription, flat: FlatScene, camera: CameraConfig) -> bytes:
    """Return a scene, and the same one flattened, as a GLB file; the file's camera moves along the scene's path, as an animation.

    Nodes are named ``<category>_<id>`` and ``<category>_<id>/<part>``, the shell's parts ``room/<part>``; ids, labels and materials are in
    their extras: ``id`` is the object's, 0 for the shell, ``part_id`` that of ``scene_description.labels.part_ids``, ``material_id`` the
    material's place in the description, from 1 on, ``label`` the NYU40 class.  Lamps that are on are lights of KHR_lights_punctual with
    the lamp's whole flux (:mod:`renderer.export.punctual`), named after the part that shines; shades glow with their luminance in cd/m2
    (KHR_materials_emissive_strength).  The sky is not in the file: glTF has no place for it.
    """
    writer = GlbWriter(GENERATOR)
    materials = MaterialExport(writer, scene.materials, flat)
    extras = {"schema": scene.schema, "id": scene.id, "seed": scene.seed, "index": scene.index, "category": scene.category}
    root = writer.add("nodes", {"name": scene.id, "rotation": Y_UP, "extras": extras})
    meshes = split_parts(flat)
    owners: dict[int, int] = {0: _add_child(writer, root, {"name": "room", "extras": {"id": 0, "category": "room"}})}
    names = {0: "room"}
    poses: dict[int, tuple[NDArray[np.float64], float]] = {0: (np.zeros(3), 0.0)}
    for opening in scene.room.openings:
        names[opening.id], poses[opening.id] = f"{opening.category}_{opening.id}", poses[0]
        more = {"id": opening.id, "category": opening.category, "label": opening.label, "label_name": NYU40[opening.label].name}
        owners[opening.id] = _add_child(writer, root, {"name": names[opening.id], "extras": more})
    for thing in scene.objects:
        names[thing.id], poses[thing.id] = f"{thing.category}_{thing.id}", (np.array(thing.position_m), thing.yaw_rad)
        owners[thing.id] = _add_child(writer, root, _object_node(thing, names[thing.id]))
    numbers = part_ids(scene)
    for row, name in enumerate(flat.part_names):
        owner, part = int(flat.parts.object_id[row]), name.partition("/")[2]
        material = materials.index(row)
        local = to_local(meshes[row], *poses[owner])
        more = {"id": owner, "part": part, **_part_ids(scene, flat, row, numbers.get(name, 0))}
        mesh = writer.add(
            "meshes", {"name": f"{names[owner]}/{part}", "primitives": [part_primitive(writer, local, material, materials.texture(row))]}
        )
        _add_child(writer, owners[owner], {"name": f"{names[owner]}/{part}", "mesh": mesh, "extras": more})
    for light in punctual_lights(scene, flat, meshes):
        _add_light(writer, owners[light.object], f"{names[light.object]}/{light.part}", light, *poses[light.object])
    _add_camera(writer, root, camera, scene.camera_path)
    return writer.to_bytes(root, extras)


def _part_ids(scene: SceneDescription, flat: FlatScene, row: int, part_id: int) -> dict[str, Any]:
    label, material = int(flat.parts.label[row]), int(flat.parts.material[row])
    name = LUMINAIRE if is_luminaire(flat, row) else scene.materials[material].id
    return {"part_id": part_id, "label": label, "label_name": NYU40[label].name, "material": name, "material_id": material + 1}


def _add_child(writer: GlbWriter, parent: int, node: dict[str, Any]) -> int:
    index = writer.add("nodes", node)
    writer.set_child(parent, index)
    return index


def _object_node(thing: SceneObject, name: str) -> dict[str, Any]:
    extras: dict[str, Any] = {
        "id": thing.id,
        "category": thing.category,
        "label": thing.label,
        "label_name": NYU40[thing.label].name,
        "size_m": list(thing.size_m),
        "model": thing.model.file or f"{thing.model.generator}:{thing.model.style}",
        "support": thing.support.kind if thing.support.id is None else thing.support.id,
    }
    half = 0.5 * thing.yaw_rad
    return {"name": name, "translation": list(thing.position_m), "rotation": [0.0, 0.0, math.sin(half), math.cos(half)], "extras": extras}


def split_parts(flat: FlatScene) -> list[Mesh]:
    """Return the mesh of every part, in the world, with its own vertices only."""
    order = np.argsort(flat.face_part, kind="stable")
    ends = np.searchsorted(flat.face_part[order], np.arange(len(flat.part_names) + 1))
    meshes = []
    for first, last in pairwise(ends.tolist()):
        used, faces = np.unique(flat.mesh.faces[order[first:last]], return_inverse=True)
        meshes.append(Mesh(flat.mesh.vertices[used], flat.mesh.normals[used], faces.reshape(-1, 3).astype(np.uint32), flat.mesh.uvs[used]))
    return meshes


def to_local(mesh: Mesh, position: NDArray[np.float64], yaw_rad: float) -> Mesh:
    """Return a mesh in the frame of its object, with normals of exactly unit length."""
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    normals = matmul(mesh.normals.astype(np.float64), rotation)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return mesh._replace(vertices=matmul(mesh.vertices - position, rotation).astype(np.float32), normals=normals.astype(np.float32))


def part_primitive(writer: GlbWriter, mesh: Mesh, material: int, texture: AppliedTexture | None) -> dict[str, Any]:
    """Write the arrays of a part and return the primitive that joins them to its material.

    There are no tangents: the glTF specification lets readers compute them from positions, normals and texture coordinates (MikkTSpace),
    and our own normal images are made for the frame that the texture coordinates span.
    """
    attributes = {"POSITION": writer.add_array(mesh.vertices, bounds=True), "NORMAL": writer.add_array(mesh.normals)}
    if texture is not None:
        attributes["TEXCOORD_0"] = writer.add_array(image_coordinates(texture, mesh.uvs))
    small = len(mesh.vertices) < 65_535
    index = mesh.faces.reshape(-1).astype(np.uint16 if small else np.uint32)
    return {"attributes": attributes, "indices": writer.add_array(index, use="indices"), "material": material}


def _add_light(writer: GlbWriter, owner: int, name: str, light: PunctualLight, position: NDArray[np.float64], yaw_rad: float) -> None:
    """Add a light below its object, which stands at ``position`` and is turned by ``yaw_rad``; a spot looks along its node's -z."""
    item: dict[str, Any] = {"name": name, "type": "point", "color": list(light.color), "intensity": light.intensity_cd}
    extras = {"flux_lm": light.flux_lm, "color_temperature_k": light.color_temperature_k, "part": light.part}
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    x, y, z = (np.array(light.position_m) - position).tolist()
    node: dict[str, Any] = {"name": f"{name}/light", "translation": [cosine * x + sine * y, cosine * y - sine * x, z], "extras": extras}
    if light.cone is not None:
        item |= {"type": "spot", "spot": {"innerConeAngle": light.cone.inner_rad, "outerConeAngle": light.cone.outer_rad}}
        x, y, z = light.direction
        node["rotation"] = _from_down(cosine * x + sine * y, cosine * y - sine * x, z)
    node["extensions"] = {"KHR_lights_punctual": {"light": writer.add_light(item)}}
    _add_child(writer, owner, node)


def _from_down(x: float, y: float, z: float) -> list[float]:
    """Return the quaternion (x, y, z, w) of the shortest turn from -z to a unit vector."""
    w = math.sqrt(max(0.5 * (1.0 - z), 0.0))
    return [y / (2.0 * w), -x / (2.0 * w), 0.0, w] if w > 1e-6 else [1.0, 0.0, 0.0, 0.0]


def _add_camera(writer: GlbWriter, root: int, config: CameraConfig, path: Sequence[CameraPose]) -> None:
    """Add the camera at its first pose, and its path as an animation; a glTF camera looks along -z with y up, ours along z with y down."""
    aspect = config.width / config.height
    yfov = 2.0 * math.atan(math.tan(0.5 * config.horizontal_fov_rad) / aspect)
    lens = {"aspectRatio": aspect, "yfov": yfov, "znear": 0.01}
    camera = writer.add("cameras", {"type": "perspective", "name": "camera", "perspective": lens})
    turns = np.array([_half_turn(pose) for pose in path])
    signs = np.cumprod(np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))
    turns[1:] *= signs[:, None]  # neighbours on one side of the sphere, so that the way between them is the short one
    turns = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    places = np.array([pose.position_m for pose in path], np.float32)
    node = _add_child(writer, root, {"name": "camera", "camera": camera, "translation": places[0].tolist(), "rotation": turns[0].tolist()})
    if len(path) < 2:
        return
    times = np.array([(pose.stamp_ns - path[0].stamp_ns) * 1e-9 for pose in path], np.float32)
    clock = writer.add_array(times, use="animation", bounds=True)
    samplers = [
        {"input": clock, "output": writer.add_array(rows, use="animation"), "interpolation": "LINEAR"}
        for rows in (places, turns.astype(np.float32))
    ]
    channels = [{"sampler": i, "target": {"node": node, "path": name}} for i, name in enumerate(("translation", "rotation"))]
    writer.add("animations", {"name": "camera_path", "samplers": samplers, "channels": channels})


def _half_turn(pose: CameraPose) -> tuple[float, float, float, float]:
    """Return the quaternion of a pose after half a turn about its own x axis."""
    x, y, z, w = pose.orientation
    return (w, z, -y, -x)
