"""The command ``scene_synth sample``: its files, its report, the same bytes on any number of processes, one clear line for bad input."""

import csv
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from grammar import room_types
from scene_description import scene_from_json
from scene_synth_ros.cli.command_line import main

ROOT = Path(__file__).resolve().parents[4]


def sample(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["sample", *map(str, words)])
    return int(ended.value.code or 0)


def test_writes_every_kind_of_file_and_a_record_of_the_chain(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "rooms"
    code = sample("--room", "hallway", "--count", 2, "--seed", 4, "--frames", 4, "--chain", "--out", out, "-p", "max_objects:=9")
    assert code == 0
    names = [f"{base}_000{k}.{kind}" for k in (0, 1) for base, kind in
             (("chain", "csv"), ("chain", "png"), ("chain", "svg"), ("room", "json"), ("room", "png"), ("room", "svg"))]  # fmt: skip
    assert sorted(path.name for path in out.iterdir()) == sorted(names)
    scene = scene_from_json((out / "room_0001.json").read_text())
    assert scene.index == 1 and scene.category == "hallway" and len(scene.objects) <= 9 and len(scene.camera_path) == 4
    assert scene.camera_path[0].stamp_ns == 1_000_000_000 + 4 * 100_000_000
    with Image.open(out / "room_0001.png") as picture:
        assert picture.format == "PNG" and min(picture.size) > 200
    rows = list(csv.DictReader((out / "chain_0000.csv").open()))
    assert len(rows) > 50 and float(rows[-1]["total"]) >= 0.0
    assert "room_0001: hallway" in capsys.readouterr().out


def test_reports_named_metrics_over_all_room_types(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "rooms"
    assert (
        sample("--room", "all", "--count", len(room_types()) + 1, "--seed", 5, "--frames", 1, "--report", "--write", "json", "--out", out)
        == 0
    )
    printed = capsys.readouterr().out
    report = json.loads((out / "report.json").read_text())
    metrics = {metric["name"]: metric for metric in report["metrics"]}
    for name in ("Col_obj", "Col_scene", "R_out", "floating", "doors blocked", "windows blocked", "failures"):
        assert metrics[name]["value"] == 0.0 and metrics[name]["passed"] is True and metrics[name]["definition"] in printed
    assert metrics["R_walkable, least"]["value"] >= 0.95 and metrics["R_reach"]["value"] == 1.0
    for name in ("time p50", "time p99", "attempts", "proposals/s"):
        assert metrics[name]["value"] > 0.0
    assert set(report["room_types"]) == set(room_types()) and report["room_types"]["bathroom"]["rooms"] == 2
    assert sorted(path.suffix for path in out.iterdir()) == [".json"] * (len(room_types()) + 2)


def test_the_same_seed_gives_the_same_bytes_on_one_and_two_processes(tmp_path: Path) -> None:
    digests = []
    for workers, hash_seed in ((1, "1"), (2, "4242")):
        out = tmp_path / str(workers)
        words = ["--room", "hallway,bathroom", "--count", "3", "--seed", "9", "--frames", "2"]
        command = [sys.executable, "-m", "scene_synth_ros", "sample", *words]
        subprocess.run(
            [*command, "--workers", str(workers), "--write", "json,svg,png", "--out", str(out)],
            env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": hash_seed},
            check=True,
            capture_output=True,
            timeout=300,
        )
        digests.append({path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in out.iterdir()})
    assert len(digests[0]) == 9 and digests[0] == digests[1]


def test_takes_a_grammar_file_of_ones_own(tmp_path: Path) -> None:
    own = tmp_path / "den.yaml"  # what it extends is the file that comes with the program
    own.write_text(
        "extends: base.yaml\nroom_type: den\nroot: den\n"
        "room: {width_m: {mean: 3, sd: 0.1, low: 2.8, high: 3.2}, depth_m: {mean: 3, sd: 0.1, low: 2.8, high: 3.2},"
        " area_low_m2: 7, area_high_m2: 11}\n"
        "nodes: {den: {kind: and, branches: [{symbol: shelf}]}}\n"
        "objects: {shelf: {category: bookshelf, sizes: [{mean_m: [0.3, 0.8, 1.8], sd_m: [0.01, 0.01, 0.01]}],"
        " low_m: [0.2, 0.7, 1.7], high_m: [0.4, 0.9, 1.9], wall: [{distance_m: 0.01}]}}\n"
    )
    assert sample("--grammar", own, "--write", "json", "--frames", 1, "-p", "clutter:=0.0", "--out", tmp_path / "rooms") == 0
    scene = scene_from_json((tmp_path / "rooms/room_0000.json").read_text())
    assert scene.category == "den" and [thing.category for thing in scene.objects] == ["bookshelf"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--count", "0"], "--count: expected 1 to 10000000, got 0"),
        (["--room", "igloo"], "room_type: expected one of"),
        (["--write", "json,gif"], "--write: expected a list of json, svg, png, got 'gif'"),
        (["-p", "max_objects=3"], "-p max_objects=3: expected NAME:=VALUE"),
        (["-p", "max_objects:=0"], "max_objects: expected an integer in [1, 500], got 0"),
        (["-p", "colour:=red"], "colour: expected one of"),
        (["--grammar", "nowhere.yaml"], "nowhere.yaml: no such file or directory; check the path"),
    ],
)
def test_bad_options_end_in_one_line(words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sample(*words, "--out", tmp_path / "rooms") == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not (tmp_path / "rooms").exists()


def test_no_folder_is_written_over_and_none_is_needed_for_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sample("--out", tmp_path) == 2
    assert "exists already" in capsys.readouterr().err
    assert sample() == 2
    assert "--out: expected a new folder" in capsys.readouterr().err
    assert sample("--room", "hallway", "--report", "--frames", 1) == 0
    assert "Col_obj" in capsys.readouterr().out
