"""A scene as GLB, read back by trimesh and by our own reader: nodes, parts, boxes, materials, lamps, camera."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from sample_scene import sample_scene

from renderer.camera.config import CameraConfig
from renderer.export.scene_glb import scene_to_glb
from renderer.export.textures import bake, image_coordinates
from renderer.files.mesh_files import read_mesh_file
from renderer.scene.flat_scene import FlatScene
from renderer.scene.flatten import flatten
from renderer.textures.apply import AppliedTexture
from renderer.textures.tile import TextureTile
from scene_description import FileReading, Luminaire, Material, SceneDescription, Texture
from scene_description.labels import part_ids
from scene_description.poses import world_from_optical

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Our world (z up) -> glTF (y up)."""


@pytest.fixture(scope="module")
def scene() -> SceneDescription:
    plain = sample_scene()
    coated = [
        replace(item, clearcoat=0.4, sheen=0.2, ior=1.45, diffuse_transmission=0.3) if item.id == "oak" else item
        for item in plain.materials
    ]
    return replace(plain, materials=tuple(coated))


@pytest.fixture(scope="module")
def flat(scene: SceneDescription) -> FlatScene:
    return flatten(scene)


@pytest.fixture(scope="module")
def glb(scene: SceneDescription, flat: FlatScene) -> bytes:
    return scene_to_glb(scene, flat, CameraConfig())


def tree_of(glb: bytes) -> dict[str, Any]:
    tree: dict[str, Any] = json.loads(glb[20 : 20 + int.from_bytes(glb[12:16], "little")])
    return tree


def parents(tree: Mapping[str, Any]) -> dict[int, int]:
    return {child: i for i, node in enumerate(tree["nodes"]) for child in node.get("children", [])}


def part_box(flat: FlatScene, row: int) -> tuple[np.ndarray, np.ndarray]:
    points = flat.mesh.vertices[flat.mesh.faces[flat.face_part == row]].reshape(-1, 3) @ Y_UP.T
    return points.min(axis=0), points.max(axis=0)


def test_trimesh_reads_the_same_parts_in_the_same_places(tmp_path: Path, scene: SceneDescription, flat: FlatScene, glb: bytes) -> None:
    path = tmp_path / "room.glb"
    path.write_bytes(glb)
    loaded = trimesh.load_scene(path)
    names = {0: "room", 1: "door_1", 2: "window_2", 3: "bed_3", 4: "nightstand_4", 5: "table_lamp_5", 6: "ceiling_lamp_6"}
    expected = {f"{names[int(flat.parts.object_id[row])]}/{name.split('/')[1]}": row for row, name in enumerate(flat.part_names)}
    assert set(loaded.graph.nodes_geometry) == set(expected)
    for node, row in expected.items():
        matrix, geometry = loaded.graph[node]
        mesh = loaded.geometry[geometry].copy().apply_transform(matrix)
        assert np.allclose(mesh.bounds, part_box(flat, row), atol=2e-6), node
        assert len(mesh.faces) == (flat.face_part == row).sum()
        material = scene.materials[int(flat.parts.material[row])]
        assert mesh.visual.material.name == material.id
        assert np.allclose(np.asarray(mesh.visual.material.baseColorFactor)[:3] / 255.0, material.base_color, atol=0.003)
        assert mesh.visual.material.roughnessFactor == material.roughness
    low, high = flat.mesh.vertices.min(axis=0), flat.mesh.vertices.max(axis=0)
    ends = np.sort(np.array([low, high]) @ Y_UP.T, axis=0)
    assert np.allclose(loaded.bounds, ends, atol=2e-6)


def test_our_reader_takes_it_back(tmp_path: Path, flat: FlatScene, glb: bytes) -> None:
    """Front +z and up +y of a file would be an object's; the room's x and z are stated to get our axes back."""
    (tmp_path / "room.glb").write_bytes(glb)
    read = read_mesh_file(tmp_path / "room.glb", tmp_path, FileReading(front="+x", up="+y"))
    assert len(read.parts) == len(flat.part_names) and sum(len(p.mesh.faces) for p in read.parts.values()) == len(flat.mesh.faces)
    assert np.allclose(read.size, np.ptp(flat.mesh.vertices, axis=0), atol=1e-5)
    oak = next(item for item in read.materials if item.name == "oak")
    assert (oak.clearcoat, oak.ior, oak.sheen, oak.diffuse_transmission) == (0.4, 1.45, 0.2, 0.3)
    glass = next(item for item in read.materials if item.name == "glass")
    assert glass.transmission == 0.9 and glass.roughness == 0.05


