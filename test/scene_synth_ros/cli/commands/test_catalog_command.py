"""The user's catalogue: rooms with its models, sizes respected, materials kept or drawn, lamps, looks; the check's findings and status."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from glb_files import pack_glb, triangle_tree

from grammar.catalog import choose_after, choose_before
from grammar.spec.request import RequestError, SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer.files.catalog_check import look_at_top, open_edges
from renderer.files.file_parts import MeshFile
from renderer.files.mesh_files import read_mesh_file
from renderer.scene.flatten import flatten
from scene_description import FileReading, SceneDescription, SceneSynthError, scene_from_json, scene_to_json
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.synthesize.catalogs import check_catalog, with_catalog

TIMES = CameraTimes(frames=1, start_ns=0, rate_hz=10.0)
PLAIN = SceneSynthesizer.from_config()


def write_table(path: Path, size: tuple[float, float, float], rim: float = 0.0) -> None:
    """A z-up table of a top and a foot, ``size`` metres; with ``rim``, a post of that height stands on it."""
    depth, width, height = size
    scene = trimesh.Scene()
    top = trimesh.creation.box((depth, width, 0.04))
    top.apply_translation((0, 0, height - 0.02))
    foot = trimesh.creation.box((0.3 * depth, 0.3 * width, height - 0.04))
    foot.apply_translation((0, 0, 0.5 * (height - 0.04)))
    material = trimesh.visual.material.PBRMaterial(
        name="teal", baseColorFactor=[0, 128, 128, 255], metallicFactor=0.0, roughnessFactor=0.25
    )
    for name, mesh in (("Top", top), ("Foot", foot)):
        mesh.visual = trimesh.visual.TextureVisuals(material=material)
        scene.add_geometry(mesh, node_name=name)
    if rim:
        post = trimesh.creation.box((0.05, 0.05, rim))
        post.apply_translation((0.4 * depth, 0.4 * width, height + 0.5 * rim))
        scene.add_geometry(post, node_name="Post")
    path.write_bytes(scene.export(file_type="glb"))


def make_catalog(folder: Path, text: str) -> Path:
    folder.mkdir(exist_ok=True)
    write_table(folder / "table.glb", (0.44, 0.5, 0.55))
    (folder / "catalog.yaml").write_text(text)
    return folder


def rooms(synthesizer: SceneSynthesizer, count: int, **asked: object) -> list[SceneDescription]:
    request = SceneRequest(**asked)  # type: ignore[arg-type]
    return [synthesizer.synthesize(request, 4, index, TIMES) for index in range(count)]


NIGHTSTAND = "{file: table.glb, category: nightstand, front: +x, up: +z"


def test_fixed_sizes_and_file_materials(tmp_path: Path) -> None:
    folder = make_catalog(tmp_path, f"procedural: {{nightstand: 0}}\nmodels: [{NIGHTSTAND}, scale: fixed}}]\n")
    scenes = rooms(with_catalog(PLAIN, str(folder)), 2, must_have=("nightstand",))
    for scene in scenes:
        stands = [thing for thing in scene.objects if thing.category == "nightstand"]
        assert stands and scene.validity.valid
        for thing in stands:
            assert thing.model.file == "table.glb" and thing.model.generator is None
            assert np.allclose(thing.size_m, (0.44, 0.5, 0.55), atol=1e-6)
            assert {part.name for part in thing.parts} == {"Top", "Foot"}
            (material,) = {item for item in scene.materials for part in thing.parts if item.id == part.material}
            assert material.family == "file" and material.roughness == 0.25 and np.allclose(material.base_color, (0, 128 / 255, 128 / 255))
        back = scene_from_json(scene_to_json(scene))
        assert back == scene
    flat = flatten(scenes[0], folder)
    row = flat.part_names.index(f"{next(t.id for t in scenes[0].objects if t.category == 'nightstand')}/Top")
    assert flat.materials.roughness[flat.parts.material[row]] == 0.25


def test_uniform_scale_keeps_proportions(tmp_path: Path) -> None:
    folder = make_catalog(tmp_path, f"procedural: {{nightstand: 0}}\nmodels: [{NIGHTSTAND}, unit_m: 10, scale: uniform}}]\n")
    sizes = set()
    for scene in rooms(with_catalog(PLAIN, str(folder)), 2, must_have=("nightstand",)):
        for thing in scene.objects:
            if thing.category == "nightstand":
                assert np.allclose(np.array(thing.size_m) / thing.size_m[2], (0.44 / 0.55, 0.5 / 0.55, 1.0), atol=1e-9)
                assert 0.3 < thing.size_m[2] < 0.7, "a file in decimetres is scaled to the sizes of the grammar"
                sizes.add(thing.size_m)
    assert len(sizes) == 2, "drawn for each room"


def test_materials_are_drawn_where_asked(tmp_path: Path) -> None:
    families = "families: {Top: {metal: 1}, '*': {wood: 1}}"
    folder = make_catalog(tmp_path, f"procedural: {{nightstand: 0}}\nmodels: [{NIGHTSTAND}, materials: sample, {families}}}]\n")
    (scene,) = rooms(with_catalog(PLAIN, str(folder)), 1, must_have=("nightstand",))
    families_of = {item.id: item.family for item in scene.materials}
    (thing, *_) = (thing for thing in scene.objects if thing.category == "nightstand")
    assert {part.name: families_of[part.material] for part in thing.parts} == {"Top": "metal", "Foot": "wood"}


def test_odds_beside_procedural_styles(tmp_path: Path) -> None:
    """With odds 3 against 1, three quarters of 400 draws, within four deviations."""
    folder = make_catalog(tmp_path, f"models: [{NIGHTSTAND}, odds: 3}}]\n")
    synthesizer = with_catalog(PLAIN, str(folder))
    (scene,) = rooms(PLAIN, 1, must_have=("nightstand",))
    bare = [thing for thing in scene.objects if thing.category == "nightstand"][:1]
    taken = 0
    for seed in range(400):
        rng = np.random.default_rng(seed)
        models = choose_before(rng, synthesizer.catalog, PLAIN.appearance, PLAIN.grammars["bedroom"], PLAIN.categories)
        assert not models.chosen, "what stretches is chosen after the layout"
        taken += len(choose_after(rng, synthesizer.catalog, PLAIN.appearance, models, bare)[1])
    assert abs(taken - 300) < 4 * np.sqrt(400 * 0.75 * 0.25)


def test_tops_of_its_own_carry_things(tmp_path: Path) -> None:
    """The model's top lies at 0.55 m of 0.75 m: what stands on it stands there."""
    folder = make_catalog(
        tmp_path, f"procedural: {{nightstand: 0}}\nmodels: [{NIGHTSTAND}, scale: fixed, surfaces: [{{height_m: 0.55, inset_m: 0.02}}]}}]\n"
    )
    write_table(folder / "table.glb", (0.44, 0.5, 0.55), rim=0.2)
    carried = 0
    for scene in rooms(with_catalog(PLAIN, str(folder)), 3, must_have=("nightstand", "table_lamp"), grammar_set="by_hand"):
        stands = {thing.id for thing in scene.objects if thing.category == "nightstand"}
        for thing in scene.objects:
            if thing.support.id in stands:
                carried += 1
                assert thing.position_m[2] == pytest.approx(0.55, abs=1e-6)
    assert carried > 0


