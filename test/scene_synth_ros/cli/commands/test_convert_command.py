"""The command: what it says, and that its folder is there whole or not at all."""

import argparse
from pathlib import Path

import pytest
from convert_bag import FISHEYE, convert_bag

from scene_description import SceneSynthError
from scene_synth_ros.cli.commands import convert_command


def words(*arguments: object) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    convert_command.add_arguments(parser)
    return parser.parse_args([str(word) for word in arguments])


def test_the_folder_appears_whole_and_the_line_says_what_is_in_it(tmp_path, capsys):
    out = tmp_path / "out"
    assert convert_command.run(words(convert_bag().path, "--to", "tum", "--out", out, "--rooms", "1:", "--every", 2)) == 0
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    assert capsys.readouterr().out == f"{out}: tum, 1 room, 2 frames, {size / 1e6:.1f} MB\n"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--rooms", "3"), "^--rooms: expected A:B with A below B, as 0:100, got '3'$"),
        (("--rooms", "4:4"), "^--rooms: expected A:B with A below B"),
        (("--every", "0"), "^--every: expected at least 1, got 0$"),
        (("--out", "s3://bucket/coco"), "^--out s3:/bucket/coco: expected a folder on this machine, got a URL"),
        (("--threads", "0"), "^--threads: expected 1 to 64, got 0$"),
        (("--catalog", "/nowhere"), "^--catalog /nowhere: expected a folder, got none; check the path$"),
        (("--camera", "nose"), "nose"),
        ((), "^tum: camera /synth/camera: expected a lens pinhole or plumb_bob, got kannala_brandt"),
    ],
)
def test_bad_words_and_sources_leave_nothing(tmp_path: Path, options, told):
    with pytest.raises(SceneSynthError, match=told):
        convert_command.run(words(convert_bag(camera=FISHEYE).path, "--to", "tum", "--out", tmp_path / "out", *options))
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_there_is_left_alone(tmp_path):
    with pytest.raises(SceneSynthError, match="exists already; choose another folder or remove it"):
        convert_command.run(words(convert_bag().path, "--to", "tum", "--out", tmp_path))
