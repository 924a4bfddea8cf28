"""Scans as files, and the scanners that come with the program."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from sample_scene import sample_scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.lidar.config import ScanConfig
from renderer.lidar.scanner import Scanner
from renderer.scene.flatten import flatten
from scene_description import from_mapping
from scene_description.share import config_path
from scene_synth_ros.cli.files.scan_files import write_scans
from scene_synth_ros.cli.parameters.run_profile import load_profile

SCANNERS = sorted(config_path("scanners").glob("*.yaml"))


def scanner_of(path: Path) -> ScanConfig:
    return from_mapping(ScanConfig, {name.removeprefix("scan."): value for name, value in load_profile(path)["renderer_node"].items()})


@pytest.mark.parametrize("path", SCANNERS, ids=lambda path: path.stem)
def test_a_device_is_a_scanner_and_nothing_else_and_switched_on(path: Path) -> None:
    parameters = load_profile(path)
    assert not parameters["grammar_node"] and not parameters["recorder_node"]
    assert scanner_of(path).enabled


def test_devices_have_the_beams_of_their_data_sheets() -> None:
    found = {path.stem: scanner_of(path) for path in SCANNERS}
    steps = {name: np.rad2deg(config.angle_increment_rad) for name, config in found.items()}
    assert steps == pytest.approx({"rplidar_a1": 1.0, "tim551": 1.0, "urg_04lx": 360 / 1024}, rel=1e-6)
    assert np.rad2deg(found["tim551"].sweep_s * 360 * 15) == pytest.approx(np.rad2deg(270))
    assert found["urg_04lx"].angle_min_rad == pytest.approx((44 - 384) * 2 * np.pi / 1024)
    assert {name: (config.rate_hz, config.range_max_m) for name, config in found.items()} == {
        "rplidar_a1": (5.5, 12.0),
        "tim551": (15.0, 10.0),
        "urg_04lx": (10.0, 5.6),
    }


def test_files_hold_every_scan_and_where_its_beams_went(tmp_path: Path) -> None:
    scene, config = sample_scene(), ScanConfig(beams=90, angle_max_rad=3.0, noise_m=0.0)
    flat = flatten(scene)
    with Renderer(flat, CameraConfig(width=4, height=4), RenderConfig(threads=1), 1) as renderer:
        scans = list(Scanner(renderer.tree, flat, config, 1).along(scene.camera_path))
    write_scans(tmp_path, scans, config, scene)
    with np.load(tmp_path / "scans.npz") as found:
        assert found["ranges"].shape == found["ranges_ideal"].shape == found["intensities"].shape == (len(scans), 90)
        assert found["stamps_ns"].tolist() == [scan.stamp_ns for scan in scans]
        assert found["times_s"][-1] == pytest.approx(config.sweep_s)
        hits = found["origins_m"][0] + found["directions"][0] * found["ranges_ideal"][0, :, None]
    hits = hits[np.isfinite(scans[0].ideal)]
    thickness = scene.room.wall_thickness_m
    assert (hits[:, :2] > -thickness - 1e-6).all() and (hits[:, :2] < np.array([4.0, 3.5]) + thickness + 1e-6).all()
    np.testing.assert_allclose(hits[:, 2], config.height_m)
    picture = np.asarray(Image.open(io.BytesIO((tmp_path / "scan.png").read_bytes())))
    assert (np.abs(picture.astype(int) - (0xC4, 0x02, 0x33)).sum(axis=2) < 30).sum() > 20  # hits are drawn