def test_nothing_changes_without_models_of_a_room(tmp_path: Path) -> None:
    folder = make_catalog(tmp_path, "models: [{file: table.glb, category: workbench, front: +x, up: +z}]\n")
    assert rooms(with_catalog(PLAIN, str(folder)), 1) == rooms(PLAIN, 1)


def test_looks_reach_the_parts_of_files(tmp_path: Path) -> None:
    folder = make_catalog(tmp_path, f"procedural: {{nightstand: 0}}\nmodels: [{NIGHTSTAND}}}]\n")
    synthesizer = with_catalog(PLAIN, str(folder))
    (scene,) = rooms(synthesizer, 1, must_have=("nightstand",), looks=("nightstand/Top: {base_color: [1, 0, 0]}",))
    table = {item.id: item for item in scene.materials}
    tops = [table[part.material] for thing in scene.objects for part in thing.parts if part.name == "Top"]
    assert tops and all(item.base_color == (1.0, 0.0, 0.0) and item.roughness == 0.25 for item in tops)
    with pytest.raises(RequestError, match="expected a part of nightstand"):
        PLAIN.check(SceneRequest(looks=("nightstand/Top: {roughness: 1}",)))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("models: []\n", "at least 1 items"),
        ("models: [{file: ../table.glb, category: nightstand}]\n", "inside the catalogue"),
        ("models: [{file: /etc/passwd, category: nightstand}]\n", "inside the catalogue"),
        ("models: [{file: table.glb, category: spaceship}]\n", "got 'spaceship'"),
        ("models: [{file: table.glb, category: table_lamp, front: +x, up: +z}]\n", "'shade' that shines"),
        ("models: [{file: none.glb, category: nightstand}]\n", "found none"),
        ("models: [{file: table.glb, category: nightstand, materials: sample}]\n", "families for the parts"),
        ("models: [{file: table.glb, category: nightstand, families: {Top: {gold: 1}}}]\n", "got 'gold'"),
        ("models: [{file: table.glb, category: nightstand, unit_m: 1000}]\n", "state unit_m"),
        ("models: [{file: table.glb, category: nightstand, colour: red}]\n", "an unknown key"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(tmp_path: Path, text: str, reason: str) -> None:
    folder = make_catalog(tmp_path, text)
    with pytest.raises(SceneSynthError, match=reason) as caught:
        with_catalog(PLAIN, str(folder))
    assert "\n" not in str(caught.value)


def test_the_check_names_each_fault(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = make_catalog(
        tmp_path,
        "models:\n"
        "  - {file: table.glb, category: nightstand, front: +x, up: +z, scale: fixed}\n"
        "  - {file: post.glb, category: nightstand, front: +x, up: +z, scale: fixed}\n"
        "  - {file: triangle.glb, category: vase, rename: {nothing: handle}, unit_m: 0.1}\n"
        "  - {file: inside.stl, category: pouf, front: +x}\n"
        "  - {file: none.glb, category: vase}\n"
        "  - {file: table.glb, category: bed, front: +x, up: +z, scale: fixed}\n",
    )
    write_table(folder / "post.glb", (0.44, 0.5, 0.55), rim=0.2)
    (folder / "triangle.glb").write_bytes(pack_glb(triangle_tree()[0], bytes(triangle_tree()[1])))
    box = trimesh.creation.box((0.5, 0.5, 0.5))
    box.invert()
    box.export(folder / "inside.stl")
    texts: dict[str, list[str]] = {}
    for item in check_catalog(PLAIN, folder):
        texts.setdefault(item.file, []).append(("error: " if item.error else "") + item.text)
    assert not any("top" in text for text in texts["table.glb"])
    assert any("only" in text and "0.550" in text for text in texts["post.glb"]), "the real top is told"
    assert any("not watertight" in text for text in texts["triangle.glb"])
    assert any("front is not stated" in text for text in texts["triangle.glb"])
    assert any("no part became handle" in text for text in texts["triangle.glb"])
    assert any("look inwards" in text for text in texts["inside.stl"])
    assert any(text.startswith("error: ") and "found none" in text for text in texts["none.glb"])
    assert any("own size is implausible" in text for text in texts["table.glb"]), "a bed of half a metre"
    with pytest.raises(SystemExit) as ended:
        main(["catalog", "check", str(folder)])
    assert ended.value.code == 1 and "6 models, 1 errors" in capsys.readouterr().out
    make_catalog(tmp_path, f"models: [{NIGHTSTAND}, scale: fixed}}]\n")
    with pytest.raises(SystemExit) as ended:
        main(["catalog", "check", str(folder), "--strict"])
    assert ended.value.code == 0 and "table.glb: fine" in capsys.readouterr().out


def read(path: Path) -> MeshFile:
    return read_mesh_file(path, path.parent, FileReading(split="none"))


def test_open_edges_and_tops_are_counted(tmp_path: Path) -> None:
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    box.export(tmp_path / "box.stl")
    mesh = read(tmp_path / "box.stl").parts["body"].mesh
    assert open_edges(mesh) == 0
    assert open_edges(mesh._replace(faces=mesh.faces[1:])) == 3
    seen = look_at_top(mesh, np.array([-0.5, -0.5]), np.array([1.5, 0.5]), 0.5, 0.01)
    assert seen.cover == pytest.approx(0.5, abs=0.02) and seen.level_m == pytest.approx(0.5, abs=0.01)
