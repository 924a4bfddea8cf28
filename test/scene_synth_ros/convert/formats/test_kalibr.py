"""Kalibr's files and OpenVINS's settings, by the readers of both: PyYAML and OpenCV."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from mounted_cameras import FISHEYE, PINHOLE, mounted

from renderer.body.config import ImuConfig
from scene_synth_ros.convert.formats.kalibr import write_kalibr

IMU = ImuConfig(gyro_noise_rad_s=2e-4, accel_walk_m_s3=3e-3, rate_hz=200.0, clock_offset_s=0.004)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("kalibr") / "open_vins"
    write_kalibr(path, [mounted(PINHOLE, 0.0), mounted(FISHEYE, 0.11)], IMU)
    return path


def test_the_chain_leads_from_the_device_through_its_cameras(folder: Path) -> None:
    chain = yaml.safe_load((folder / "kalibr_imucam_chain.yaml").read_text())
    for number, (lens, x) in enumerate(((PINHOLE, 0.0), (FISHEYE, 0.11))):
        camera = chain[f"cam{number}"]
        np.testing.assert_allclose(np.array(camera["T_cam_imu"]) @ mounted(lens, x).mounted, np.eye(4), atol=1e-15)
        assert camera["intrinsics"] == [lens.fx, lens.fy, lens.cx, lens.cy] and camera["resolution"] == [480, 360]
        assert camera["cam_overlaps"] == [1 - number] and camera["timeshift_cam_imu"] == 0.004 and len(camera["distortion_coeffs"]) == 4
    assert chain["cam0"]["distortion_model"] == "radtan" and chain["cam1"]["distortion_model"] == "equidistant"
    expected = np.eye(4)
    expected[0, 3] = -0.11  # the first camera's origin, seen from the second
    np.testing.assert_allclose(chain["cam1"]["T_cn_cnm1"], expected, atol=1e-15)


def test_the_device_has_its_noise(folder: Path) -> None:
    device = yaml.safe_load((folder / "kalibr_imu_chain.yaml").read_text())["imu0"]
    assert device["gyroscope_noise_density"] == 2e-4 and device["accelerometer_random_walk"] == 3e-3 and device["update_rate"] == 200.0
    assert device["model"] == "kalibr" and np.array_equal(device["Tw"], np.eye(3)) and not np.any(device["Tg"])


def test_open_vins_finds_cameras_and_device_where_its_settings_say(folder: Path) -> None:
    settings = cv2.FileStorage(str(folder / "estimator_config.yaml"), cv2.FILE_STORAGE_READ)
    assert settings.getNode("max_cameras").real() == 2 and settings.getNode("gravity_mag").real() == 9.80665
    assert settings.getNode("track_frequency").real() > 20.0
    cameras, device = (
        cv2.FileStorage(str(folder / settings.getNode(f"relative_config_{name}").string()), cv2.FILE_STORAGE_READ)
        for name in ("imucam", "imu")
    )
    rows = cameras.getNode("cam1").getNode("T_cam_imu")
    read = np.array([[rows.at(row).at(column).real() for column in range(4)] for row in range(4)])
    np.testing.assert_allclose(read @ mounted(FISHEYE, 0.11).mounted, np.eye(4), atol=1e-15)
    assert cameras.getNode("cam1").getNode("distortion_model").string() == "equidistant"
    assert device.getNode("imu0").getNode("gyroscope_noise_density").real() == 2e-4
