"""Run profiles and overrides."""

import argparse
import re
from pathlib import Path

import pytest
import yaml

from scene_description import SceneSynthError
from scene_description.share import config_path
from scene_synth_ros.cli.commands import run_command
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters, run_words
from scene_synth_ros.cli.parameters.run_profile import (
    NodeParameters,
    ProfileError,
    apply_overrides,
    find_profile,
    load_profile,
    with_namespace,
    write_node_file,
)
from scene_synth_ros.offline.settings import read_settings
from scene_synth_ros.suite.parameters import ParameterError

GOOD = """
/**: {ros__parameters: {exit_when_done: true}}
/**/grammar_node: {ros__parameters: {rooms: 3, scene: {room_type: bedroom}}}
renderer_node: {ros__parameters: {camera.width: 320}}
"""


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "run.yaml"
    path.write_text(text)
    return path


def test_nodes_wildcards_and_nesting(tmp_path: Path) -> None:
    parameters = load_profile(write(tmp_path, GOOD))
    assert parameters["grammar_node"] == {"exit_when_done": True, "rooms": 3, "scene.room_type": "bedroom"}
    assert parameters["renderer_node"] == {"exit_when_done": True, "camera.width": 320}
    assert parameters["recorder_node"] == {"exit_when_done": True}


def test_overrides_win_and_are_read_as_yaml(tmp_path: Path) -> None:
    base = load_profile(write(tmp_path, GOOD))
    parameters = apply_overrides(
        base, ["grammar_node.rooms:=5", "renderer_node.render.exposure_ev100:=7.5", "recorder_node.exclude:=['/a', '/b']"]
    )
    assert parameters["grammar_node"]["rooms"] == 5
    assert parameters["renderer_node"]["render.exposure_ev100"] == 7.5
    assert parameters["recorder_node"]["exclude"] == ["/a", "/b"]
    assert base["grammar_node"]["rooms"] == 3


@pytest.mark.parametrize("turn", [1, -1])
def test_values_that_only_fit_together_may_be_given_in_either_order(turn: int) -> None:
    """3.3 rad is too wide for a pinhole, which the model is unless it is told, too."""
    lens = ("renderer_node.camera.model:=kannala_brandt", "renderer_node.camera.horizontal_fov_rad:=3.3")
    settings = read_settings(run_parameters(RunWords(overrides=lens[::turn], record=Path("bag"))), "/synth")
    (groups,) = settings.renderers.values()
    assert (groups["camera"].model, groups["camera"].horizontal_fov_rad) == ("kannala_brandt", 3.3)
    with pytest.raises(ParameterError, match="horizontal_fov_rad"):
        read_settings(run_parameters(RunWords(overrides=lens[1:], record=Path("bag"))), "/synth")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [1", "expected YAML"),
        ("- 1", "expected node names with ros__parameters below, got list"),
        ("gramar_node: {ros__parameters: {}}", "unknown node 'gramar_node'; known: grammar_node"),
        ("grammar_node: {rooms: 3}", "grammar_node: expected one key ros__parameters"),
        ("grammar_node: {ros__parameters: {rooms: }}", "rooms: expected a value, got nothing"),
    ],
)
def test_bad_profiles_are_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ProfileError, match=message) as caught:
        load_profile(write(tmp_path, text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["nowhere.yaml", "nowhere", "runs/nowhere", "presets/kinect_v1", "../stream", "stream.txt", ""])
def test_a_missing_profile_is_named_with_those_that_exist(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ProfileError, match=rf"^{re.escape(str(Path(name)))}: .*(expected a parameter file, or .* stream)"):
        load_profile(Path(name))


@pytest.mark.parametrize("name", ["kinect_v1", "cameras/kinect_v1", "kinect_v1.yaml", "config/cameras/kinect_v1.yaml"])
def test_shipped_files_go_by_their_names_from_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_profile(Path(name)) == config_path("cameras/kinect_v1.yaml")
    assert load_profile(Path(name))["renderer_node"]["camera.width"] == 640


def test_a_folder_does_not_hide_the_shipped_file_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "main").mkdir()
    (tmp_path / "rooms").mkdir()
    assert find_profile(Path("main")) == config_path("runs/main.yaml")
    with pytest.raises(ProfileError, match=r"^rooms: expected a parameter file, or the name of a shipped one: .*, got a folder$"):
        find_profile(Path("rooms"))


