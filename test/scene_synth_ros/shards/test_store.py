"""A dataset in a local folder: what the store promises."""

from pathlib import Path

import pytest

from scene_synth_ros.shards.store import LocalStore


def test_what_dead_runs_have_left_is_removed_and_nothing_else(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    store.write("dataset.json", b"plan")
    for name in ("shards/.00001.77.partial/x", "shards/00000/x"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "shards" / ".00001.json.77.partial").touch()
    (tmp_path / "shards" / "00000.json").touch()
    store.clean()
    assert store.names("shards") == ["00000", "00000.json"] and store.read("dataset.json") == b"plan"
    assert sorted(path.name for path in (tmp_path / "shards").iterdir()) == ["00000", "00000.json"]


def test_a_file_that_cannot_be_written_leaves_the_one_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = LocalStore(tmp_path)
    store.write("manifest.json", b"old")

    def refuse(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("scene_description.whole.os.fsync", refuse)
    with pytest.raises(OSError, match="No space left"):
        store.write("manifest.json", b"new")
    assert store.read("manifest.json") == b"old" and [path.name for path in tmp_path.iterdir()] == ["manifest.json"]
