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
from scene_synth_ros.convert.formats.rig import MountedCamera

_DISTORTION = {"pinhole": "radtan", "brown_conrady": "radtan", "kannala_brandt": "equidistant"}


def write_kalibr(folder: Path, cameras: list[MountedCamera], imu: ImuConfig) -> None:
    """Write calibration and settings of a body's cameras and its device into a new folder."""
    folder.mkdir()
    told = {"noise": "  ".join(noise_rows(imu)), "imu_hz": imu.rate_hz, "gravity": GRAVITY_M_S2}
    told |= {"cameras": len(cameras), "stereo": len(cameras) == 2, "camera_hz": max(camera.rate_hz for camera in cameras) + 1.0}
    names = ("kalibr_imu_chain.yaml", "estimator_config.yaml")
    files = {name: config_path(f"templates/{name}").read_text(encoding="utf-8").format(**told) for name in names}
    shift = f"  timeshift_cam_imu: {imu.clock_offset_s!r}\n"
    files["kalibr_imucam_chain.yaml"] = "%YAML 1.0\n---\n" + "".join(_camera(cameras, number) + shift for number in range(len(cameras)))
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


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
