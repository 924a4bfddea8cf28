"""Commands that take a dataset of shards as they take a bag: every shard counts, in one process or several."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from dataset_bags import write_dataset

from evaluation.evaluation_file import read_evaluation
from scene_synth_ros.cli.command_line import main

PERFECT = ("--task", "depth", "--topic", "depth:=/synth/camera/depth/image_raw", "--by", "all")
HALF = """
def half(frame):
    return {"depth": frame.images["depth"] * 0.5}
half.inputs = ("depth",)
"""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dataset") / "rooms"
    write_dataset(folder, shards=3, layers=("color", "depth", "semantic"), size=(24, 32))
    return folder


def call(*words: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return int(ended.value.code or 0)


def test_evaluate_judges_every_shard_and_workers_change_nothing(dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("evaluate", dataset, *PERFECT, "--json", tmp_path / "one.json") == 0
    one = read_evaluation(tmp_path / "one.json")
    whole = one.summary[0]
    assert (whole.rooms, whole.frames, whole.metrics["abs_rel"].value) == (6, 18, 0.0)
    assert [Path(row.key.bag).name for row in one.frames] == [f"{shard:05d}" for shard in range(3) for _ in range(6)]
    assert call("evaluate", dataset, *PERFECT, "--json", tmp_path / "two.json", "--workers", "2") == 0
    assert json.loads((tmp_path / "two.json").read_text())["summary"] == json.loads((tmp_path / "one.json").read_text())["summary"]
    assert read_evaluation(tmp_path / "two.json").frames == one.frames


def test_an_algorithm_in_workers_writes_its_estimates_beside_each_other(dataset: Path, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(HALF)
    words = ["--task", "depth", "--algorithm", f"{tmp_path}/a.py:half", "--workers", "2"]
    assert call("evaluate", dataset, *words, "--estimates-out", tmp_path / "est", "--json", tmp_path / "e.json") == 0
    assert sorted(path.name for path in (tmp_path / "est").iterdir()) == ["00000", "00001", "00002"]
    assert call("evaluate", dataset, "--task", "depth", "--estimates", tmp_path / "est", "--json", tmp_path / "again.json") == 0
    assert read_evaluation(tmp_path / "again.json").summary == read_evaluation(tmp_path / "e.json").summary


@pytest.mark.parametrize("workers", ["1", "2"])
def test_inspect_adds_up_the_shards_and_names_a_damaged_one(
    dataset: Path, tmp_path: Path, workers: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("inspect", dataset, "--workers", workers) == 0
    told = capsys.readouterr().out
    assert "3 shards, " in told and "6 rooms" in told and told.endswith("no faults\n")
    assert "/synth/camera/depth/image_raw  sensor_msgs/msg/Image  18 messages" in told


def test_show_has_rooms_of_shards_that_are_evenly_spread(dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("show", dataset, "--out", tmp_path / "page.html", "--rooms", "2", "--frames", "1") == 0
    told = capsys.readouterr().out
    assert (
        "(2 of 4 rooms, 2 frames" in told.replace("2 of 12 frames", "2 frames") and "note: 2 of 3 shards are shown, evenly spread" in told
    )
    assert call("show", dataset, "--out", tmp_path / "all.html") == 0
    assert "(6 rooms, 18 frames, " in capsys.readouterr().out


def test_a_shard_that_cannot_be_read_is_a_fault_and_the_others_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_dataset(tmp_path / "rooms", shards=2, rooms=1, layers=("color",), size=(8, 8))
    (file,) = (tmp_path / "rooms" / "shards" / "00001").glob("*.mcap")
    file.unlink()
    assert call("inspect", tmp_path / "rooms") == 1
    told = capsys.readouterr().out
    assert "1 of 2 shards with faults" in told and "shards/00001" in told and "1 room\n" in told
    assert call("verify", tmp_path / "rooms") == 1
    told = capsys.readouterr().out
    assert told.count("fault: ") == 2 and "0 of 2 shards are the same" in told, "these have no settings, so cannot be rendered again"
