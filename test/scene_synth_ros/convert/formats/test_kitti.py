"""KITTI odometry folders, read by evo and OpenCV."""

import dataclasses

import cv2
import numpy as np
import pytest
from convert_bag import BROWN, PINHOLE, convert_bag, export
from evo.tools import file_interface

from scene_description.poses import world_from_optical
from scene_synth_ros.convert.writer import ConvertError

RIGHT = dataclasses.replace(PINHOLE, mount_m=(0.12, 0.0, 0.0))


@pytest.mark.parametrize("cameras", [{"left": PINHOLE, "right": RIGHT}, {"camera": PINHOLE}])
def test_points_fall_on_their_pixels_through_poses_and_projections(tmp_path, cameras):
    bag = convert_bag(**cameras)
    assert export(bag, "kitti", tmp_path / "out") == ()
    for room in (0, 1):
        folder = tmp_path / "out" / "sequences" / f"{room:02d}"
        poses = file_interface.read_kitti_poses_file(str(tmp_path / "out" / "poses" / f"{room:02d}.txt")).poses_se3
        np.testing.assert_allclose(poses[0], np.eye(4), atol=1e-12)
        projections = dict(line.split(": ") for line in (folder / "calib.txt").read_text().splitlines())
        assert len(projections) == len(cameras)
        frames = {name: [truth for truth in bag.frames[name] if truth.room == room] for name in cameras}
        lefts = [truth.pose for truth in next(iter(frames.values()))]
        times = np.loadtxt(folder / "times.txt")
        np.testing.assert_allclose(times, [(pose.stamp_ns - lefts[0].stamp_ns) * 1e-9 for pose in lefts], atol=1e-9)
        first_from_world = np.linalg.inv(world_from_optical(lefts[0].position_m, lefts[0].orientation))
        for number, truths in enumerate(frames.values()):
            projection = np.array(projections[f"P{number}"].split(), float).reshape(3, 4)
            assert projection[0, 3] == pytest.approx(-70.0 * 0.12 * number)
            for frame, (truth, pose) in enumerate(zip(truths, poses, strict=True)):
                pixels, points = truth.points()
                told = projection @ np.linalg.inv(pose) @ first_from_world @ np.column_stack([points, np.ones(len(points))]).T
                assert np.abs((told[:2] / told[2]).T - pixels).max() < 0.01
                grey = cv2.imread(str(folder / f"image_{number}" / f"{frame:06d}.png"), cv2.IMREAD_UNCHANGED)
                expected = cv2.cvtColor(truth.layers["color"], cv2.COLOR_RGB2GRAY)
                assert np.abs(grey.astype(int) - expected).max() <= 1


@pytest.mark.parametrize(
    ("cameras", "line"),
    [
        ({"camera": BROWN}, r"^kitti: camera /synth/camera: expected a lens pinhole of one camera or a pair, got brown_conrady"),
        (
            {"a": PINHOLE, "b": RIGHT, "c": PINHOLE},
            r"^kitti: camera /synth/c: expected a lens pinhole of one camera or a pair",
        ),
        ({"left": PINHOLE, "right": dataclasses.replace(PINHOLE, mount_m=(0.12, 0.0, 0.05))}, r"right beside the first one"),
    ],
)
def test_what_is_no_rectified_pair_is_refused(tmp_path, cameras, line):
    with pytest.raises(ConvertError, match=line):
        export(convert_bag(rooms=1, frames=1, **cameras), "kitti", tmp_path / "out")
