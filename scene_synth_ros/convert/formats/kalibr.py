"""Kalibr's calibration of a room in EuRoC's form, and settings of OpenVINS, which reads it: the folder ``open_vins`` beside ``mav0``.

Names and matrices are those of Kalibr's own results (P. Furgale, J. Rehder, R. Siegwart, "Unified temporal and spatial calibration for
multi-sensor systems", IROS 2013; its pages on YAML formats), topics those of EuRoC's bags, noise what the Allan deviation shows, the time
shift that of the device's clock.  ``estimator_config.yaml`` has every key that OpenVINS asks for (P. Geneva et al., "OpenVINS: A research
platform for visual-inertial estimation", ICRA 2020).  OpenCV and PyYAML read all three.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.body.config import GRAVITY_M_S2, ImuConfig
from scene_description.products import matmul
from scene_description.share import config_path
from scene_synth_ros.convert.camera import rigid_inverse
from scene_synth_ros.convert.formats.euroc_imu import noise_rows
from scene_synth_ros.convert.formats.orb_slam3 import MountedCamera

_HEAD = "%YAML 1.0\n---\n"
_DISTORTION = {"pinhole": "radtan", "brown_conrady": "radtan", "kannala_brandt": "equidistant"}


def write_kalibr(folder: Path, cameras: list[MountedCamera], imu: ImuConfig) -> None:
    """Write calibration and settings of a body's cameras and its device into a new folder."""
    folder.mkdir()
    noise = "".join(f"  {row}" for row in noise_rows(imu))
    exact = _matrix("T_i_b", np.eye(4)) + "".join(_matrix(name, np.eye(3)) for name in ("Tw", "Ta", "R_IMUtoGYRO", "R_IMUtoACC"))
    device = f"  model: kalibr\n  rostopic: /imu0\n  time_offset: 0.0\n  update_rate: {imu.rate_hz!r}\n"
    shift = f"  timeshift_cam_imu: {imu.clock_offset_s!r}\n"
    fastest = max(camera.rate_hz for camera in cameras)
    fixed = config_path("templates/open_vins.yaml").read_text(encoding="utf-8")
    files = {
        "kalibr_imu_chain": f"{_HEAD}imu0:\n{noise}{device}{exact}{_matrix('Tg', np.zeros((3, 3)))}",
        "kalibr_imucam_chain": _HEAD + "".join(_camera(cameras, number) + shift for number in range(len(cameras))),
        "estimator_config": fixed.format(cameras=len(cameras), stereo=len(cameras) == 2, gravity=GRAVITY_M_S2, rate=fastest + 1.0),
    }
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")


def _camera(cameras: list[MountedCamera], number: int) -> str:
    lens, mounted, _ = cameras[number]
    from_body = rigid_inverse(mounted)
    before = _matrix("T_cn_cnm1", matmul(from_body, cameras[number - 1].mounted)) if number else ""
    coefficients = [float(value) for value in (*lens.coefficients, *(0.0,) * 4)[:4]]
    return (
        f"cam{number}:\n{_matrix('T_cam_imu', from_body)}{before}"
        f"  cam_overlaps: {[other for other in range(len(cameras)) if other != number]}\n  camera_model: pinhole\n"
        f"  distortion_model: {_DISTORTION[lens.model]}\n  distortion_coeffs: {coefficients}\n"
        f"  intrinsics: {[float(value) for value in (lens.fx, lens.fy, lens.cx, lens.cy)]}\n"
        f"  resolution: {[lens.width, lens.height]}\n  rostopic: /cam{number}/image_raw\n"
    )


def _matrix(name: str, matrix: NDArray[np.float64]) -> str:
    return f"  {name}:\n" + "".join(f"    - {row}\n" for row in matrix.tolist())
