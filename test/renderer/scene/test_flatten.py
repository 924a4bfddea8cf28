"""Scene description to flat scene: tables, placing, emission, the user's files, refusals, determinism."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from renderer.core.errors import MeshFileError
from renderer.files.mesh_files import MAX_FILE_BYTES, find_mesh_file, load_mesh_file
from renderer.path import surface_tables as st
from renderer.path.surface_tables import build_surfaces
from renderer.scene.flatten import FlattenError, flatten
from scene_description import (
    CameraPose,
    Environment,
    Light,
    Material,
    ModelReference,
    Opening,
    ParseGraph,
    Part,
    Room,
    SceneDescription,
    SceneObject,
    Support,
    ValidityReport,
)
from scene_description.scene_json import scene_from_json, scene_to_json

PARTS = {
    "table_lamp": ("base", "stem", "shade", "bulb"),
    "nightstand": ("body", "drawers", "handles", "legs"),
    "door": ("frame", "leaf", "handle"),
    "window": ("frame", "sill", "pane", "handle"),
}


def parts_of(category: str) -> tuple[Part, ...]:
    return tuple(Part(name=name, material="glass" if name == "pane" else "paint") for name in PARTS[category])


def make_opening(number: int, category: str, wall: int, sill: float) -> Opening:
    return Opening(
        id=number,
        category=category,  # type: ignore[arg-type]
        label=8 if category == "door" else 9,
        wall=wall,
        offset_m=1.0,
        sill_m=sill,
        width_m=0.9,
        height_m=1.2 if sill else 2.0,
        model=ModelReference(generator=category, seed=3),
        parts=parts_of(category),
    )


def make_object(
    number: int, category: str, size: tuple[float, float, float], position: tuple[float, float, float], yaw: float
) -> SceneObject:
    return SceneObject(
        id=number,
        category=category,
        label={"table_lamp": 35, "nightstand": 32}[category],
        size_m=size,
        position_m=position,
        yaw_rad=yaw,
        support=Support(kind="floor"),
        model=ModelReference(generator=category, seed=number),
        parts=parts_of(category),
    )


def make_scene() -> SceneDescription:
    room = Room(
        polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)),
        height_m=2.5,
        wall_thickness_m=0.15,
        openings=(make_opening(1, "door", 0, 0.0), make_opening(2, "window", 2, 0.9)),
        surfaces=tuple(Part(name=name, material="paint") for name in ("floor", "wall", "ceiling", "skirting")),
    )
    objects = (
        make_object(3, "nightstand", (0.4, 0.5, 0.5), (1.0, 1.0, 0.0), 0.5 * math.pi),
        make_object(4, "table_lamp", (0.25, 0.25, 0.45), (1.0, 1.0, 0.5), 0.3),
    )
    return SceneDescription(
        schema="scene_synth/1",
        id="test-room",
        index=0,
        seed=1,
        category="bedroom",
        room=room,
        objects=objects,
        materials=(
            Material(id="paint", family="wall_paint", base_color=(0.7, 0.6, 0.5), roughness=0.9),
            Material(id="glass", family="glass", base_color=(1.0, 1.0, 1.0), roughness=0.0, transmission=0.9),
        ),
        lights=(Light(object=4, part="shade", flux_lm=500.0, color_temperature_k=2700.0, color=(1.0, 0.7, 0.4)),),
        environment=Environment(zenith=(1.0, 2.0, 3.0), horizon=(4.0, 5.0, 6.0), ground=(0.1, 0.2, 0.3)),
        camera_path=(CameraPose(stamp_ns=0, position_m=(2.0, 1.5, 1.4), orientation=(0.0, 0.0, 0.0, 1.0)),),
        parse_graph=ParseGraph(nodes=(), log_probability=0.0, energies={}, weights={}, energy=0.0),
        validity=ValidityReport(valid=True, attempts=1, checks=()),
    )


def with_file(scene: SceneDescription, file: str, parts: tuple[str, ...]) -> SceneDescription:
    thing = replace(scene.objects[0], model=ModelReference(file=file), parts=tuple(Part(name=name, material="paint") for name in parts))
    return replace(scene, objects=(thing, *scene.objects[1:]))


def test_a_room_without_a_material_for_skirting_has_none() -> None:
    scene = make_scene()
    bare = replace(scene, room=replace(scene.room, surfaces=scene.room.surfaces[:3]))
    assert set(flatten(scene).part_names) - set(flatten(bare).part_names) == {"0/skirting"}
    assert scene_from_json(scene_to_json(bare)) == bare
    with pytest.raises(FlattenError, match="expected a material for surface 'ceiling'"):
        flatten(replace(scene, room=replace(scene.room, surfaces=scene.room.surfaces[:2])))


def test_tables_name_every_part() -> None:
    scene = make_scene()
    flat = flatten(scene)
    expected = [f"0/{name}" for name in ("floor", "wall", "ceiling", "skirting")]
    expected += [f"1/{name}" for name in PARTS["door"]] + [f"2/{name}" for name in PARTS["window"]]
    expected += [f"3/{name}" for name in PARTS["nightstand"]] + [f"4/{name}" for name in PARTS["table_lamp"]]
    assert sorted(flat.part_names) == sorted(expected)
    row = {name: i for i, name in enumerate(flat.part_names)}
    assert [flat.parts.label[row[f"0/{name}"]] for name in ("wall", "floor", "ceiling", "skirting")] == [1, 2, 22, 1]
    assert [flat.parts.label[row[name]] for name in ("1/leaf", "2/frame", "3/body", "4/base")] == [8, 9, 32, 35]
    assert [flat.parts.object_id[row[name]] for name in ("0/wall", "1/leaf", "2/pane", "3/body", "4/base")] == [0, 1, 2, 3, 4]
    assert np.flatnonzero(flat.parts.portal).tolist() == [row["2/pane"]]
    assert flat.materials.transmission[flat.parts.material[row["2/pane"]]] == np.float32(0.9)
    assert np.allclose(flat.materials.base_color, [(0.7, 0.6, 0.5), (1.0, 1.0, 1.0)])
    assert np.allclose(flat.sky.horizon, (4.0, 5.0, 6.0)) and flat.sky.ground.dtype == np.float32
    assert len(flat.face_part) == len(flat.mesh.faces) and set(np.unique(flat.face_part)) == set(range(len(expected)))


def test_objects_stand_where_they_are_placed() -> None:
    flat = flatten(make_scene())
    rows = [i for i, name in enumerate(flat.part_names) if name.startswith("3/")]
    points = flat.mesh.vertices[flat.mesh.faces[np.isin(flat.face_part, rows)]].reshape(-1, 3)
    assert np.allclose(points.min(axis=0), (0.75, 0.8, 0.0), atol=1e-3) and np.allclose(points.max(axis=0), (1.25, 1.2, 0.5), atol=1e-3)
    handles = flat.mesh.vertices[flat.mesh.faces[flat.face_part == flat.part_names.index("3/handles")]].reshape(-1, 3)
    assert handles[:, 1].min() > 1.1, "yaw of a quarter turn lets the front look along +y"
    pane = flat.mesh.vertices[flat.mesh.faces[flat.face_part == flat.part_names.index("2/pane")]].reshape(-1, 3)
    assert np.allclose(pane.min(axis=0)[[0, 2]], (2.1, 0.9), atol=0.01) and np.allclose(pane.max(axis=0)[[0, 2]], (3.0, 2.1), atol=0.01)
    assert 3.0 < pane[:, 1].min() <= pane[:, 1].max() < 3.15


def test_emission_carries_the_flux() -> None:
    scene = make_scene()
    flat = flatten(scene)
    shade = flat.part_names.index("4/shade")
    a, b, c = np.moveaxis(flat.mesh.vertices[flat.mesh.faces[flat.face_part == shade]].astype(np.float64), 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    emission = flat.parts.emission[shade].astype(np.float64)
    assert math.pi * area * (emission @ (0.2126, 0.7152, 0.0722)) == pytest.approx(500.0, rel=1e-4)
    assert emission / emission[0] == pytest.approx((1.0, 0.7, 0.4), rel=1e-5)
    assert np.flatnonzero(flat.parts.emission.any(axis=1)).tolist() == [shade]
    # What shines reflects nothing, or more than the flux would leave it.
    assert np.flatnonzero(flat.absorbs).tolist() == [shade]
    look = build_surfaces(flat).materials.reshape(-1, st.ROW_SIZE)[shade]
    assert not look[st.BASE : st.BASE + 3].any() and look[st.IOR] == 1.0
    assert np.array_equal(look[st.EMISSION : st.EMISSION + 3], flat.parts.emission[shade])
    off = replace(scene, lights=(replace(scene.lights[0], on=False),))
    assert not flatten(off).parts.emission.any()


def test_same_scene_same_bytes() -> None:
    first, again = flatten(make_scene()), flatten(make_scene())
    assert first.part_names == again.part_names
    for one, other in ((first.mesh, again.mesh), (first.parts, again.parts), (first.materials, again.materials), (first.sky, again.sky)):
        assert [array.tobytes() for array in one] == [array.tobytes() for array in other]
    assert first.face_part.tobytes() == again.face_part.tobytes()


def test_faults_are_named_in_one_line() -> None:
    scene = make_scene()
    thing, door = scene.objects[0], scene.room.openings[0]

    def objects(changed: SceneObject) -> SceneDescription:
        return replace(scene, objects=(changed, scene.objects[1]))

    cases = {
        r"object 3 \(nightstand\): expected one of the generators .*'bed'.*, got 'throne'": objects(
            replace(thing, model=ModelReference(generator="throne"))
        ),
        r"object 3 \(nightstand\): expected style .*'shelf'.*, got 'rococo'": objects(
            replace(thing, model=ModelReference(generator="nightstand", style="rococo"))
        ),
        r"object 3 \(nightstand\): expected materials .*got none for 'legs'": objects(replace(thing, parts=thing.parts[:-1])),
        r"object 3 \(nightstand\): expected the id of one of the scene's 2 materials, got 'gold'": objects(
            replace(thing, parts=(*thing.parts[:-1], Part(name="legs", material="gold")))
        ),
        r"object 3 \(nightstand\): expected a catalogue folder": with_file(scene, "a.glb", ("a",)),
        r"object 4 \(table_lamp\): expected its light in one of the parts .*, got 'halo'": replace(
            scene, lights=(replace(scene.lights[0], part="halo"),)
        ),
        r"light of object 4, part 'shade': expected a colour, got black": replace(
            scene, lights=(replace(scene.lights[0], color=(0.0, 0.0, 0.0)),)
        ),
        r"door 1: expected one of the generators 'door', 'garage_door', 'window', got 'gate'": replace(
            scene, room=replace(scene.room, openings=(replace(door, model=ModelReference(generator="gate")),))
        ),
        r"door 1: expected style .*, got 'barn'": replace(
            scene, room=replace(scene.room, openings=(replace(door, model=ModelReference(generator="door", style="barn")),))
        ),
        r"room: expected a material for surface 'ceiling'": replace(
            scene, room=replace(scene.room, surfaces=tuple(part for part in scene.room.surfaces if part.name != "ceiling"))
        ),
    }
    for text, faulty in cases.items():
        with pytest.raises(FlattenError, match=text) as caught:
            flatten(faulty)
        assert "\n" not in str(caught.value)


def write_chair(path: Path) -> None:
    """A GLB of two nodes, y up and front +z as the standard says: a seat, and a back behind it."""
    seat = trimesh.creation.box((0.5, 0.1, 0.4))
    back = trimesh.creation.box((0.5, 0.6, 0.05))
    back.apply_translation((0.0, 0.35, -0.175))
    scene = trimesh.Scene()
    scene.add_geometry(seat, node_name="seat", geom_name="seat")
    scene.add_geometry(back, node_name="back rest", geom_name="back")
    path.write_bytes(scene.export(file_type="glb"))


def test_user_files_are_fitted_to_their_box_with_nodes_as_parts(tmp_path: Path) -> None:
    write_chair(tmp_path / "chair.glb")
    parts = load_mesh_file(find_mesh_file(tmp_path, "chair.glb"), tmp_path, (0.8, 1.0, 2.0))
    assert set(parts) == {"seat", "back_rest"}
    points = np.concatenate([mesh.vertices for mesh in parts.values()])
    assert np.allclose(points.min(axis=0), (-0.4, -0.5, 0.0), atol=1e-5) and np.allclose(points.max(axis=0), (0.4, 0.5, 2.0), atol=1e-5)
    assert parts["back_rest"].vertices[:, 0].max() < -0.2, "the back lies behind: front +z of the file is +x here"
    flat = flatten(with_file(make_scene(), "chair.glb", ("seat", "back_rest")), tmp_path)
    assert {"3/seat", "3/back_rest"} <= set(flat.part_names)


@pytest.mark.parametrize("kind", ["obj", "ply", "stl"])
def test_other_formats(tmp_path: Path, kind: str) -> None:
    trimesh.creation.box((1.0, 1.0, 1.0)).export(tmp_path / f"box.{kind}")
    (mesh,) = load_mesh_file(tmp_path / f"box.{kind}", tmp_path, (1.0, 2.0, 3.0)).values()
    assert np.allclose(mesh.vertices.max(axis=0), (0.5, 1.0, 3.0)) and len(mesh.faces) == 12


def test_paths_out_of_the_catalogue_are_refused(tmp_path: Path) -> None:
    catalog, outside = tmp_path / "catalog", tmp_path / "outside"
    catalog.mkdir()
    outside.mkdir()
    write_chair(outside / "chair.glb")
    (catalog / "link.glb").symlink_to(outside / "chair.glb")
    (catalog / "folder").symlink_to(outside)
    for file in ("link.glb", "folder/chair.glb", "../outside/chair.glb"):
        with pytest.raises(FlattenError, match="leads out of"):
            flatten(with_file(make_scene(), file, ("seat",)), catalog)
    with pytest.raises(FlattenError, match="absolute"):
        flatten(with_file(make_scene(), str(outside / "chair.glb"), ("seat",)), catalog)
    with pytest.raises(FlattenError, match="found none"):
        flatten(with_file(make_scene(), "nowhere.glb", ("seat",)), catalog)


def test_files_that_refer_outside_are_refused(tmp_path: Path) -> None:
    catalog = tmp_path / "catalog"
    catalog.mkdir()
    files = trimesh.Scene(trimesh.creation.box()).export(file_type="gltf")
    text = files.pop("model.gltf").decode()
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
        (catalog / name).write_bytes(data)
    (catalog / "fine.gltf").write_text(text)
    (mesh,) = load_mesh_file(catalog / "fine.gltf", catalog, (1.0, 1.0, 1.0)).values()
    assert len(mesh.faces) == 12
    (catalog / "escape.gltf").write_text(text.replace("gltf_buffer", "../gltf_buffer"))
    with pytest.raises(MeshFileError, match="inside the catalogue"):
        load_mesh_file(catalog / "escape.gltf", catalog, (1.0, 1.0, 1.0))


def test_broken_files_are_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "noise.glb").write_bytes(bytes(range(256)) * 8)
    (tmp_path / "empty.obj").write_text("# nothing\n")
    (tmp_path / "nan.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "model.fbx").write_bytes(b"x")
    with (tmp_path / "huge.stl").open("wb") as stream:
        stream.truncate(MAX_FILE_BYTES + 1)
    for name, text in {
        "noise.glb": "a GLB of version 2",
        "empty.obj": "obj",
        "nan.obj": "nan.obj",
        "model.fbx": "got 'fbx'",
        "huge.stl": "at most",
    }.items():
        with pytest.raises(MeshFileError, match=text) as caught:
            load_mesh_file(tmp_path / name, tmp_path, (1.0, 1.0, 1.0))
        assert "\n" not in str(caught.value)
