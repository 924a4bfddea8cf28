"""Frames as files: every layer read back from NPZ, PNG and EXR; the command's settings."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest
from box_room import VIEW, furnished_room
from PIL import Image

from renderer import LAYERS, CameraConfig, Frame, RenderConfig, Renderer
from renderer.files.exr_files import is_installed
from scene_description import SceneSynthError
from scene_synth_ros.cli.files.frame_files import exr_channels, write_frame
from scene_synth_ros.cli.parameters import render_settings

NEEDS_EXR = pytest.mark.skipif(not is_installed(), reason="the extra exr is not installed")


@pytest.fixture(scope="module")
def frame():
    with Renderer(
        furnished_room(), CameraConfig(width=40, height=30), RenderConfig(samples_per_pixel=2, max_depth=3, threads=1), 3
    ) as renderer:
        return renderer.render(VIEW, 0, tuple(LAYERS))


def test_every_layer_is_in_the_npz_and_has_a_picture(tmp_path: Path, frame) -> None:
    write_frame(tmp_path / "f", frame)
    with np.load(tmp_path / "f.npz") as stored:
        assert set(stored) == set(LAYERS)
        for name in LAYERS:
            np.testing.assert_array_equal(stored[name], frame.layers[name])
    for name in LAYERS:
        assert Image.open(tmp_path / f"f_{name}.png").size == (40, 30)
    assert (np.array(Image.open(tmp_path / "f_samples.png")) == 2).all()
    np.testing.assert_array_equal(np.array(Image.open(tmp_path / "f_color.png")), frame.layers["color"])


@NEEDS_EXR
def test_exr_holds_radiance_and_layers_as_they_are(tmp_path: Path, frame) -> None:
    import OpenEXR

    write_frame(tmp_path / "f", frame, exr=True)
    channels = OpenEXR.File(str(tmp_path / "f.exr"), separate_channels=True).channels()
    for i, name in enumerate("RGB"):
        np.testing.assert_array_equal(channels[name].pixels, frame.radiance[..., i])
    np.testing.assert_array_equal(frame.layers["radiance"], frame.radiance)
    np.testing.assert_array_equal(channels["depth.Z"].pixels, frame.layers["depth"])
    np.testing.assert_array_equal(channels["normals.Y"].pixels, frame.layers["normals"][..., 1])
    np.testing.assert_array_equal(channels["instance.id"].pixels, frame.layers["instance"])
    assert channels["semantic.id"].pixels.dtype == np.uint32 and set(channels) == set(exr_channels(frame))


GOOD = {"depth": np.ones((3, 4), np.float32), "color": np.zeros((3, 4, 3), np.uint8)}


@pytest.mark.parametrize(
    ("layers", "message"),
    [
        ({"wobble": np.full((3, 4), 70_000.5)}, "layers: expected some of color, depth, .*, got wobble"),
        ({"depth": np.ones((3, 4), np.float64)}, r"layer depth: expected float32 \(height, width\), got float64 \(3, 4\)"),
        ({"color": np.zeros((3, 4), np.uint8)}, r"layer color: expected uint8 \(height, width, 3\), got uint8 \(3, 4\)"),
        ({"samples": np.ones((3, 4), np.int64)}, r"layer samples: expected uint16 \(height, width\), got int64 \(3, 4\)"),
        ({"depth": np.ones((4, 4), np.float32)}, r"layers: expected one size, got \(3, 4\) and \(4, 4\)"),
    ],
)
@pytest.mark.parametrize("exr", [False, pytest.param(True, marks=NEEDS_EXR)])
def test_layers_that_fit_no_row_are_refused_and_nothing_is_written(tmp_path: Path, layers, message: str, exr: bool) -> None:
    with pytest.raises(SceneSynthError, match=message) as refused:
        write_frame(tmp_path / "f", Frame(GOOD | layers, None), exr=exr)
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())


def settings(*words: str) -> render_settings.Settings:
    parser = argparse.ArgumentParser()
    render_settings.add_arguments(parser)
    return render_settings.read_settings(parser.parse_args(list(words)))


def test_overlays_then_options_then_single_values_win() -> None:
    chosen = settings("--overlay", "config/cameras/kinect_v1.yaml", "--preset", "photo", "--spp", "7", "-p", "render.max_depth:=3")
    assert chosen.camera.focal_x_px == 525.0 and chosen.render.samples_per_pixel == 7 and chosen.render.max_depth == 3
    lens = settings("-p", "camera.f_stop:=1.8", "-p", "sensor.full_well_e:=5000", "--size", "80x60", "--exposure", "7")
    assert lens.camera.f_stop == 1.8 and lens.sensor.full_well_e == 5000.0 and (lens.camera.width, lens.camera.height) == (80, 60)
    assert lens.render.exposure_ev100 == 7.0 and not lens.render.auto_exposure
    assert settings("--white-balance", "3200").render.white_balance_k == 3200.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--size", "80"), "--size: expected WIDTHxHEIGHT, got 80"),
        (("--white-balance", "warm"), "--white-balance: expected auto, none or a colour temperature in kelvin, got 'warm'"),
        (("-p", "streams.lazy:=false"), "-p streams.lazy: expected a parameter of camera., render., sensor., depth_sensor., scan."),
        (("-p", "camera.f_stop:=-1"), "camera.f_stop: expected a number in"),
        (("-p", "camera.aperture:=1"), "camera.aperture: expected one of"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(SceneSynthError, match=message.replace(".", r"\.")) as refused:
        settings(*words)
    assert "\n" not in str(refused.value)
