"""Settings of ORB-SLAM3 for a room in EuRoC's form: ``orb_slam3.yaml`` beside ``mav0``, for each of its modes.

The file's names and matrices are those of version 1.0 of the format (C. Campos et al., "ORB-SLAM3: An Accurate Open-Source Library for
Visual, Visual-Inertial, and Multimap SLAM", T-RO 2021; its calibration tutorial).  Noise is what the Allan deviation shows; estimators
are commonly told more (``sensor.yaml`` of ``imu0`` has both).  Corners are twice the usual 1200: with few, poses that inertia holds
drift.  ``RGBD.DepthMapFactor`` is that of depth as ``convert --to tum`` writes it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from renderer.body.config import ImuConfig
from scene_description.products import matmul
from scene_description.share import config_path
from scene_synth_ros.convert.camera import rigid_inverse
from scene_synth_ros.convert.formats.rig import MountedCamera
from scene_synth_ros.convert.formats.tum import STEPS_A_METRE

_MODELS = {"pinhole": "PinHole", "brown_conrady": "PinHole", "kannala_brandt": "KannalaBrandt8"}
_COEFFICIENTS = {"PinHole": ("k1", "k2", "p1", "p2"), "KannalaBrandt8": ("k1", "k2", "k3", "k4")}
_BASELINE_M = 0.1
"""Of the second camera that ORB-SLAM3 makes up for depth, where there is none."""


def settings_text(cameras: list[MountedCamera], imu: ImuConfig | None) -> str:
    """Return the settings for the first camera, the second if its lens is of the same model, and the device where there is one."""
    first = cameras[0]
    model = _MODELS[first.lens.model]
    cameras = [camera for camera in cameras[:2] if _MODELS[camera.lens.model] == model]
    rows = ['%YAML:1.0\n---\nFile.version: "1.0"\n', f'Camera.type: "{model}"\n']
    for number, camera in enumerate(cameras, 1):
        lens = camera.lens
        values = {"fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy}
        values |= dict(zip(_COEFFICIENTS[model], (*lens.coefficients, *(0.0,) * 4), strict=False))
        rows += [f"Camera{number}.{name}: {float(value)!r}\n" for name, value in values.items()]
        if model == "KannalaBrandt8":
            rows += [f"Camera{number}.overlappingBegin: 0\nCamera{number}.overlappingEnd: {lens.width - 1}\n"]
    rows += [f"Camera.width: {first.lens.width}\nCamera.height: {first.lens.height}\nCamera.fps: {max(round(first.rate_hz), 1)}\n"]
    if len(cameras) > 1:
        between: NDArray[np.float64] = matmul(rigid_inverse(first.mounted), cameras[1].mounted)
        rows += [_matrix("Stereo.T_c1_c2", between)]
        baseline = math.dist(between[:3, 3], (0.0, 0.0, 0.0))
    else:
        baseline = _BASELINE_M
    fixed = config_path("templates/orb_slam3.yaml").read_text(encoding="utf-8")
    rows += [f"Stereo.b: {baseline!r}\n", fixed.format(steps_a_metre=STEPS_A_METRE)]
    if imu is not None:
        rows += [_matrix("IMU.T_b_c1", first.mounted)]
        noise = (imu.gyro_noise_rad_s, imu.accel_noise_m_s2, imu.gyro_walk_rad_s2, imu.accel_walk_m_s3)
        names = ("NoiseGyro", "NoiseAcc", "GyroWalk", "AccWalk")
        rows += [f"IMU.{name}: {float(value)!r}\n" for name, value in zip(names, noise, strict=True)]
        rows += [f"IMU.Frequency: {float(imu.rate_hz)!r}\nIMU.InsertKFsWhenLost: 0\n"]
    return "".join(rows)


def _matrix(name: str, matrix: NDArray[np.float64]) -> str:
    numbers = ", ".join(repr(float(number)) for number in matrix.ravel())
    return f"{name}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n   data: [{numbers}]\n"