def test_hierarchy_and_extras(scene: SceneDescription, glb: bytes) -> None:
    tree = tree_of(glb)
    above, nodes = parents(tree), tree["nodes"]
    (root,) = tree["scenes"][0]["nodes"]
    assert nodes[root]["name"] == "sample-1" and tree["scenes"][0]["extras"]["schema"] == "scene_synth/1"
    places = {node["name"]: i for i, node in enumerate(nodes)}
    duvet, bed = places["bed_3/duvet"], places["bed_3"]
    assert above[duvet] == bed and above[bed] == root
    assert nodes[bed]["extras"] == {
        "id": 3, "category": "bed", "label": 4, "label_name": "bed", "size_m": [2.1, 1.6, 1.0], "model": "bed:upholstered",
        "support": "floor",
    }  # fmt: skip
    assert nodes[duvet]["extras"] == {
        "id": 3, "part": "duvet", "part_id": part_ids(scene)["3/duvet"], "label": 4, "label_name": "bed", "material": "linen",
        "material_id": 3,
    }  # fmt: skip
    assert nodes[places["table_lamp_5"]]["extras"]["support"] == 4
    assert len(places) == len(nodes), "names are unique"


def test_lamps_keep_their_flux(flat: FlatScene, glb: bytes) -> None:
    """One lamp is on; its luminance over the sphere is its flux, its shade glows with the flat scene's luminance."""
    tree = tree_of(glb)
    (light,) = tree["extensions"]["KHR_lights_punctual"]["lights"]
    luminance = light["intensity"] * np.dot(light["color"], (0.2126, 0.7152, 0.0722))
    assert math.isclose(4.0 * math.pi * luminance, 400.0, rel_tol=1e-9)
    node = next(item for item in tree["nodes"] if "KHR_lights_punctual" in item.get("extensions", {}))
    assert (light["name"], node["name"]) == ("table_lamp_5/shade", "table_lamp_5/shade/light") and 0.0 < node["translation"][2] < 0.4
    assert np.allclose(node["translation"][:2], 0.0, atol=0.01) and light["type"] == "point"
    (glow,) = (item for item in tree["materials"] if "emissiveFactor" in item)
    strength = glow["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"]
    row = flat.part_names.index("5/shade")
    assert np.allclose(np.array(glow["emissiveFactor"]) * strength, flat.parts.emission[row], rtol=1e-6)


def test_luminaires_are_lights_of_their_own(scene: SceneDescription) -> None:
    """A spot that leans, a bulb, and one that is off: two more lights, with their names, axes and flux; no ball has the floor's looks."""
    lamp = Luminaire(kind="spot", position_m=(2.0, 1.0, 2.4), flux_lm=600.0, color_temperature_k=3000.0, color=(1.0, 0.8, 0.5))
    bulb = replace(lamp, kind="point", flux_lm=800.0, position_m=(1.0, 1.0, 2.0))
    shown = replace(scene, luminaires=(replace(lamp, direction=(0.6, 0.0, -0.8)), bulb, replace(lamp, on=False)))
    tree = tree_of(scene_to_glb(shown, flatten(shown), CameraConfig()))
    lights = {item["name"]: item for item in tree["extensions"]["KHR_lights_punctual"]["lights"]}
    assert set(lights) == {"table_lamp_5/shade", "room/luminaire_0", "room/luminaire_1"}
    nodes = {node["name"]: node for node in tree["nodes"]}
    spot, node = lights["room/luminaire_0"], nodes["room/luminaire_0/light"]
    assert spot["type"] == "spot" and node["translation"] == [2.0, 1.0, 2.4] and spot["color"] == [1.0, 0.8, 0.5]
    x, y, z, w = node["rotation"]
    axis = trimesh.transformations.quaternion_matrix([w, x, y, z])[:3, :3] @ (0.0, 0.0, -1.0)
    assert np.allclose(axis, (0.6, 0.0, -0.8), atol=1e-12)
    inner, outer = (math.cos(spot["spot"][name]) for name in ("innerConeAngle", "outerConeAngle"))
    candela = np.dot(spot["color"], (0.2126, 0.7152, 0.0722)) * spot["intensity"]
    assert math.isclose(candela * 2.0 * math.pi * (1.0 - inner + (inner - outer) / 3.0), 600.0, rel_tol=1e-9)
    assert lights["room/luminaire_1"]["type"] == "point" and "rotation" not in nodes["room/luminaire_1/light"]
    looks = [tree["materials"][tree["meshes"][nodes[f"room/luminaire_{i}"]["mesh"]]["primitives"][0]["material"]] for i in range(3)]
    assert {look["name"] for look in looks} == {"luminaire"} and nodes["room/luminaire_0"]["extras"]["material"] == "luminaire"
    assert np.allclose([look["emissiveFactor"] for look in looks], [(1.0, 0.8, 0.5), (1.0, 0.8, 0.5), (0.0, 0.0, 0.0)], atol=1e-6)
    assert not any("extensions" in look for look in looks)