def test_a_file_of_the_user_goes_before_a_shipped_one_of_that_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("stream").write_text("/**/grammar_node:\n  ros__parameters:\n    seed: 77\n")
    assert load_profile(Path("stream"))["grammar_node"] == {"seed": 77}


@pytest.mark.parametrize(
    "override", ["rooms:=3", "grammar_node.rooms=3", "grammar_node.:=3", "king_node.rooms:=3", "grammar_node.rooms:=["]
)
def test_bad_overrides_are_refused(override: str) -> None:
    with pytest.raises(ProfileError, match="-p "):
        apply_overrides({"grammar_node": {}}, [override])


def test_node_files_are_what_ros_reads(tmp_path: Path) -> None:
    write_node_file(tmp_path / "node.yaml", {"camera.width": 320})
    assert yaml.safe_load((tmp_path / "node.yaml").read_text()) == {"/**": {"ros__parameters": {"camera.width": 320}}}


@pytest.mark.parametrize("name", ["main.yaml", "live.yaml"])
def test_shipped_profiles_load(name: str) -> None:
    assert load_profile(config_path(f"runs/{name}"))["grammar_node"]


def parameters_of(arguments: argparse.Namespace) -> NodeParameters:
    return run_parameters(run_words(arguments, arguments.record))


def test_a_grammar_file_comes_with_its_room_type_and_is_checked_first(tmp_path: Path) -> None:
    parser = argparse.ArgumentParser()
    run_command.add_arguments(parser)
    file = config_path("grammars/kitchen.yaml")
    node = parameters_of(parser.parse_args(["--grammar", str(file)]))["grammar_node"]
    assert node["grammar_file"] == str(file.resolve()) and node["scene.room_type"] == "kitchen"
    assert "grammar_file" not in parameters_of(parser.parse_args([]))["grammar_node"]
    bad = tmp_path / "bad.yaml"
    bad.write_text("room_type: 7\n")
    with pytest.raises(SceneSynthError, match=r"bad\.yaml: .*expected"):
        parameters_of(parser.parse_args(["--grammar", str(bad)]))


def test_options_go_before_the_defaults_that_a_dump_carries(tmp_path: Path) -> None:
    parser = argparse.ArgumentParser()
    run_command.add_arguments(parser)
    old = "scene_synth.parameters={}"
    dumps = {
        "/synth/grammar_node": {"expected_recorders": 0, "expected_renderers": 1, "exit_when_done": False, "scene": {"must_have": []}},
        "/synth/recorder_node": {"bag": "another", "custom_data": ["by=me", old], "exit_when_done": False},
    }
    file = tmp_path / "dumps.yaml"
    file.write_text(yaml.safe_dump({node: {"ros__parameters": values} for node, values in dumps.items()}))
    words = ["--params", str(file), "--record", str(tmp_path / "bag"), "--rooms", "3", "--renderers", "2"]
    parameters = parameters_of(parser.parse_args(words))
    grammar, recorder = parameters["grammar_node"], parameters["recorder_node"]
    assert (grammar["expected_recorders"], grammar["expected_renderers"], grammar["exit_when_done"]) == (1, 2, True)
    assert grammar["scene.must_have"] == []
    assert recorder["bag"] == str(tmp_path / "bag") and recorder["exit_when_done"] is True
    note, replaced = recorder["custom_data"]
    assert note == "by=me" and replaced.startswith("scene_synth.parameters={") and replaced != old
    words = ["--params", str(file), "-p", "grammar_node.exit_when_done:=false", "--rooms", "3"]
    assert parameters_of(parser.parse_args(words))["grammar_node"]["exit_when_done"] is False


def test_a_namespace_of_its_own_stands_before_the_frames_unless_the_profile_says_otherwise() -> None:
    parameters = {node: {} for node in ("grammar_node", "renderer_node", "recorder_node")}
    assert with_namespace(parameters, "/synth") == parameters
    apart = with_namespace({**parameters, "grammar_node": {"world_frame": "world"}}, "/fleet/robot1")
    assert apart == {
        "grammar_node": {"world_frame": "world"},
        "renderer_node": {"streams.world_frame": "fleet/robot1/map", "streams.frame_prefix": "fleet/robot1/"},
        "recorder_node": {"frame_prefix": "fleet/robot1/"},
    }
