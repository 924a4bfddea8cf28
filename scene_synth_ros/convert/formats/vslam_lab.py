"""VSLAM-LAB: a folder a room as the benchmark keeps its sequences, for all the systems that it runs.

A. Fontan, T. Fischer, J. Civera, M. Milford, "VSLAM-LAB: A Comprehensive Framework for Visual SLAM Methods and Datasets" (2025); names of
files, columns and keys are those of its sources of January 2026 (VSLAM-LAB/VSLAM-LAB, dc5b1198).  ``rgb_0``, ``rgb_1`` ... have the
pictures of the cameras, ``depth_0`` the first one's depth where it is recorded, ``rgb.csv`` the frames that all cameras have,
``imu_0.csv`` readings by the device's clock, ``calibration.yaml`` lenses, places on the body and the noise that the Allan deviation shows,
``groundtruth.csv`` the poses of the first camera's optical frame, which is what systems say.  Stamps are whole nanoseconds.
"""

from pathlib import Path
from typing import Any

import numpy as np

from renderer.body.config import GRAVITY_M_S2, ImuConfig
from scene_description import CameraPose
from scene_description.yaml_text import dump_yaml
from scene_synth_ros.convert.camera import camera_pose, lens_of, refuse_lens, shutter_notes
from scene_synth_ros.convert.files import write_depth, write_picture
from scene_synth_ros.convert.formats.euroc_imu import readings_csv, stamp_name
from scene_synth_ros.convert.formats.rig import MountedCamera, Rig, RigCamera, RigWriter
from scene_synth_ros.convert.formats.tum import STEPS_A_METRE
from scene_synth_ros.convert.writer import Sequence
from scene_synth_ros.dataset import Frame

_DISTORTION = {"pinhole": "", "brown_conrady": "radtan5", "kannala_brandt": "equid4"}
_READINGS = "ts (ns),wx (rad s^-1),wy (rad s^-1),wz (rad s^-1),ax (m s^-2),ay (m s^-2),az (m s^-2)"
_POSES = "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw"


class FormatWriter(RigWriter):
    """Writes sequences as VSLAM-LAB keeps them."""

    steps_a_metre = STEPS_A_METRE

    def begin_sequence(self, sequence: Sequence) -> RigCamera:
        """Make the folders of a camera.

        Raises:
            ConvertError: the format has no name for the lens.
        """
        lens = lens_of(self.source.camera(sequence))
        if lens.model not in _DISTORTION:
            raise refuse_lens(lens, sequence.camera, self.name, "pinhole, plumb_bob or equidistant", "choose --to colmap")
        self.notes |= shutter_notes(self.source.frame(sequence, 0), sequence.camera, self.name)
        room = self.out / sequence.folder
        state = RigCamera(room, room / f"rgb_{sequence.place}", sequence, lens)
        state.path.mkdir(parents=True)
        if self._has_depth(sequence):
            (room / "depth_0").mkdir()
        return state

    def encode(self, frame: Frame, number: int, state: RigCamera) -> tuple[CameraPose, int]:
        """Write picture and depth; return the pose, and how many pixels are too far away."""
        del number
        name = stamp_name(frame.stamp_ns)
        write_picture(frame, self.source.roles["picture"], state.path / name, jpeg=False)
        beyond = 0
        if self._has_depth(state.sequence):
            beyond = write_depth(state.room / "depth_0" / f"{name}.png", frame[self.source.roles["depth"]], STEPS_A_METRE)
        return camera_pose(frame), beyond

    def end_sequence(self, state: RigCamera) -> None:
        """Write what belongs to a room with its last camera.

        Raises:
            ConvertError: the camera moves against the first one, or has no frame together with it.
        """
        rig = self.mount(state)
        if len(rig.cameras) == state.sequence.cameras:
            self._write_room(state.room, rig)

    def _has_depth(self, sequence: Sequence) -> bool:
        return "depth" in self.source.roles and sequence.camera == next(iter(self.source.data))

    def _write_room(self, room: Path, rig: Rig) -> None:
        stamps = sorted(set.intersection(*({pose.stamp_ns for pose in camera.poses} for camera in rig.cameras)))
        folders = [camera.path.name for camera in rig.cameras] + ["depth_0"] * self._has_depth(rig.cameras[0].sequence)
        head = ",".join(f"ts_{folder} (ns),path_{folder}" for folder in folders)
        rows = [",".join(f"{stamp},{folder}/{stamp_name(stamp)}.png" for folder in folders) for stamp in stamps]
        (room / "rgb.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
        poses = [",".join(map(repr, (pose.stamp_ns, *pose.position_m, *pose.orientation))) for pose in rig.cameras[0].poses]
        (room / "groundtruth.csv").write_text("\n".join([_POSES, *poses]) + "\n", encoding="utf-8")
        document: dict[str, Any] = {"cameras": [self._calibration(*it) for it in zip(rig.cameras, rig.mounted, strict=True)]}
        if rig.imu is not None:
            (room / "imu_0.csv").write_text(readings_csv(rig.imu, _READINGS), encoding="utf-8")
            document["imus"] = [_device(rig.imu.config)]
        (room / "calibration.yaml").write_text(f"%YAML 1.2\n---\n{dump_yaml(document)}", encoding="utf-8")

    def _calibration(self, camera: RigCamera, at: MountedCamera) -> dict[str, Any]:
        lens = camera.lens
        told: dict[str, Any] = {"cam_name": camera.path.name, "cam_type": "rgb", "cam_model": "pinhole"}
        if self._has_depth(camera.sequence):
            told |= {"cam_type": "rgb+depth", "depth_name": "depth_0", "depth_factor": STEPS_A_METRE}
        told |= {"focal_length": [lens.fx, lens.fy], "principal_point": [lens.cx, lens.cy]}
        if distortion := _DISTORTION[lens.model]:
            told |= {"distortion_type": distortion, "distortion_coefficients": list(lens.coefficients)}
        return told | {"image_dimension": [lens.width, lens.height], "fps": at.rate_hz, "T_BS": at.mounted.ravel().tolist()}


def _device(config: ImuConfig) -> dict[str, Any]:
    told: dict[str, Any] = {"imu_name": "imu_0", "a_max": config.accel_range_m_s2, "g_max": config.gyro_range_rad_s}
    told |= {"sigma_g_c": config.gyro_noise_rad_s, "sigma_gw_c": config.gyro_walk_rad_s2, "sigma_bg": config.gyro_bias_rad_s}
    told |= {"sigma_a_c": config.accel_noise_m_s2, "sigma_aw_c": config.accel_walk_m_s3, "sigma_ba": config.accel_bias_m_s2}
    told |= {"a0": [0.0] * 3, "g0": [0.0] * 3, "g": GRAVITY_M_S2, "s_a": [1.0] * 3, "fps": config.rate_hz}
    return told | {"T_BS": np.eye(4).ravel().tolist()}
