"""Files and folders appear whole or not at all, and what dead processes have left goes."""

import os
from pathlib import Path

import pytest

from scene_description.whole import WholeFolder, temporary_path, whole_file, write_whole


def test_a_file_takes_the_place_of_the_one_before_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "room.json"
    write_whole(path, "old ä")
    assert path.read_bytes() == "old ä".encode()
    with pytest.raises(KeyError), whole_file(path) as partial:
        partial.write_text("half")
        assert path.read_text(encoding="utf-8") == "old ä" and partial.parent == tmp_path
        raise KeyError
    assert path.read_text(encoding="utf-8") == "old ä" and list(tmp_path.iterdir()) == [path]
    write_whole(path, b"new", sync=True)
    assert path.read_bytes() == b"new" and list(tmp_path.iterdir()) == [path]


def test_a_folder_has_its_name_when_it_is_whole_and_an_error_leaves_nothing(tmp_path: Path) -> None:
    with WholeFolder(tmp_path / "around" / "bag") as folder:
        folder.mkdir()
        (folder / "file").touch()
        assert folder.name == "bag" and not (tmp_path / "around" / "bag").exists()
    assert [path.relative_to(tmp_path).as_posix() for path in sorted(tmp_path.rglob("*"))] == ["around", "around/bag", "around/bag/file"]
    with pytest.raises(OSError, match="not empty"), WholeFolder(tmp_path / "around" / "bag") as folder:
        folder.mkdir()
    with pytest.raises(KeyError), WholeFolder(tmp_path / "other") as folder:
        folder.mkdir()
        raise KeyError
    assert [path.name for path in tmp_path.iterdir()] == ["around"] and [path.name for path in (tmp_path / "around").iterdir()] == ["bag"]


def test_what_a_dead_process_of_this_machine_has_left_goes_and_nothing_else(tmp_path: Path) -> None:
    machine = os.uname().nodename
    gone = 2**22 + 1  # more than Linux has
    others = [f".bag.{machine}.{os.getppid()}.partial", ".bag.elsewhere_far.7.partial", ".bag.partial", f".bag2.{machine}.{gone}.partial"]
    for name in (*others, f".bag.{machine}.{gone}.partial"):
        (tmp_path / name / "bag").mkdir(parents=True)
    made = WholeFolder(tmp_path / "bag")
    assert made.partial == temporary_path(tmp_path / "bag") / "bag"
    made.discard()
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(others)
