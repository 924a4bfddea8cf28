"""EuRoC (the ASL dataset format): a folder a room with ``mav0/cam0``, ``cam1`` ... and the true trajectory, for visual odometry and SLAM.

Burri et al., "The EuRoC micro aerial vehicle datasets" (IJRR 2016), section 3.  Pictures are grey, as the benchmark's are (luma of
ITU-R BT.601).  The body frame is that of the inertial measurement unit, ``imu0``, where the room has one, and the states are true ones at
its rate; else it is the optical frame of ``cam0``, and ``state_groundtruth_estimate0`` has its poses, velocities that are central
differences of its positions, and biases of 0.  ``T_BS`` of a camera is its place against the body, which must not change.  Stamps and names
of pictures have 19 digits, so that they sort by time.  ``orb_slam3.yaml`` and, with a device, ``open_vins`` beside ``mav0`` are for
programs that read such folders.
"""

import numpy as np
from numpy.typing import NDArray

from scene_description import CameraPose
from scene_description.products import matmul
from scene_synth_ros.convert.camera import Lens, camera_pose, lens_of, refuse_lens, shutter_notes
from scene_synth_ros.convert.files import write_png
from scene_synth_ros.convert.formats.euroc_imu import RoomImu, stamp_name, states_of, write_imu
from scene_synth_ros.convert.formats.kalibr import write_kalibr
from scene_synth_ros.convert.formats.orb_slam3 import settings_text
from scene_synth_ros.convert.formats.rig import RigCamera, RigWriter
from scene_synth_ros.convert.writer import Sequence
from scene_synth_ros.dataset import Frame

_LUMA = np.array([0.299, 0.587, 0.114], np.float32)
_STATE = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [],"
    " v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1],"
    " b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1],"
    " b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]"
)
_DISTORTION = {"pinhole": "radial-tangential", "brown_conrady": "radial-tangential", "kannala_brandt": "equidistant"}


class FormatWriter(RigWriter):
    """Writes sequences in EuRoC's form."""

    def begin_sequence(self, sequence: Sequence) -> RigCamera:
        """Make the folders of a camera.

        Raises:
            ConvertError: the lens has more coefficients than the format has places.
        """
        lens = lens_of(self.source.camera(sequence))
        if lens.model not in _DISTORTION or (lens.model == "brown_conrady" and lens.coefficients[4]):
            raise refuse_lens(lens, sequence.camera, self.name, "of plumb_bob without k3, or equidistant", "choose --to colmap")
        self.notes |= shutter_notes(self.source.frame(sequence, 0), sequence.camera, self.name)
        room = self.out / sequence.folder
        state = RigCamera(room, room / "mav0" / f"cam{sequence.place}", sequence, lens)
        (state.path / "data").mkdir(parents=True)
        return state

    def encode(self, frame: Frame, number: int, state: RigCamera) -> tuple[CameraPose, int]:
        """Write the picture; return the pose."""
        del number
        write_png(state.path / "data" / f"{stamp_name(frame.stamp_ns)}.png", to_grey(frame[self.source.roles["picture"]]))
        return camera_pose(frame), 0

    def end_sequence(self, state: RigCamera) -> None:
        """Write what belongs to a camera and, with the first one, to the body.

        Raises:
            ConvertError: the camera moves against the first one, or has no frame together with it.
        """
        rig, place = self.mount(state), state.sequence.place
        stamps = [stamp_name(pose.stamp_ns) for pose in state.poses]
        names = "".join(f"{stamp},{stamp}.png\n" for stamp in stamps)
        (state.path / "data.csv").write_text(f"#timestamp [ns],filename\n{names}", encoding="utf-8")
        (state.path / "sensor.yaml").write_text(camera_yaml(*rig.mounted[-1]), encoding="utf-8")
        if place == 0:
            _write_body(state, rig.imu)
        if place == state.sequence.cameras - 1:
            config = None if rig.imu is None else rig.imu.config
            (state.room / "orb_slam3.yaml").write_text(settings_text(rig.mounted, config), encoding="utf-8")
            if config is not None:
                write_kalibr(state.room / "open_vins", rig.mounted, config)


def _write_body(state: RigCamera, imu: RoomImu | None) -> None:
    """Write the states of a room's body, which frame that is, and its inertial measurement unit if it has one."""
    body = "cam0" if imu is None else "imu0"
    states = states_csv(state.poses) if imu is None else _states_text(states_of(imu))
    folder = state.room / "mav0" / "state_groundtruth_estimate0"
    folder.mkdir()
    (folder / "data.csv").write_text(states, encoding="utf-8")
    (folder / "sensor.yaml").write_text(_sensor(f"ground truth of {body}", "visual-inertial", np.eye(4)), encoding="utf-8")
    frame = "the optical frame of cam0" if imu is None else "that of imu0"
    (state.room / "mav0" / "body.yaml").write_text(f"comment: the body frame is {frame}\n", encoding="utf-8")
    if imu is not None:
        write_imu(state.room / "mav0" / "imu0", imu, _sensor("an IMU of scene_synth_ros", "imu", np.eye(4)))


def _states_text(states: list[tuple[int, list[float]]]) -> str:
    return "\n".join([_STATE, *(",".join([stamp_name(stamp), *map(repr, numbers)]) for stamp, numbers in states)]) + "\n"


def to_grey(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the luma (height, width) of a picture (height, width, 3), both uint8."""
    return np.asarray(np.rint(matmul(color, _LUMA))).astype(np.uint8)


def states_csv(poses: list[CameraPose]) -> str:
    """Return the trajectory: stamps in nanoseconds, positions, quaternions (w, x, y, z), velocities in the map, biases."""
    places = np.array([pose.position_m for pose in poses])
    times = np.array([pose.stamp_ns - poses[0].stamp_ns for pose in poses]) * 1e-9
    speeds = np.gradient(places, times, axis=0) if len(poses) > 1 else np.zeros_like(places)
    states = []
    for pose, speed in zip(poses, speeds.tolist(), strict=True):
        x, y, z, w = pose.orientation
        states.append((pose.stamp_ns, [float(number) for number in (*pose.position_m, w, x, y, z, *speed, *(0.0,) * 6)]))
    return _states_text(states)


def camera_yaml(lens: Lens, mounted: NDArray[np.float64], rate: float) -> str:
    """Return ``sensor.yaml`` of a camera; ``mounted`` (4, 4) takes points of its optical frame to the body."""
    coefficients = (*lens.coefficients, *(0.0,) * 4)[:4]
    return (
        _sensor("a camera of scene_synth_ros", "camera", mounted)
        + f"rate_hz: {rate!r}\nresolution: [{lens.width}, {lens.height}]\ncamera_model: pinhole\n"
        + f"intrinsics: {[lens.fx, lens.fy, lens.cx, lens.cy]} # fu, fv, cu, cv\n"
        + f"distortion_model: {_DISTORTION[lens.model]}\ndistortion_coefficients: {list(coefficients)}\n"
    )


def _sensor(comment: str, kind: str, mounted: NDArray[np.float64]) -> str:
    rows = ",\n         ".join(", ".join(repr(number) for number in row) for row in mounted.tolist())
    return f"sensor_type: {kind}\ncomment: {comment}\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{rows}]\n"
