"""``scene_synth truth``: the files of a scene and of a bag, read by other libraries, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from nav2_map import read_nav2_map
from room_bag import write_room_bag
from sample_scene import sample_scene

from renderer.scene.flatten import flatten
from scene_description import ParseGraph, from_mapping, scene_from_json, scene_to_json
from scene_description.label_standards import STANDARDS
from scene_description.labels import NYU40, part_ids
from scene_description.tum_trajectory import trajectory_from_tum
from scene_synth_ros.cli.command_line import main

FILES = [
    "labels.json", "lights.json", "map.pgm", "map.yaml", "parse_graph.json", "parse_graph.svg", "scene.glb", "scene.json", "trajectory.txt",
]  # fmt: skip


def call(*words: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return int(ended.value.code or 0)


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("truth")
    (folder / "scene.json").write_text(scene_to_json(sample_scene()))
    assert call("truth", folder / "scene.json", "--out", folder / "out") == 0
    return folder / "out"


def test_the_folder_has_every_file(truth: Path) -> None:
    assert sorted(path.name for path in truth.iterdir()) == FILES
    assert [path.name for path in truth.parent.iterdir() if path.name.startswith(".")] == []
    assert scene_from_json((truth / "scene.json").read_text()) == sample_scene()


def test_trajectory_parse_graph_and_picture_read_back(truth: Path) -> None:
    scene = sample_scene()
    poses = trajectory_from_tum((truth / "trajectory.txt").read_text())
    assert [(pose.stamp_ns, pose.position_m) for pose in poses] == [(pose.stamp_ns, pose.position_m) for pose in scene.camera_path]
    assert from_mapping(ParseGraph, json.loads((truth / "parse_graph.json").read_text())) == scene.parse_graph
    assert ElementTree.parse(truth / "parse_graph.svg").getroot().tag.endswith("svg")


def test_trimesh_reads_the_ids_of_every_part(truth: Path) -> None:
    scene = sample_scene()
    flat, ids = flatten(scene), part_ids(scene)
    loaded = trimesh.load_scene(truth / "scene.glb")
    told = [data.get("metadata", {}) for data in loaded.graph.transforms.edge_data.values()]
    found = {extras["part_id"]: extras for extras in told if "part_id" in extras}
    assert found.keys() == {ids[name] for name in flat.part_names}
    for row, name in enumerate(flat.part_names):
        extras = found[ids[name]]
        assert (extras["id"], extras["part"]) == (int(flat.parts.object_id[row]), name.partition("/")[2])
        assert extras["label"] == int(flat.parts.label[row]) and extras["label_name"] == NYU40[extras["label"]].name
        assert scene.materials[extras["material_id"] - 1].id == extras["material"]


def test_labels_tell_every_id_and_its_class_in_every_standard(truth: Path) -> None:
    scene, labels = sample_scene(), json.loads((truth / "labels.json").read_text())
    assert set(labels["objects"]) == {"0", "1", "2", "3", "4", "5", "6"} and set(labels["standards"]) == set(STANDARDS)
    assert labels["objects"]["3"]["classes"] == {"nyu40": 4, "nyu13": 1, "scannet20": 4, "ade20k": 8, "coco": 65}
    assert labels["surfaces"]["ceiling"]["classes"]["ade20k"] == 6
    for thing in [*labels["objects"].values(), *labels["surfaces"].values()]:
        for name, key in thing.get("classes", {}).items():
            assert str(key) in labels["standards"][name]
    ids = part_ids(scene)
    assert {int(key) for key in labels["parts"]} == set(ids.values())
    assert labels["parts"][str(ids["4/handles"])] == {"object": 4, "part": "handles", "material": 4}
    assert labels["materials"]["4"]["name"] == "brass"


def test_lists_of_numbers_stand_on_one_line(truth: Path) -> None:
    text = (truth / "lights.json").read_text()
    assert '"color": [1.0, 0.42, 0.1],' in text and json.loads(text)["lamps"][0]["flux_lm"] == 400.0


def test_a_bag_has_a_folder_for_each_room_with_its_own_map_and_poses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_room_bag(tmp_path / "bag", rooms=2, frames=3, size=(6, 8), layers=("depth",))
    assert call("truth", bag.path, "--out", tmp_path / "out") == 0
    assert "2 rooms, 20 files" in capsys.readouterr().out
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["room_0000", "room_0001"]
    for folder, scene in zip(sorted((tmp_path / "out").iterdir()), bag.scenes, strict=True):
        assert sorted(path.name for path in folder.iterdir()) == sorted([*FILES, "trajectory_camera.txt"])
        assert scene_from_json((folder / "scene.json").read_text()) == scene
        found = read_nav2_map(folder / "map.yaml")  # what the bag has, not what would be computed
        assert (found.width, found.height, found.resolution, found.origin) == (8, 7, 0.5, (0.0, 0.0, 0.0)) and not found.data.any()
        for name in ("trajectory.txt", "trajectory_camera.txt"):
            poses = trajectory_from_tum((folder / name).read_text())
            assert [pose.stamp_ns for pose in poses] == [pose.stamp_ns for pose in scene.camera_path]
            assert np.allclose([pose.position_m for pose in poses], [pose.position_m for pose in scene.camera_path])


def test_what_cannot_be_done_says_why_and_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, out = tmp_path / "scene.json", tmp_path / "out"
    scene.write_text(scene_to_json(replace(sample_scene(), category="waiting_room")))
    assert call("truth", scene, "--out", out) == 2 and "--grammar FILE" in capsys.readouterr().err
    assert call("truth", tmp_path / "bag", "--out", out) == 2 and "not found" in capsys.readouterr().err
    assert call("truth", scene, "--out", tmp_path / "no" / "out") == 2 and "a folder that exists" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["scene.json"]
    out.mkdir()
    assert call("truth", scene, "--out", out) == 2 and "exists already" in capsys.readouterr().err


def test_a_run_writes_truth_beside_its_bag_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "--truth", "--rooms", "1") == 2 and "--truth: expected together with --record" in capsys.readouterr().err
    (tmp_path / "bag_truth").mkdir()
    assert call("run", "--truth", "--record", tmp_path / "bag") == 2 and "bag_truth exists already" in capsys.readouterr().err
