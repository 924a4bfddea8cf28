"""The inertial measurement unit of a room in EuRoC's form: ``imu0`` and the states of the body, which then is the device's frame.

What the device reads is made again from the room's motion and the settings of a frame: the same numbers as on ``imu/data``.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from renderer.body.config import ImuConfig
from renderer.body.imu import ImuErrors, ImuReadings, device_kinematics, read_imu
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, from_mapping
from scene_description.kinematics import Floats, Kinematics
from scene_description.motion_of_poses import motion_of
from scene_description.products import matmul
from scene_synth_ros.convert.camera import camera_from_world
from scene_synth_ros.convert.writer import ConvertError
from scene_synth_ros.dataset import Frame

_READINGS = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
)
_DIGITS = 19


def stamp_name(stamp_ns: int) -> str:
    """Return a stamp in nanoseconds as files are named: all with as many digits, so that they sort by time."""
    return f"{stamp_ns:0{_DIGITS}d}"


class RoomImu(NamedTuple):
    """The device of a room: settings, readings, how it moves at their true times, and the biases (n, 3) of gyroscope and accelerometer."""

    config: ImuConfig
    readings: ImuReadings
    device: Kinematics
    gyro_bias: Floats
    accel_bias: Floats

    def from_camera(self, frame: Frame) -> Floats:
        """Return the matrix (4, 4) that takes points of a camera's optical frame, as it is at a frame, to the device's."""
        motion, start_ns = motion_of(frame.scene), frame.scene.camera_path[0].stamp_ns
        at = device_kinematics(motion, self.config, np.array([(frame.stamp_ns - start_ns) * 1e-9]))
        (x, y, z), (qx, qy, qz, qw) = at.position_m[0].tolist(), at.quaternion[0].tolist()
        device = CameraPose(stamp_ns=frame.stamp_ns, position_m=(x, y, z), orientation=(qx, qy, qz, qw))
        return np.asarray(matmul(camera_from_world(device), frame.matrix))


def room_imu(frame: Frame) -> RoomImu | None:
    """Return the device of a frame's room; None where there is none.

    Raises:
        ConvertError: the base was driven, so that the room does not tell how it moved.
    """
    settings = frame.settings or {}
    if "imu" not in settings or not frame.has_scene:
        return None
    if "drive" in settings:
        raise ConvertError(
            f"{frame.scene.id}: expected a robot on its planned path, got one that was driven; take its readings from imu/data"
        )
    config, scene = from_mapping(ImuConfig, settings["imu"], "imu"), frame.scene
    motion, start_ns, end_ns = motion_of(scene), scene.camera_path[0].stamp_ns, scene.camera_path[-1].stamp_ns
    read = read_imu(motion, config, start_ns, end_ns, scene_key(scene))
    device = device_kinematics(motion, config, np.asarray((read.stamps_ns - start_ns) * 1e-9, np.float64))
    return RoomImu(config, read, device, *ImuErrors(config, scene_key(scene)).biases(len(read.stamps_ns)))


def readings_csv(imu: RoomImu, head: str) -> str:
    """Return stamps by the device's clock, angular velocities and specific forces as text with commas, below a line of titles."""
    offset_ns = round(imu.config.clock_offset_s * 1e9)
    rows = np.hstack([imu.readings.rate_rad_s, imu.readings.force_m_s2]).tolist()
    stamps = (imu.readings.stamps_ns + offset_ns).tolist()
    lines = [f"{stamp_name(stamp)},{','.join(map(repr, row))}" for stamp, row in zip(stamps, rows, strict=True)]
    return "\n".join([head, *lines]) + "\n"


def write_imu(folder: Path, imu: RoomImu, sensor: str) -> None:
    """Write ``imu0``: readings and calibration; ``sensor``: the lines that every calibration has."""
    folder.mkdir()
    (folder / "data.csv").write_text(readings_csv(imu, _READINGS), encoding="utf-8")
    (folder / "sensor.yaml").write_text(sensor + f"rate_hz: {imu.config.rate_hz!r}\n" + "".join(noise_rows(imu.config)), encoding="utf-8")


def states_of(imu: RoomImu) -> list[tuple[int, list[float]]]:
    """Return stamp and state of the body at every sample: place, orientation (w first), velocity, both biases."""
    at = imu.device
    rows = np.hstack([at.position_m, at.quaternion[:, [3, 0, 1, 2]], at.velocity_m_s, imu.gyro_bias, imu.accel_bias])
    return list(zip(imu.readings.stamps_ns.tolist(), rows.tolist(), strict=True))


def noise_rows(config: ImuConfig) -> list[str]:
    """Return noise and walk as lines of YAML: what the Allan deviation shows, and beside each what estimators are commonly told."""
    rows = (
        ("gyroscope_noise_density", config.gyro_noise_rad_s, "rad / s / sqrt(Hz)"),
        ("gyroscope_random_walk", config.gyro_walk_rad_s2, "rad / s^2 / sqrt(Hz)"),
        ("accelerometer_noise_density", config.accel_noise_m_s2, "m / s^2 / sqrt(Hz)"),
        ("accelerometer_random_walk", config.accel_walk_m_s3, "m / s^3 / sqrt(Hz)"),
    )
    return [f"{name}: {value!r}  # [{unit}] for estimators: {value * config.inflation:.6g}\n" for name, value, unit in rows]
