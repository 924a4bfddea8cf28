"""A scene as an SDFormat world: the XML and its meshes, put together as Gazebo does, are the scene."""

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh
from sample_scene import sample_scene

from renderer.export.sdf import SdfWorld, scene_to_sdf
from renderer.scene.flat_scene import FlatScene
from renderer.scene.flatten import flatten
from scene_description import Luminaire, SceneDescription


@pytest.fixture(scope="module")
def scene() -> SceneDescription:
    return sample_scene()


@pytest.fixture(scope="module")
def flat(scene: SceneDescription) -> FlatScene:
    return flatten(scene)


@pytest.fixture(scope="module")
def world(scene: SceneDescription, flat: FlatScene) -> SdfWorld:
    return scene_to_sdf(scene, flat, "room_meshes")


def matrix(pose: str) -> np.ndarray:
    """SDFormat: x y z roll pitch yaw, roll first, about fixed axes."""
    x, y, z, roll, pitch, yaw = (float(word) for word in pose.split())
    turned = trimesh.transformations.euler_matrix(roll, pitch, yaw, "sxyz")
    turned[:3, 3] = x, y, z
    return np.asarray(turned)


def test_models_stand_where_the_scene_says(scene: SceneDescription, flat: FlatScene, world: SdfWorld) -> None:
    root = ET.fromstring(world.xml)
    models = root.findall("world/model")
    names = {0: "room", 1: "door_1", 2: "window_2", 3: "bed_3", 4: "nightstand_4", 5: "table_lamp_5", 6: "ceiling_lamp_6"}
    assert root.get("version") == "1.9" and [model.get("name") for model in models] == list(names.values())
    assert set(world.meshes) == {f"{name}.glb" for name in names.values()}
    for owner, model in zip(names, models, strict=True):
        assert model.findtext("static") == "true"
        assert int(model.findtext("plugin/label", "")) == (1 if owner == 0 else int(flat.parts.label[flat.parts.object_id == owner][0]))
        rows = np.flatnonzero(flat.parts.object_id == owner)
        points = flat.mesh.vertices[flat.mesh.faces[np.isin(flat.face_part, rows)]].reshape(-1, 3)
        for kind in ("visual", "collision"):
            shape = model.find(f"link/{kind}")
            assert shape is not None
            folder, file = shape.findtext("geometry/mesh/uri", "").split("/")
            loaded = trimesh.load_scene(BytesIO(world.meshes[file]), file_type="glb")
            loaded.apply_transform(matrix(model.findtext("pose", "")) @ matrix(shape.findtext("pose", "")))
            assert folder == "room_meshes" and len(loaded.geometry) == len(rows)
            np.testing.assert_allclose(loaded.bounds, (points.min(axis=0), points.max(axis=0)), atol=1e-5)


def test_lamps_that_are_on_shine_from_their_shades(scene: SceneDescription, flat: FlatScene, world: SdfWorld) -> None:
    lights = ET.fromstring(world.xml).findall("world/light")
    lit = [light for light in scene.lights if light.on]
    assert len(lights) == len(lit) > 0
    for item, light in zip(lights, lit, strict=True):
        row = flat.part_names.index(f"{light.object}/{light.part}")
        shade = flat.mesh.vertices[flat.mesh.faces[flat.face_part == row]].reshape(-1, 3)
        place = np.array([float(word) for word in item.findtext("pose", "").split()[:3]])
        assert item.get("type") == "point" and (place > shade.min(axis=0)).all() and (place < shade.max(axis=0)).all()
        assert 0.0 < float(item.findtext("intensity", "")) <= 1.0
        assert all(0.0 <= float(word) <= 1.0 for word in item.findtext("diffuse", "").split())


def test_a_spot_in_the_ceiling_is_a_spot_of_the_world(scene: SceneDescription) -> None:
    lamp = Luminaire(kind="spot", position_m=(2.0, 1.0, 2.4), flux_lm=600.0, color_temperature_k=3000.0, color=(1.0, 0.8, 0.5))
    lit = replace(scene, luminaires=(lamp,))
    lights = {item.get("name"): item for item in ET.fromstring(scene_to_sdf(lit, flatten(lit), "meshes").xml).findall("world/light")}
    assert set(lights) == {"table_lamp_5_shade_light", "room_luminaire_0_light"}
    spot = lights["room_luminaire_0_light"]
    assert (
        spot.get("type") == "spot" and spot.findtext("direction") == "0.0 0.0 -1.0" and spot.findtext("pose") == "2.0 1.0 2.4 0.0 0.0 0.0"
    )
    assert 0.6 < float(spot.findtext("spot/inner_angle", "")) < float(spot.findtext("spot/outer_angle", "")) < 1.3


def test_same_bytes_again_and_plain_numbers(scene: SceneDescription, flat: FlatScene, world: SdfWorld) -> None:
    assert scene_to_sdf(scene, flat, "room_meshes") == world
    for pose in re.findall(rb"<pose>([^<]*)</pose>", world.xml):
        assert len(pose.split()) == 6 and all(math.isfinite(float(word)) for word in pose.split())
