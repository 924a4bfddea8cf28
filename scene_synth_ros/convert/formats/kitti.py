"""KITTI odometry: grey pictures of a camera or a rectified pair, projections, times and true poses, for visual odometry.

Geiger, Lenz, Urtasun, "Are we ready for autonomous driving? The KITTI vision benchmark suite" (CVPR 2012), and the readme of its devkit.
``sequences/00`` has ``image_0`` (left), ``image_1`` (right), ``times.txt``, and ``calib.txt`` with a projection (3, 4) of each from the
left camera's frame; ``poses/00.txt`` the left camera's poses (3, 4) in its first one's frame, row by row.
"""

from pathlib import Path

import numpy as np

from scene_description import CameraPose
from scene_description.products import matmul
from scene_synth_ros.convert import camera
from scene_synth_ros.convert.files import write_png
from scene_synth_ros.convert.formats.euroc import to_grey
from scene_synth_ros.convert.formats.rig import STILL, RigCamera, RigWriter
from scene_synth_ros.convert.writer import ConvertError, Sequence, Source
from scene_synth_ros.dataset import Frame


class FormatWriter(RigWriter):
    """Writes KITTI's sequences, numbered as the rooms come."""

    takes_imu = False

    def begin(self, out: Path, source: Source) -> None:
        """Begin with no room."""
        super().begin(out, source)
        self._numbers: dict[str, int] = {}
        (out / "poses").mkdir()

    def begin_sequence(self, sequence: Sequence) -> RigCamera:
        """Make the folder of a camera.

        Raises:
            ConvertError: the lens bends, the shutter rolls, or it is a third camera.
        """
        lens = camera.lens_of(self.source.camera(sequence))
        if lens.model != "pinhole" or sequence.place > 1:
            raise camera.refuse_lens(lens, sequence.camera, self.name, "pinhole of one camera or a pair", "choose --to euroc or --camera")
        camera.refuse_rolling_shutter(self.source.frame(sequence, 0), sequence.camera, self.name)
        folder = self.out / "sequences" / f"{self._numbers.setdefault(sequence.folder, len(self._numbers)):02d}"
        made = RigCamera(folder, folder / f"image_{sequence.place}", sequence, lens)
        made.path.mkdir(parents=True)
        return made

    def encode(self, frame: Frame, number: int, state: RigCamera) -> tuple[CameraPose, int]:
        """Write the picture; return the pose."""
        write_png(state.path / f"{number:06d}.png", to_grey(frame[self.source.roles["picture"]]))
        return camera.camera_pose(frame), 0

    def end_sequence(self, state: RigCamera) -> None:
        """Write times and poses of the left camera, and the projection of each.

        Raises:
            ConvertError: the right camera is not beside the left one, looks another way, or lacks a frame of it.
        """
        rig, place = self.mount(state), state.sequence.place
        between = camera.rigid_inverse(rig.mounted[-1].mounted)
        if place == 0:
            first = camera.camera_from_world(state.poses[0])
            rows = [matmul(first, camera.world_from_camera(pose))[:3].ravel() for pose in state.poses]
            np.savetxt(self.out / "poses" / f"{state.room.name}.txt", rows, "%.12e")
            times = [(pose.stamp_ns - state.poses[0].stamp_ns) * 1e-9 for pose in state.poses]
            np.savetxt(state.room / "times.txt", times, "%.9e")
        same = [pose.stamp_ns for pose in rig.cameras[0].poses] == [pose.stamp_ns for pose in state.poses]
        if not same or np.abs(np.delete((between - np.eye(4)).ravel(), 3)).max() > STILL:
            expected = "expected a camera right beside the first one with the same frames, got another"
            raise ConvertError(f"{self.where(state)}: {expected}; --to euroc")
        lens = state.lens
        matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
        numbers = " ".join(f"{value:.12e}" for value in matmul(matrix, between[:3]).ravel())
        with (state.room / "calib.txt").open("a", encoding="utf-8") as file:
            file.write(f"P{place}: {numbers}\n")
