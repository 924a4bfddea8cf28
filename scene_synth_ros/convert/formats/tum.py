"""TUM RGB-D: a folder a room with pictures, depth and the true trajectory, as SLAM programs read them.

File formats: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats.  Depth is PNG of 16 bits with 5000 steps a metre, 0 where
there is none.  Stamps are seconds with nine digits after the point, equal for picture, depth and pose of a frame; in names of files they
have ten before it, so that these sort by time.  ``associations.txt`` joins them as the benchmark's ``associate.py`` does;
``calibration.txt`` has the row of the benchmark's table of intrinsics, pixel centres at integers.
"""

from scene_description import CameraPose
from scene_description.tum_trajectory import stamp_name, stamp_text, trajectory_to_tum
from scene_synth_ros.convert.camera import camera_pose, lens_of, refuse_lens, shutter_notes
from scene_synth_ros.convert.files import write_depth, write_picture
from scene_synth_ros.convert.formats.rig import RigCamera, RigWriter
from scene_synth_ros.convert.writer import Sequence
from scene_synth_ros.dataset import Frame

STEPS_A_METRE = 5000.0
_LENSES = ("pinhole", "brown_conrady")


class FormatWriter(RigWriter):
    """Writes TUM RGB-D sequences."""

    steps_a_metre = STEPS_A_METRE

    def begin_sequence(self, sequence: Sequence) -> RigCamera:
        """Make the folders of a sequence, and write its intrinsics.

        Raises:
            ConvertError: the lens is none that the benchmark's table has columns for.
        """
        lens = lens_of(self.source.camera(sequence))
        if lens.model not in _LENSES:
            raise refuse_lens(lens, sequence.camera, self.name, "pinhole or plumb_bob", "choose --to colmap or nerfstudio")
        self.notes |= shutter_notes(self.source.frame(sequence, 0), sequence.camera, self.name)
        path = self.out / sequence.name
        for name in ("rgb", "depth"):
            (path / name).mkdir(parents=True)
        numbers = (lens.fx, lens.fy, lens.cx, lens.cy, *(*lens.coefficients, *(0.0,) * 5)[:5])
        row = " ".join(repr(float(number)) for number in numbers)
        (path / "calibration.txt").write_text(f"# fx fy cx cy d0 d1 d2 d3 d4\n{row}\n", encoding="utf-8")
        return RigCamera(path, path, sequence, lens)

    def encode(self, frame: Frame, number: int, state: RigCamera) -> tuple[CameraPose, int]:
        """Write picture and depth; return the pose, and how many pixels are too far away."""
        del number
        name = stamp_name(frame.stamp_ns)
        write_picture(frame, self.source.roles["picture"], state.path / "rgb" / name, jpeg=False)
        beyond = write_depth(state.path / "depth" / f"{name}.png", frame[self.source.roles["depth"]], STEPS_A_METRE)
        return camera_pose(frame), beyond

    def end_sequence(self, state: RigCamera) -> None:
        """Write the lists and the trajectory."""
        sequence = state.path.name
        stamps = [(stamp_text(pose.stamp_ns), stamp_name(pose.stamp_ns)) for pose in state.poses]
        lists = {
            "rgb.txt": ("color images", [f"{stamp} rgb/{name}.png" for stamp, name in stamps]),
            "depth.txt": ("depth maps", [f"{stamp} depth/{name}.png" for stamp, name in stamps]),
        }
        for file, (what, rows) in lists.items():
            head = f"# {what}\n# file: '{sequence}'\n# timestamp filename\n"
            (state.path / file).write_text(head + "".join(f"{row}\n" for row in rows), encoding="utf-8")
        joined = "".join(f"{stamp} rgb/{name}.png {stamp} depth/{name}.png\n" for stamp, name in stamps)
        (state.path / "associations.txt").write_text(joined, encoding="utf-8")
        (state.path / "groundtruth.txt").write_text(trajectory_to_tum(state.poses), encoding="utf-8")
