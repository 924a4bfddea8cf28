"""``scene_synth export``: the file, and what is refused."""

from pathlib import Path

import pytest
from sample_scene import sample_scene

from scene_description import scene_to_json
from scene_synth_ros.cli.command_line import main


def call(*words: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return int(ended.value.code or 0)


def test_writes_a_whole_file_or_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.json"
    scene.write_text(scene_to_json(sample_scene()))
    out = tmp_path / "room.glb"
    assert call("export", scene, out) == 0
    first = out.read_bytes()
    assert first[:4] == b"glTF" and "4 objects" in capsys.readouterr().out
    assert call("export", scene, out) == 2 and "--force" in capsys.readouterr().err
    assert call("export", scene, out, "--force") == 0 and out.read_bytes() == first
    assert call("export", scene, tmp_path / "room.fbx") == 2 and ".glb" in capsys.readouterr().err
    scene.write_text("{}")
    assert call("export", scene, tmp_path / "other.glb") == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["room.glb", "scene.json"]


def test_a_world_has_its_meshes_beside_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, out = tmp_path / "scene.json", tmp_path / "room.sdf"
    scene.write_text(scene_to_json(sample_scene()))
    assert call("export", scene, out) == 0 and "4 objects" in capsys.readouterr().out
    text = out.read_text()
    meshes = sorted(path.name for path in (tmp_path / "room_meshes").iterdir())
    assert "bed_3.glb" in meshes and all(f"<uri>room_meshes/{name}</uri>" in text for name in meshes)
    out.unlink()
    assert call("export", scene, out) == 2 and "room_meshes: exists already" in capsys.readouterr().err
    assert call("export", scene, out, "--force") == 0 and out.read_text() == text