def test_the_camera_sees_what_ours_sees(scene: SceneDescription, glb: bytes) -> None:
    """The node's -z and y are our optical z and -y, turned to y up; the animation has every pose."""
    tree = tree_of(glb)
    node = next(item for item in tree["nodes"] if "camera" in item)
    x, y, z, w = node["rotation"]
    rotation = trimesh.transformations.quaternion_matrix([w, x, y, z])[:3, :3]
    ours = world_from_optical(scene.camera_path[0].position_m, scene.camera_path[0].orientation)[:3, :3]
    assert np.allclose(rotation @ np.diag([1.0, -1.0, -1.0]), ours, atol=1e-9)
    lens = tree["cameras"][0]["perspective"]
    config = CameraConfig()
    assert math.isclose(math.tan(lens["yfov"] / 2) * lens["aspectRatio"], math.tan(config.horizontal_fov_rad / 2), rel_tol=1e-12)
    (animation,) = tree["animations"]
    assert [tree["accessors"][item["output"]]["count"] for item in animation["samplers"]] == [2, 2]
    assert tree["accessors"][animation["samplers"][0]["input"]]["max"] == [pytest.approx(0.2)]


def test_same_bytes_again(scene: SceneDescription, glb: bytes) -> None:
    assert scene_to_glb(scene, flatten(scene), CameraConfig()) == glb


def test_baked_textures_are_what_hits_see() -> None:
    """Level 1 of a checkered tile with shares 0 and 1: the material's colour and the second colour, in sRGB; v turned over."""
    texels = np.zeros((2, 2, 8), np.uint8)
    texels[..., 3] = texels[..., 4] = 128
    texels[..., 5:7] = 128
    texels[0, 1, 0] = 255
    texture = AppliedTexture(TextureTile((texels,), False, 1.0), size=(0.5, 0.25), colors=((1.0, 0.0, 0.0),))
    baked = bake(texture, Material(id="m", family="f", base_color=(0.2140411, 0.2140411, 0.2140411), roughness=0.5))
    assert np.abs(baked.color[0].astype(int) - 128).max() <= 1, "first row uppermost: v above one half"
    assert np.abs(baked.color[1, 1].astype(int) - (255, 0, 0)).max() <= 1
    assert baked.surface is None and baked.normal is None, "nothing varies"
    assert np.allclose(image_coordinates(texture, np.array([[0.5, 0.25], [0.25, 0.0]], np.float32)), [[1.0, 0.0], [0.5, 1.0]])
    texels[0, 0, 5] = 255
    plain = bake(texture._replace(colors=()), Material(id="m", family="f", base_color=(1.0, 1.0, 1.0)))
    assert plain.color[1, 1].max() <= 1 and plain.color[0].min() >= 254, "colours that are not there are black, as at hits"
    sloped = bake(texture._replace(source=TextureTile((texels,), False, 1.0)), Material(id="m", family="f", base_color=(1.0, 1.0, 1.0)))
    assert sloped.normal is not None
    normal = sloped.normal[1, 0] / 127.5 - 1.0
    assert np.allclose(normal, np.array([-1.0, 0.0, 1.0]) / math.sqrt(2.0), atol=0.01), "a slope of 1 along u leans back by 45 degrees"


def test_textures_go_into_the_file(scene: SceneDescription) -> None:
    wood = Texture(generator="planks", scale_m=0.12, seed=3)
    changed = replace(scene, materials=tuple(replace(item, texture=wood) if item.id == "oak" else item for item in scene.materials))
    tree = tree_of(scene_to_glb(changed, flatten(changed), CameraConfig()))
    images = {item["name"] for item in tree["images"]}
    assert "oak color" in images
    floor = next(item for item in tree["meshes"] if item["name"] == "room/floor")["primitives"][0]
    assert "TEXCOORD_0" in floor["attributes"]
    assert "baseColorTexture" in tree["materials"][floor["material"]]["pbrMetallicRoughness"]


def test_screens_glow_with_their_picture(scene: SceneDescription) -> None:
    picture = Texture(generator="television", scale_m=1.0, seed=3)
    lit = tuple(replace(item, glow_cd_m2=90.0, texture=picture) if item.id == "oak" else item for item in scene.materials)
    shown = replace(scene, materials=lit)
    items = {item["name"]: item for item in tree_of(scene_to_glb(shown, flatten(shown), CameraConfig()))["materials"]}
    oak = items["oak"]
    assert oak["emissiveFactor"] == [1.0, 1.0, 1.0] and oak["emissiveTexture"] == oak["pbrMetallicRoughness"]["baseColorTexture"]
    assert oak["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] == 90.0
    plain = replace(scene, materials=tuple(replace(item, glow_cd_m2=90.0, texture=None) if item.id == "oak" else item for item in lit))
    oak = {item["name"]: item for item in tree_of(scene_to_glb(plain, flatten(plain), CameraConfig()))["materials"]}["oak"]
    assert oak["emissiveFactor"] == list(next(item.base_color for item in scene.materials if item.id == "oak"))
