"""The cameras of a room as one rig: what formats for odometry and SLAM share.

The body frame is that of the inertial measurement unit where the room has one that the format takes, else the optical frame of the
first camera.  A camera must not move against the first one.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description import CameraPose
from scene_description.products import matmul
from scene_synth_ros.convert.camera import Lens, camera_from_world, world_from_camera
from scene_synth_ros.convert.formats.euroc_imu import RoomImu, room_imu
from scene_synth_ros.convert.writer import ConvertError, Sequence, Source, Writer

STILL = 1e-6
"""How far, in metres and as entries of a rotation, a camera may move against the first one: what rounding does."""


class MountedCamera(NamedTuple):
    """A camera on the body: its lens, the matrix (4, 4) that takes points of its optical frame to the body, frames a second."""

    lens: Lens
    mounted: NDArray[np.float64]
    rate_hz: float


@dataclass(slots=True)
class RigCamera:
    """A camera of a room: the folders of the room and of its pictures, its lens, and the poses of its frames."""

    room: Path
    path: Path
    sequence: Sequence
    lens: Lens
    poses: list[CameraPose] = field(default_factory=list)


@dataclass(slots=True)
class Rig:
    """The body of a room: ``from_first`` (4, 4) takes points of its first camera to it; its device; its cameras, and where they are."""

    from_first: NDArray[np.float64]
    imu: RoomImu | None
    cameras: list[RigCamera] = field(default_factory=list)
    mounted: list[MountedCamera] = field(default_factory=list)


class RigWriter(Writer):
    """Keeps the poses of cameras, and finds where they are on their bodies."""

    takes_imu = True

    def begin(self, out: Path, source: Source) -> None:
        """Begin with no room."""
        super().begin(out, source)
        self._rigs: dict[str, Rig] = {}

    def take(self, item: tuple[CameraPose, int], state: RigCamera) -> None:
        """Keep the pose of a frame, and count its pixels whose depth is too large."""
        state.poses.append(item[0])
        self.beyond += item[1]

    def mount(self, state: RigCamera) -> Rig:
        """Return the rig of a camera's room, with it.

        Raises:
            ConvertError: the camera moves against the first one, or has no frame together with it.
        """
        sequence, turned = state.sequence, np.eye(4)
        if sequence.place == 0:
            frame = self.source.frame(sequence, 0)
            imu = room_imu(frame) if self.takes_imu else None
            self._rigs[sequence.folder] = Rig(np.eye(4) if imu is None else imu.from_camera(frame), imu)
        rig = self._rigs[sequence.folder]
        if sequence.place:
            turned = _mounted_on_first(rig.cameras[0].poses, state.poses, self.where(state))
        rig.cameras.append(state)
        rig.mounted.append(MountedCamera(state.lens, matmul(rig.from_first, turned), rate_hz(state.poses)))
        if sequence.place == sequence.cameras - 1:
            del self._rigs[sequence.folder]
        return rig

    def where(self, state: RigCamera) -> str:
        """Return what an error about a camera begins with."""
        return f"{self.name}: {self.source.name}: {state.sequence.name}: camera {state.sequence.camera}"


def _mounted_on_first(first: list[CameraPose], poses: list[CameraPose], where: str) -> NDArray[np.float64]:
    by_stamp = {pose.stamp_ns: pose for pose in first}
    paired = [pose for pose in poses if pose.stamp_ns in by_stamp]
    found: list[NDArray[np.float64]] = [matmul(camera_from_world(by_stamp[pose.stamp_ns]), world_from_camera(pose)) for pose in paired]
    if not found:
        raise ConvertError(f"{where}: expected frames with the stamps of the first camera, got none; choose one camera: --camera NAME")
    if max(float(np.abs(matrix - found[0]).max()) for matrix in found) > STILL:
        raise ConvertError(f"{where}: expected a camera that is fixed to the first one, got one that moves; choose one: --camera NAME")
    return found[0]


def rate_hz(poses: list[CameraPose]) -> float:
    """Return the mean rate of frames; 0 of a single one."""
    span_ns = poses[-1].stamp_ns - poses[0].stamp_ns
    return 1e9 * (len(poses) - 1) / span_ns if span_ns else 0.0
