"""``scene_synth render`` tells of frames that are not seen from within the room, in one line, and of no others."""

from dataclasses import replace
from pathlib import Path

import pytest
from sample_scene import sample_scene

from scene_description import scene_to_json
from scene_synth_ros.cli.command_line import main

IN_THE_BED, ABOVE_THE_ROOF = (1.4, 1.8, 0.42), (2.0, 1.0, 9.0)


@pytest.mark.parametrize(
    ("places", "expected"),
    [
        ((), ""),
        ((IN_THE_BED,), "frame 1 is seen from inside object 3 (bed)"),
        (
            (ABOVE_THE_ROOF, IN_THE_BED),
            "frame 0 is seen from outside the room, and 1 more of 2 frames from outside the room or inside something",
        ),
    ],
)
def test_cameras_that_stand_in_things_or_outside_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], places: tuple[tuple[float, float, float], ...], expected: str
) -> None:
    scene = sample_scene()
    path = scene.camera_path[: 2 - len(places)]
    moved = [replace(pose, position_m=place) for pose, place in zip(scene.camera_path[-len(places) :], places, strict=False)]
    (tmp_path / "room.json").write_text(scene_to_json(replace(scene, camera_path=(*path, *moved))))
    with pytest.raises(SystemExit, match="0"):
        main(["render", str(tmp_path / "room.json"), "--out", str(tmp_path / "out"), "--size", "8x6", "--spp", "1", "--denoise", "none"])
    told = [line for line in capsys.readouterr().err.split("\n") if "warning" in line]
    assert told == ([f"scene_synth render: warning: {expected}"] if expected else [])
