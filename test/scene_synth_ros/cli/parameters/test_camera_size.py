"""A camera whose image size is changed: cut and told, or scaled."""

from pathlib import Path
from typing import Any

import pytest

from scene_synth_ros.cli.parameters.camera_size import resized_camera
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters

KINECT = {"camera.width": 640, "camera.height": 480, "camera.focal_x_px": 525.0}


def resized(node: str, before: dict[str, float], change: dict[str, float], *, scale: bool = False) -> tuple[dict[str, Any], str]:
    return resized_camera(node, before, before | change, change, scale=scale)


def test_a_smaller_image_of_a_lens_in_pixels_is_cut_and_told() -> None:
    values, told = resized("renderer_node", KINECT, {"camera.width": 64})
    assert values["camera.focal_x_px"] == 525.0
    assert told == (
        "renderer_node: 64 x 480 pixels show the middle of a view of 640 x 480 with camera.focal_x_px 525: 10 % of its width; "
        "--scale-camera shows all of it"
    )


@pytest.mark.parametrize("change", [{}, {"camera.width": 1280}, {"camera.width": 64, "camera.focal_x_px": 52.5}])
def test_what_is_not_cut_is_not_told(change: dict[str, float]) -> None:
    assert resized("r", KINECT, change) == (KINECT | change, "")
    wide = {"camera.width": 640, "camera.horizontal_fov_rad": 1.2}
    assert resized("r", wide, {"camera.width": 64})[1] == ""


def test_a_scaled_camera_sees_the_same() -> None:
    before = KINECT | {"camera.principal_x_px": 319.5, "camera.principal_y_px": 200.0}
    values, told = resized("r", before, {"camera.width": 160}, scale=True)
    assert told == "" and (values["camera.width"], values["camera.height"]) == (160, 120)
    assert (values["camera.focal_x_px"], values["camera.focal_y_px"]) == (131.25, 131.25)
    assert values["camera.principal_x_px"] == 79.5 and values["camera.principal_y_px"] == pytest.approx(49.625)
    both = resized("r", before, {"camera.width": 320, "camera.height": 480}, scale=True)[0]
    assert (both["camera.height"], both["camera.focal_x_px"], both["camera.focal_y_px"]) == (480, 262.5, 525.0)
    assert resized("r", before, {"camera.width": 320, "camera.focal_x_px": 300.0}, scale=True)[0]["camera.focal_x_px"] == 300.0


def test_runs_tell_it_and_scale_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    words = {"rooms": 1, "overlay": (Path("kinect_v1"),), "overrides": ("renderer_node.camera.width:=320",)}
    assert run_parameters(RunWords(**words))["renderer_node"]["camera.focal_x_px"] == 525.0  # type: ignore[arg-type]
    assert "50 % of its width; --scale-camera" in capsys.readouterr().err
    scaled = run_parameters(RunWords(**words, scale_camera=True))["renderer_node"]  # type: ignore[arg-type]
    assert (scaled["camera.focal_x_px"], scaled["camera.height"]) == (262.5, 240) and capsys.readouterr().err == ""
