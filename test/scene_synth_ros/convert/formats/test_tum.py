"""TUM folders, read by evo and OpenCV."""

import dataclasses

import cv2
import numpy as np
import pytest
from convert_bag import BROWN_K3, FISHEYE, PINHOLE, convert_bag, export
from evo.tools import file_interface

from scene_synth_ros.convert.writer import ConvertError


@pytest.mark.parametrize("camera", [PINHOLE, BROWN_K3])
def test_points_fall_on_their_pixels_and_depth_comes_back(tmp_path, camera):
    bag = convert_bag(camera=camera)
    assert export(bag, "tum", tmp_path / "out") == ()
    for room in (0, 1):
        folder = tmp_path / "out" / f"room_{room:04d}"
        trajectory = file_interface.read_tum_trajectory_file(str(folder / "groundtruth.txt"))
        fx, fy, cx, cy, *coefficients = np.loadtxt(folder / "calibration.txt")
        rows = [line.split() for line in (folder / "associations.txt").read_text().splitlines()]
        truths = [truth for truth in bag.frames["camera"] if truth.room == room]
        assert len(truths) == len(rows) == trajectory.num_poses == 3
        for truth, matrix, row in zip(truths, trajectory.poses_se3, rows, strict=True):
            assert row[0] == row[2] == f"{truth.pose.stamp_ns / 1e9:.9f}"
            pixels, points = truth.points()
            seen = np.linalg.inv(matrix)
            told, _ = cv2.projectPoints(
                points, cv2.Rodrigues(seen[:3, :3])[0], seen[:3, 3], np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(coefficients)
            )
            assert np.abs(told[:, 0] - pixels).max() < 0.01
            depth = cv2.imread(str(folder / row[3]), cv2.IMREAD_UNCHANGED) / 5000.0
            true = truth.layers["depth"]
            np.testing.assert_allclose(depth[np.isfinite(true)], true[np.isfinite(true)], atol=1.01e-4)
            assert (depth[~np.isfinite(true)] == 0).all()
            np.testing.assert_array_equal(cv2.imread(str(folder / row[1]))[..., ::-1], truth.layers["color"])


def test_the_lists_name_what_is_there(tmp_path):
    export(convert_bag(), "tum", tmp_path / "out", rooms=(1, 2), every=2)
    folder = tmp_path / "out" / "room_0001"
    for name in ("rgb", "depth"):
        lines = [line.split() for line in (folder / f"{name}.txt").read_text().splitlines() if not line.startswith("#")]
        assert [word for _, word in lines] == sorted(f"{name}/{path.name}" for path in (folder / name).iterdir())
        assert len(lines) == 2 and {path.name for path in (tmp_path / "out").iterdir()} == {"room_0001"}


def test_a_lens_without_a_place_in_the_table_is_refused(tmp_path):
    with pytest.raises(
        ConvertError, match=r"^tum: camera /synth/camera: expected a lens pinhole or plumb_bob, got kannala_brandt .*--to colmap"
    ):
        export(convert_bag(camera=FISHEYE), "tum", tmp_path / "out")


def test_pixels_too_far_away_are_told(tmp_path):
    bag = convert_bag(rooms=1, frames=1, camera=dataclasses.replace(PINHOLE, mount_m=(0.0, 0.0, -14.0)))
    far = int((bag.frames["camera"][0].layers["depth"] > 65535 / 5000).sum() - np.isinf(bag.frames["camera"][0].layers["depth"]).sum())
    assert far > 0
    (note,) = export(bag, "tum", tmp_path / "out")
    assert note == f"tum: {far} pixels lie beyond 13.1 m, the largest depth that it stores; they have none there"
