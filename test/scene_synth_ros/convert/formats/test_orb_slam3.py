"""Settings of ORB-SLAM3, read by the reader that it uses, OpenCV's."""

import cv2
import numpy as np
import pytest
from mounted_cameras import FISHEYE, PINHOLE, mounted

from renderer.body.config import ImuConfig
from scene_synth_ros.convert.formats.orb_slam3 import settings_text


def read(text: str) -> cv2.FileStorage:
    return cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)


def test_a_stereo_pair_with_a_device_has_its_matrices_and_its_noise() -> None:
    cameras, imu = [mounted(PINHOLE, 0.0), mounted(PINHOLE, 0.11)], ImuConfig(gyro_noise_rad_s=2e-4, accel_walk_m_s3=3e-3, rate_hz=200.0)
    found = read(settings_text(cameras, imu))
    assert found.getNode("File.version").string() == "1.0" and found.getNode("Camera.type").string() == "PinHole"
    between = found.getNode("Stereo.T_c1_c2").mat()
    assert between.dtype == np.float32
    expected = np.eye(4)
    expected[0, 3] = 0.11
    np.testing.assert_allclose(between, expected, atol=1e-7)
    np.testing.assert_allclose(found.getNode("IMU.T_b_c1").mat(), cameras[0].mounted, atol=1e-7)
    values = {"Camera2.cx": 239.5, "Camera1.p2": 0.0, "Camera.fps": 20, "IMU.NoiseGyro": 2e-4, "IMU.AccWalk": 3e-3, "IMU.Frequency": 200}
    values |= {"ORBextractor.nFeatures": 2500}  # with 1200 stereo-inertial drifts by 3 to 8 cm at 320x240
    assert {name: found.getNode(name).real() for name in values} == pytest.approx(values)
    assert found.getNode("Stereo.b").real() == pytest.approx(0.11)


def test_a_camera_with_another_lens_is_left_out() -> None:
    found = read(settings_text([mounted(FISHEYE, 0.0), mounted(PINHOLE, 0.11)], None))
    assert found.getNode("Camera.type").string() == "KannalaBrandt8" and found.getNode("Camera1.k4").real() == pytest.approx(0.0004)
    assert found.getNode("Stereo.T_c1_c2").empty() and found.getNode("IMU.T_b_c1").empty() and found.getNode("Camera2.fx").empty()
