"""A scene as an SDFormat world: one static model per object, opening and shell, each with a GLB mesh of its own, and the lamps.

SDFormat (sdformat.org, specification 1.9) has our frame: metres, z up, poses as x y z roll pitch yaw.  Its meshes are files; Gazebo (the
AssimpLoader of gz-common) takes the coordinates of a GLB as they stand, y up, so visuals and collisions are rolled by a quarter turn.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from renderer.core.color import LUMINANCE
from renderer.export.glb_writer import GlbWriter
from renderer.export.materials import MaterialExport
from renderer.export.punctual import PunctualLight, cone_solid_angle, punctual_lights
from renderer.export.scene_glb import GENERATOR, Y_UP, part_primitive, split_parts, to_local
from renderer.geometry.mesh import Mesh
from renderer.scene.flat_scene import FlatScene
from scene_description import SceneDescription
from scene_description.products import matmul

VERSION = "1.9"
_UPRIGHT = (0.0, 0.0, 0.0, 0.5 * math.pi, 0.0, 0.0)
_BRIGHT_LM, _REACH_M = 3000.0, 12.0
"""Flux of a point whose light has the intensity 1 in the world, where lights have no unit; and how far light reaches."""

Pose = tuple[float, float, float, float, float, float]


class SdfWorld(NamedTuple):
    """The world's XML, and its meshes: file name below the folder of meshes -> GLB."""

    xml: bytes
    meshes: dict[str, bytes]


class _Model(NamedTuple):
    name: str
    pose: Pose
    label: int


def scene_to_sdf(scene: SceneDescription, flat: FlatScene, folder: str) -> SdfWorld:
    """Return a scene, and the same one flattened, as an SDFormat world; ``folder`` of the meshes is relative to the world's file.

    Models are named ``<category>_<id>`` and ``room``, are static, collide with their meshes and carry their NYU40 class for Gazebo's
    segmentation camera.  Lamps that are on are points or spots (:mod:`renderer.export.punctual`) without a physical unit; daylight is an
    ambient term.  Screens do not shine.
    """
    owners = _models(scene)
    parts: dict[int, list[int]] = {owner: [] for owner in owners}
    for row, owner in enumerate(flat.parts.object_id.tolist()):
        parts[owner].append(row)
    meshes, split = {}, split_parts(flat)
    root = ET.Element("sdf", version=VERSION)
    world = ET.SubElement(root, "world", name=scene.id)
    surroundings = ET.SubElement(world, "scene")
    _text(surroundings, "ambient", (0.4, 0.4, 0.4, 1.0))
    _text(surroundings, "background", (0.7, 0.8, 0.9, 1.0))
    for owner, model in owners.items():
        if not parts[owner]:
            continue
        file = f"{model.name}.glb"
        meshes[file] = _glb(scene, flat, model, parts[owner], split)
        _add_model(world, model, f"{folder}/{file}")
    for light in punctual_lights(scene, flat, split):
        _add_light(world, owners[light.object].name, light)
    ET.indent(root)
    return SdfWorld(ET.tostring(root, encoding="utf-8", xml_declaration=True), meshes)


def _models(scene: SceneDescription) -> dict[int, _Model]:
    still: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    found = {0: _Model("room", still, 1)}
    for opening in scene.room.openings:
        found[opening.id] = _Model(f"{opening.category}_{opening.id}", still, opening.label)
    for thing in scene.objects:
        found[thing.id] = _Model(f"{thing.category}_{thing.id}", (*thing.position_m, 0.0, 0.0, thing.yaw_rad), thing.label)
    return found


def _glb(scene: SceneDescription, flat: FlatScene, model: _Model, rows: Sequence[int], split: Sequence[Mesh]) -> bytes:
    """Return the parts of one model, in its own frame, as a GLB file."""
    writer = GlbWriter(GENERATOR)
    materials = MaterialExport(writer, scene.materials, flat)
    root = writer.add("nodes", {"name": model.name, "rotation": Y_UP})
    for row in rows:
        name = flat.part_names[row].partition("/")[2]
        local = to_local(split[row], np.array(model.pose[:3]), model.pose[5])
        primitive = part_primitive(writer, local, materials.index(row), materials.texture(row))
        mesh = writer.add("meshes", {"name": name, "primitives": [primitive]})
        writer.set_child(root, writer.add("nodes", {"name": name, "mesh": mesh}))
    return writer.to_bytes(root, {"model": model.name})


def _add_model(world: ET.Element, model: _Model, uri: str) -> None:
    item = ET.SubElement(world, "model", name=model.name)
    _text(item, "static", "true")
    _text(item, "pose", model.pose)
    link = ET.SubElement(item, "link", name="link")
    for kind in ("visual", "collision"):
        shape = ET.SubElement(link, kind, name=kind)
        _text(shape, "pose", _UPRIGHT)
        _text(ET.SubElement(ET.SubElement(shape, "geometry"), "mesh"), "uri", uri)
    plugin = ET.SubElement(item, "plugin", filename="gz-sim-label-system", name="gz::sim::systems::Label")
    _text(plugin, "label", str(model.label))


def _add_light(world: ET.Element, name: str, light: PunctualLight) -> None:
    """Add a light, as bright on its axis against a bright lamp as its intensity; cones are told by their whole angles."""
    color = np.asarray(light.color, np.float64)
    color = color / float(matmul(color, LUMINANCE))
    color /= max(1.0, float(color.max()))
    kind = "point" if light.cone is None else "spot"
    item = ET.SubElement(world, "light", name=f"{name}_{light.part}_light", type=kind)
    _text(item, "pose", (*light.position_m, 0.0, 0.0, 0.0))
    for aspect in ("diffuse", "specular"):
        _text(item, aspect, (*color.tolist(), 1.0))
    intensity = light.flux_lm / _BRIGHT_LM * cone_solid_angle(None) / cone_solid_angle(light.cone)
    _text(item, "intensity", (min(intensity, 1.0) if light.cone is None else intensity,))
    fading = ET.SubElement(item, "attenuation")
    for key, value in (("range", _REACH_M), ("constant", 0.3), ("linear", 0.0), ("quadratic", 0.25)):
        _text(fading, key, (value,))
    if light.cone is not None:
        _text(item, "direction", light.direction)
        cone = ET.SubElement(item, "spot")
        for key, value in (("inner_angle", 2.0 * light.cone.inner_rad), ("outer_angle", 2.0 * light.cone.outer_rad), ("falloff", 1.0)):
            _text(cone, key, (value,))
    _text(item, "cast_shadows", "false")  # the lamp's own shade would keep it in


def _text(parent: ET.Element, name: str, value: Any) -> None:
    """Add a child with text: a string, or numbers in full precision."""
    ET.SubElement(parent, name).text = value if isinstance(value, str) else " ".join(repr(float(number)) for number in value)
