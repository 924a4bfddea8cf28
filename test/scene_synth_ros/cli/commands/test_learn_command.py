"""The command ``scene_synth learn`` from layout files to a grammar file."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from grammar import SceneRequest, read_categories, read_grammar
from grammar.learning import layout_line
from grammar.learning.write_layouts import layout_from_scene
from grammar.spec.energy_terms import TERMS
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description.share import config_path
from scene_synth_ros.cli.command_line import main


@pytest.fixture(scope="module")
def layouts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    synthesizer = SceneSynthesizer.from_config()
    times = CameraTimes(frames=1, start_ns=0, rate_hz=10.0)
    scenes = [synthesizer.synthesize(SceneRequest(max_objects=14), 5, index, times) for index in range(8)]
    file = tmp_path_factory.mktemp("layouts") / "rooms.jsonl"
    file.write_text("\n".join([*(layout_line(layout_from_scene(scene)) for scene in scenes), "{"]) + "\n", encoding="utf-8")
    return file


def test_learns_from_sampled_scenes(layouts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, curve = tmp_path / "learned.yaml", tmp_path / "curve.csv"
    with pytest.raises(SystemExit) as ended:
        options = ["--curve", str(curve), "--iterations", "2", "--corrections", "0", "--note", "Licence: mine."]
        main(["learn", str(layouts), "--out", str(out), *options])
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    assert "room: not JSON: 1 (lines 9)" in printed
    assert "6 rooms with" in printed
    text = out.read_text()
    assert "# Licence: mine.\n" in text
    assert "scene_synth learn rooms.jsonl --room bedroom --hold-out 0.2" in text
    grammar = read_grammar(out, read_categories(config_path("categories.yaml")))
    assert grammar.room_type == "bedroom"
    assert curve.read_text().count("\n") == 1 + 2 * len(TERMS)


def test_corrections_are_the_same_in_one_process_and_two(layouts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    texts, curves = [], []
    for workers in ("1", "2"):
        out, curve = tmp_path / f"{workers}.yaml", tmp_path / f"{workers}.csv"
        options = ["--iterations", "0", "--corrections", "1", "--rooms", "5", "--workers", workers, "--correction-curve", str(curve)]
        with pytest.raises(SystemExit) as ended:
            main(["learn", str(layouts), "--out", str(out), *options])
        assert ended.value.code == 0
        assert "corrections: round 1, 5 rooms sampled" in capsys.readouterr().out
        texts.append(out.read_text())
        curves.append(curve.read_text())
    assert texts[0] == texts[1]
    assert curves[0] == curves[1]
    assert curves[0].startswith("iteration,category_kl,objects,failed,count_kl\n0,")
    assert "--corrections 1" in texts[0]


def test_refuses_to_overwrite_and_bad_options(layouts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, new = tmp_path / "there.yaml", str(tmp_path / "new.yaml")
    out.write_text("kept")
    for more, message in (
        (["--out", new, "--curve", str(out)], "--curve: expected a new file, got"),
        (["--out", new, "--correction-curve", str(out)], "--correction-curve: expected a new file, got"),
        (["--out", new, "--curve", new], "--curve: expected a file of its own, got"),
        (["--out", str(out)], "expected a new file"),
        (["--out", str(tmp_path / "n"), "--hold-out", "2"], "--hold-out: expected"),
    ):
        with pytest.raises(SystemExit) as ended:
            main(["learn", str(layouts), *more])
        assert ended.value.code == 2
        assert message in capsys.readouterr().err
    assert out.read_text() == "kept"


def test_a_room_of_200_beds_is_named_and_left_out_and_so_are_its_objects(
    layouts: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = layouts.read_text(encoding="utf-8").splitlines()[:8]
    room = json.loads(lines[0])
    crowded = {**room, "id": "hall", "house": "hall", "objects": [room["objects"][0] | {"category": "bed"}] * 200}
    tiny = {**room["objects"][0], "category": "bed", "size_m": [0.02, 0.02, 0.02]}
    doll = json.dumps({**room, "objects": [*room["objects"], tiny, tiny]})
    file, out = tmp_path / "rooms.jsonl", tmp_path / "learned.yaml"
    file.write_text("\n".join([doll, *lines[1:], json.dumps(crowded)]) + "\n", encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        main(["learn", str(file), "--out", str(out), "--hold-out", "0", "--iterations", "0", "--corrections", "0"])
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    assert "room: 'hall' has 200 of bed, more than 63: 1 (lines 9)" in printed
    used = sum(len(json.loads(line)["objects"]) for line in lines)
    line = next(line for line in printed.splitlines() if line.startswith("Left out: "))
    reading = f"Left out: {200 / (202 + used):.1%} of the objects in reading: room: 'hall' has 200 of bed, more than 63 (200); "
    assert re.fullmatch(re.escape(reading) + r"\d+\.\d% of those learned from match no symbol: .*\bbed \(2\).*", line)
    assert line in " ".join(out.read_text(encoding="utf-8").replace("#", "").split())


def test_scene_layout_has_supporters_and_poses(layouts: Path) -> None:
    scene = SceneSynthesizer.from_config().synthesize(SceneRequest(), 6, 0, CameraTimes(frames=1, start_ns=0, rate_hz=10.0))
    room = layout_from_scene(scene)
    assert len(room.objects) == len(scene.objects)
    for seen, thing in zip(room.objects, scene.objects, strict=True):
        assert (seen.category, seen.size_m, seen.position_m, seen.yaw_rad) == (
            thing.category,
            thing.size_m,
            thing.position_m,
            thing.yaw_rad,
        )
        if thing.support.kind == "object":
            assert seen.on is not None
            below = room.objects[seen.on]
            assert np.hypot(*np.subtract(seen.position_m[:2], below.position_m[:2])) < 0.5 * np.hypot(*below.size_m[:2])
