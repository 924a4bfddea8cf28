"""Temporary folders: they end with their process, at the latest with the next one, and nobody else's goes with them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scene_synth_ros.workers.temporary_folder import remove_abandoned_folders, temporary_folder

ROOT = Path(__file__).parents[3]
END_INSIDE = "with temporary_folder() as folder: os.write(1, bytes(folder)), (folder / 'file').touch(), os._exit(9)"
MAKE_AND_LOOK = """
for number in range(400):
    with temporary_folder() as folder:
        if not folder.is_dir():
            print(number)
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty folder that stands for the machine's temporary one."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


def start(code: str, temporary: Path) -> "subprocess.Popen[str]":
    env = {**os.environ, "TMPDIR": str(temporary), "PYTHONPATH": str(ROOT)}
    code = f"import os\nfrom scene_synth_ros.workers.temporary_folder import temporary_folder\n{code}"
    return subprocess.Popen([sys.executable, "-c", code], env=env, stdout=subprocess.PIPE, text=True)


def test_folders_end_and_those_of_killed_processes_are_removed_by_the_next(temporary: Path) -> None:
    left = Path(start(END_INSIDE, temporary).communicate(timeout=60)[0])
    assert (left / "file").exists()
    with temporary_folder() as one:
        assert not left.exists()
        with temporary_folder() as two:
            assert one != two and one.is_dir() and two.is_dir()
        assert remove_abandoned_folders() == 0 and one.is_dir()
        assert one.stat().st_mode & 0o777 == 0o700
    assert list(temporary.iterdir()) == []


def test_no_clean_up_takes_the_folder_that_another_process_has_just_made(temporary: Path) -> None:
    runs = [start(MAKE_AND_LOOK, temporary) for _ in range(4)]
    gone = [line for run in runs for line in run.communicate(timeout=60)[0].splitlines()]
    assert gone == [] and [run.returncode for run in runs] == [0] * 4
    assert list(temporary.iterdir()) == []


def test_what_others_have_laid_there_is_left_alone(temporary: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    thesis = tmp_path / "home" / "thesis"
    thesis.mkdir(parents=True)
    (thesis / ".lock").touch()
    for name in (".scene_synth_12345678.locked", f"scene_synth_shards_{os.getuid()}"):
        (temporary / name).symlink_to(tmp_path / "home")
    (temporary / ".scene_synth_87654321.locked").touch()
    with temporary_folder() as folder:
        assert tmp_path / "home" not in folder.resolve().parents
    assert thesis.is_dir() and len(list(temporary.iterdir())) == 3
    strangers = temporary / ".scene_synth_11111111.locked"
    strangers.mkdir()
    monkeypatch.setattr(os, "geteuid", lambda: strangers.stat().st_uid + 1)
    assert remove_abandoned_folders() == 0 and strangers.is_dir()
